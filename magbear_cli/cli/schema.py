"""``magbear schema``: the JSON Schema of study files, for editors."""

from __future__ import annotations

import click


@click.command()
def schema() -> None:
    """Print the JSON Schema of study files, for editors.

    \b
    Example:  magbear schema > magbear.schema.json
    """
    from magbear_cli.cli.output import put_json
    from magbear_cli.spec import json_schema

    put_json(json_schema())
