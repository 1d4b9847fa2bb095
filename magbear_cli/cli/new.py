"""``magbear new``: start a study."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("name", default="study")
def new(name: str) -> None:
    """Write NAME.yaml, a commented study that runs as it is.

    The JSON Schema for editors goes beside it. An existing study is not overwritten.

    \b
    Example:  magbear new spindle && magbear run spindle.yaml
    """
    import json

    from magbear_cli.cli.output import put, tell
    from magbear_cli.spec import json_schema, template
    from magbear_cli.spec.template import SCHEMA_FILE

    path = Path(name if name.endswith((".yaml", ".yml")) else f"{name}.yaml")
    schema = path.parent / SCHEMA_FILE
    _write(path, template(path.stem), "x")
    _write(schema, json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n", "w")
    put(str(path))
    put(str(schema))
    tell(f"next: magbear run {path}")


def _write(path: Path, text: str, mode: str) -> None:
    from magbear_cli.errors import InputError

    try:
        with path.open(mode, encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path} exists and is not overwritten: give another name") from None
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}") from error
