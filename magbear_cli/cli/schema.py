"""``magbear schema``: the JSON Schema of study files, for editors."""

from __future__ import annotations

import click


@click.command()
def schema() -> None:
    """Print the JSON Schema of study files, for editors that complete and check YAML.

    \b
    Example:  magbear schema > magbear.schema.json
    """
    import json

    from magbear_cli.spec import json_schema

    click.echo(json.dumps(json_schema(), indent=2, ensure_ascii=False))
