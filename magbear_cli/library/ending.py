"""The end of a run: the one place where the results file of a study is written, for the command and for Python."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from magbear_cli.spec import Study
    from magbear_cli.store.run_directory import RunDirectory
    from magbear_cli.study.outcome import StudyResults
    from magbear_cli.study.plan import Case


def end_run(
    study: Study,
    cases: Sequence[Case],
    directory: RunDirectory,
    meanwhile: Callable[[], object] = lambda: None,
) -> StudyResults:
    """Write the results file from what is stored of the cases, each with everything it has.

    The answer is for tables and figures: of many cases only the first ones have their controllers and samples. It must
    not be written over the file; whoever needs all of them reads the file.

    Parameters
    ----------
    study : gives the name and the report section
    cases : all cases of the study, in its order; those without a stored outcome are left out
    directory : the run's directory, held by the caller
    meanwhile : called after each case

    Raises
    ------
    magbear_cli.ResumableError
        when the system refuses; an older results file then stands as it was.
    """
    return directory.gather(cases, study.name, study.report, meanwhile)
