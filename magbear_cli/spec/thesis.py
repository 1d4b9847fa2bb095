"""The thesis as data: its claims with their tolerances, and its figures, read from configs/thesis and believed."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, ValidationError

import magbear_cli
from magbear_cli.spec.files import read_text
from magbear_cli.spec.nodes import plain
from magbear_cli.spec.parts import configs_folder
from magbear_cli.spec.problems import Faults
from magbear_cli.spec.reading import read_nodes
from magbear_cli.spec.section import Section
from magbear_cli.spec.sentences import note_errors

Kind = TypeVar("Kind", bound=Section)
Where = dict[str, Any]  # dotted keys of a case's inputs with the values they must have; `study` names the study

Quantity = Literal[
    "mu", "singular_value", "sensitivity", "complementary_sensitivity", "controller_gain", "position", "current",
    "error", "reference", "table", "peak_gain", "peak_control_sensitivity",
]  # fmt: skip


class ClaimEntry(Section):
    """One claim of the thesis, and what is needed to judge it."""

    id: str = Field(pattern=r"^C\d\d$", description="Its number in the ledger.")
    place: str = Field(min_length=1, description="Where the thesis makes it.")
    claim: str = Field(min_length=1, description="What it says, in our words.")
    printed: str = Field(min_length=1, description="The figure it prints.")
    judge: str = Field(pattern=r"^[a-z_]+$", description="The function that looks at the cases.")
    cases: dict[str, Where] = Field(description="The cases it looks at, by the name the function gives them.")
    figures: dict[str, float] = Field(default_factory=dict, description="The printed figures as numbers, by name.")
    tolerance: dict[str, float] = Field(default_factory=dict, description="How near is near enough, by name.")


class Panel(Section):
    """One column of panels of a figure."""

    title: str = Field(description="What the column shows.")
    cases: list[Where] = Field(min_length=1, description="The cases that are drawn, in this order.")
    label: str = Field("", description="A curve's name; {dotted.key} stands for an input of its case.")
    steps: Where = Field(default_factory=dict, description="Which of a case's simulated runs are drawn.")
    masses_kg: list[float] | None = Field(
        None, description="The masses whose loops are drawn; null: all that are there."
    )


class FigureEntry(Section):
    """The counterpart of a figure of the thesis."""

    id: str = Field(pattern=r"^fig_\d_\d+(_[a-z_]+)?$", description="Its name, after the thesis's number.")
    shows: str = Field(min_length=1, description="What there is to see, in our words.")
    rows: list[Quantity] = Field(min_length=1, max_length=2, description="The quantities, one row of panels each.")
    columns: list[Panel] = Field(min_length=1, max_length=3, description="The thesis's way, and ours beside it.")
    table: str | None = Field(None, description="The table drawn, for the quantity `table`.")
    curves: list[str] = Field(
        default_factory=list, description="The table's columns drawn; all but the first if empty."
    )
    across: str | None = Field(None, description="The table's column drawn over; null: the first.")
    view: Annotated[list[float], Field(min_length=2, max_length=2)] | None = Field(
        None, description="Ends of the abscissa."
    )
    height: Annotated[list[float], Field(min_length=2, max_length=2)] | None = Field(
        None, description="Ends of the ordinate."
    )
    ordinate: str | None = Field(None, description="What a table's ordinate is called; null: as the table says.")
    by: str | None = Field(None, description="The table's column whose values are told apart, one curve each.")
    logarithmic: str = Field("", pattern=r"^(x|y|xy|)$", description="The axes of a table that are logarithmic.")
    mark: float | None = Field(None, description="A level to draw across, where the quantity has none of its own.")

    @property
    def studies(self) -> set[str]:
        """The names of the studies it draws from."""
        return {str(where["study"]) for panel in self.columns for where in panel.cases}


class Claims(Section):
    """The file of the claims."""

    claims: list[ClaimEntry] = Field(min_length=1)
    comparison: list[Where] = Field(default_factory=list, description="The cases compared beside the claims.")


class Figures(Section):
    """The file of the figures."""

    figures: list[FigureEntry] = Field(min_length=1)


@cache
def studies_folder() -> Path:
    """The folder of the studies that come with the project: in the installed package, or beside it in a checkout."""
    package = Path(magbear_cli.__file__).resolve().parent
    inside = package / "studies"
    return inside if inside.is_dir() else package.parent / "studies"


def thesis_study(name: str) -> Path:
    """The file of a study of the thesis."""
    return studies_folder() / "thesis" / f"{name}.yaml"


def read_claims(path: Path | None = None) -> tuple[ClaimEntry, ...]:
    """The claims of the ledger, in its order.

    Raises
    ------
    StudyError
        when the file cannot be believed.
    """
    return tuple(_read(Claims, path or configs_folder() / "thesis" / "claims.yaml").claims)


def read_comparison(path: Path | None = None) -> tuple[Where, ...]:
    """The cases of the comparison that stands beside the claims.

    Raises
    ------
    StudyError
        when the file cannot be believed.
    """
    return tuple(_read(Claims, path or configs_folder() / "thesis" / "claims.yaml").comparison)


def read_figures(path: Path | None = None) -> tuple[FigureEntry, ...]:
    """The figures, in the order of the thesis.

    Raises
    ------
    StudyError
        when the file cannot be believed.
    """
    return tuple(_read(Figures, path or configs_folder() / "thesis" / "figures.yaml").figures)


def _read(kind: type[Kind], path: Path) -> Kind:
    faults = Faults()
    text = read_text(path, faults)
    root = read_nodes(text or "", str(path), faults)
    faults.stop()
    if root is None:
        raise RuntimeError(f"{path} was refused without a reason")
    try:
        return kind.model_validate(plain(root))
    except ValidationError as error:
        note_errors(error, root, faults)
        faults.stop()
        raise
