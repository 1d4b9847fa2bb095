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
    """List the cases of a STUDY with their identities.

    Nothing is computed and nothing is written. With --json each case carries its resolved inputs.

    \b
    Example:  magbear plan study.yaml --set controller.method=hinf
    """
    import json

    from magbear_cli.cli.output import put, put_json
    from magbear_cli.library.planning import planned_cases
    from magbear_cli.spec import read_study

    read = read_study(study, overrides)
    cases = planned_cases(read)
    if as_json:
        put_json({"study": read.name, "cases": [{"id": case.id, "index": case.index, **case.inputs} for case in cases]})
        return
    for case in cases:
        swept = read.swept(case.index)
        what = ", ".join(f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in swept.items())
        put(f"{case.id}  {what or case.inputs['controller']['method']}")
