"""What every section of a study file is: strict, closed to unknown keys, finite; and the numbers it is made of."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

FAULT: Final = "magbear"  # the type of the errors that carry a sentence of ours


class Section(BaseModel):
    """A mapping of the study file."""

    model_config = ConfigDict(defer_build=True, strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


class PartName:
    """Says in the JSON Schema that a section may also be the name of a part of configs/, or a path to one."""

    def __init__(self, folder: str) -> None:
        """Keep the folder of configs/ the part is looked for in."""
        self.folder = folder

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The section's schema, or a string."""
        from magbear_cli.spec.parts import part_names  # noqa: PLC0415 - parts stand above sections

        names = list(part_names(self.folder))
        text = {
            "type": "string",
            "description": f"A part of configs/{self.folder}, or the path of a .yaml file from the study's folder.",
            "anyOf": [{"enum": names}, {"pattern": r"\.ya?ml$"}],
        }
        return {"anyOf": [text, handler(core)]}


def fault(code: str, sentence: str, remedy: str = "", at: tuple[str, ...] = ()) -> PydanticCustomError:
    """An error for a validator to raise: the sentence continues the key's name, ``at`` leads below the key."""
    return PydanticCustomError(FAULT, "{sentence}", {"code": code, "sentence": sentence, "remedy": remedy, "at": at})


# Limits are wide: they stop a value in the wrong unit (400 for 400 µm) and keep powers of numbers finite.
Positive = Annotated[float, Field(gt=0, le=1e12)]
NonNegative = Annotated[float, Field(ge=0, le=1e12)]
Tiny = Annotated[float, Field(ge=1e-30, le=1e12)]  # intensities and penalties
Mass = Annotated[float, Field(ge=1e-6, le=1e6)]
Omega = Annotated[float, Field(ge=1e-3, le=1e9)]
Length = Annotated[float, Field(ge=1e-7, le=0.1)]
Signed = Annotated[float, Field(ge=-1e9, le=1e9)]
