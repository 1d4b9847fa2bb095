"""``magbear merge``: the parts of a study, computed apart, put together."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from magbear_cli.cli.options import RESULTS, as_json, no_lock, usable_directory
from magbear_cli.errors import ExitCode, InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from magbear_cli.store.run_directory import RunDirectory
    from magbear_cli.study.plan import Case


@click.command()
@click.argument("directories", type=RESULTS, nargs=-1, required=True, metavar="DIR...")
@click.option("-o", "--output", type=RESULTS, help="Directory of the whole run.  [default: out/STUDY_NAME]")
@click.option("--progress/--no-progress", default=None, help="Show progress.  [default: on a terminal]")
@click.option("--accept-mixed", is_flag=True, help="Take cases of another toolchain; the results name it.")
@no_lock
@as_json
def merge(
    directories: tuple[Path, ...],
    output: Path | None,
    *,
    progress: bool | None,
    accept_mixed: bool,
    no_lock: bool,
    as_json: bool,
) -> int:
    """Put the parts of a study together as one run.

    DIR... are directories of ``magbear run --shard I/N`` of one and the same study, here or on other machines of the
    same kind. What is stored of a case is taken as it is; the results file has the same bytes as that of one run.
    Cases that no part has are named, and the exit code is 3.

    \b
    Example:  magbear merge out/sweep-0-of-2 out/sweep-1-of-2 -o out/sweep
    """
    from magbear_cli.cli.output import tell
    from magbear_cli.cli.session import Request, conclude, default_output
    from magbear_cli.library.planning import planned_cases
    from magbear_cli.spec import read_study_text
    from magbear_cli.store.run_directory import RunDirectory

    text = _common_text(directories)
    study = read_study_text(text, str(directories[0] / "study.yaml"), (), directories[0])
    cases = planned_cases(study)
    path = usable_directory(default_output(study.name) if output is None else output)
    with RunDirectory(path, text, accept_mixed=accept_mixed, must_lock=not no_lock) as whole:
        for part in directories:
            if part.resolve() != path.resolve():
                _take(part, text, cases, whole, must_lock=not no_lock)
        missing = whole.missing(cases)
        for note in dict.fromkeys(whole.notes):
            tell(f"note: {note}")
        tell(f"{len(cases) - len(missing)} of {len(cases)} cases are there")
        for case in missing[:10]:
            tell(f"missing: {case.id}, in part {case.index % len(directories)}/{len(directories)}")
        code = conclude(study, (cases, cases), whole, Request(progress=progress, as_json=as_json))
    return ExitCode.SOME_FAILED if missing else code


def _common_text(directories: Sequence[Path]) -> str:
    """The study of all parts.

    Raises
    ------
    InputError
        when a directory holds no run, or two hold runs of different studies.
    """
    texts = {}
    for directory in directories:
        try:
            texts[directory] = (directory / "study.yaml").read_bytes().decode("utf-8", "surrogateescape")
        except OSError as error:
            raise InputError(f"{directory}: this is not the directory of a run: {error.strerror}") from error
    first = directories[0]
    for directory, text in texts.items():
        if text != texts[first]:
            raise InputError(f"{directory} is a run of another study than {first}; merge parts of one study")
    return texts[first]


def _take(part: Path, text: str, cases: Sequence[Case], whole: RunDirectory, *, must_lock: bool) -> None:
    """Store each case that the whole lacks and the part has, while nobody else works in the part."""
    from magbear_cli.store.run_directory import RunDirectory

    with RunDirectory(part, text, accept_mixed=whole.is_mixed_accepted, must_lock=must_lock) as source:
        lacking = whole.missing(cases)
        whole.adopt(source, lacking)
        source.missing(lacking)
        whole.notes += source.notes
