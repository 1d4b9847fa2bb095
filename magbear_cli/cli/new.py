"""``magbear new``: start a study."""

from __future__ import annotations

from pathlib import Path

import click

from magbear_cli.errors import InputError


@click.command()
@click.argument("name", default="study")
def new(name: str) -> None:
    """Write NAME.yaml, a commented study that runs as it is, and the schema for editors beside it.

    \b
    Example:  magbear new spindle && magbear run spindle.yaml
    """
    import json

    from magbear_cli.spec import json_schema, template
    from magbear_cli.spec.template import SCHEMA_FILE

    path = Path(name if name.endswith((".yaml", ".yml")) else f"{name}.yaml")
    text = template(path.stem)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path} exists and is not overwritten: give another name") from None
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}") from error
    schema = path.parent / SCHEMA_FILE
    schema.write_text(json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n", "utf-8")
    click.echo(path)
    click.echo(schema)
    click.echo(f"next: magbear run {path}", err=True)
