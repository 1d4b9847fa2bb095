"""``magbear plan``: which cases a study would compute."""

from __future__ import annotations

from pathlib import Path

import click

from magbear_cli.cli.options import STUDY, as_json, overrides


@click.command()
@click.argument("study", type=STUDY)
@overrides
@as_json
def plan(study: Path, overrides: tuple[str, ...], *, as_json: bool) -> None:
    """List the cases of a STUDY with their identities; nothing is computed and nothing is written.

    \b
    Example:  magbear plan study.yaml --set controller.method=hinf
    """
    import json

    from magbear_cli.cli.stored import with_stored_controllers
    from magbear_cli.spec import read_study
    from magbear_cli.study.plan import plan_cases

    read = read_study(study, overrides)
    cases = plan_cases(with_stored_controllers(inputs, read.folder) for inputs in read.cases())
    if as_json:
        listed = [{"id": case.id, "index": case.index, **case.inputs} for case in cases]
        click.echo(json.dumps({"study": read.name, "cases": listed}, indent=2))
        return
    for case in cases:
        swept = read.swept(case.index)
        what = ", ".join(f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in swept.items())
        click.echo(f"{case.id}  {what or case.inputs['controller']['method']}")
