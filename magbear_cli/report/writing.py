"""The report on disk: one page, its figures as SVG, PNG and PDF, and the numbers behind each as CSV."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from magbear_cli.claims.comparison import Comparison
from magbear_cli.claims.ledger import JudgedClaim
from magbear_cli.errors import ResumableError
from magbear_cli.report.matplotlib_home import settle_matplotlib_home
from magbear_cli.report.sheet import Print
from magbear_cli.spec.thesis import FigureEntry
from magbear_cli.study.outcome import StudyResults

PAGE = "index.html"
FOLDERS = ("figures", "tables")
_OURS = re.compile(
    r"(mu|sensitivity|control_sensitivity|nyquist|controller_gain|step|poles|limitation|limits|least_current|orders|trade_off|cases|fig_\d_\d+)([-_][A-Za-z0-9_]+)*\.(svg|png|pdf|csv)"
)


def write_report(
    results: StudyResults,
    directory: Path,
    *,
    processes: int = 1,
    sheets: Iterable[Print] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Write the report of a study and answer the page's path; the same study gives the same bytes.

    Parameters
    ----------
    results : the study
    directory : where ``index.html``, ``figures/`` and ``tables/`` go; figures of an earlier report that are not part
        of this one are taken away
    processes : that draw, where there are many figures
    sheets : the figures in their order, where somebody has them drawn already
    progress : told the name of each figure when it is drawn

    Raises
    ------
    ResumableError
        when the system refuses a file; an older page then stands as it was.
    """
    settle_matplotlib_home()
    from magbear_cli.report.rendering import report_files  # noqa: PLC0415 - matplotlib looks for its home when imported

    return _write_all(report_files(results, processes, sheets), directory, progress)


def write_ledger(
    claims: Sequence[JudgedClaim],
    comparison: Comparison | None,
    figures: Sequence[FigureEntry],
    studies: Mapping[str, StudyResults],
    directory: Path,
    *,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Write the page of the thesis's claims with the counterparts of its figures, and answer its path.

    Parameters
    ----------
    claims : the ledger
    comparison : of linear and adaptive control, or None
    figures : what is drawn; each needs its studies among those given
    studies : results by the name of their study
    directory, progress : as for ``write_report``

    Raises
    ------
    ResumableError
        when the system refuses a file; an older page then stands as it was.
    """
    settle_matplotlib_home()
    from magbear_cli.report.ledger_page import ledger_files  # noqa: PLC0415 - matplotlib looks for its home when imported

    return _write_all(ledger_files(claims, comparison, figures, studies), directory, progress)


def _write_all(files: Iterable[tuple[str, bytes]], directory: Path, progress: Callable[[str], None] | None) -> Path:
    """Write the files below the directory and take away what an earlier report left there."""
    written: set[Path] = set()
    with _told_as_sentence(directory):
        for name, content in files:
            path = directory / name
            path.parent.mkdir(parents=True, exist_ok=True)
            _write(path, content)
            written.add(path)
            if progress is not None and path.suffix == ".svg":
                progress(path.stem)
        _remove_stale(directory, written)
    return directory / PAGE


def _write(path: Path, content: bytes) -> None:
    """Put the bytes under the name, whole or not at all."""
    temporary = path.with_name(f".tmp-{path.name}")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


def _remove_stale(directory: Path, written: set[Path]) -> None:
    """Take away the figures that an earlier report left and this one does not have; no other file."""
    for part in FOLDERS:
        for path in (directory / part).glob("*"):
            if _OURS.fullmatch(path.name) and path not in written:
                path.unlink()


@contextlib.contextmanager
def _told_as_sentence(directory: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        where = error.filename or directory
        raise ResumableError(
            f"{os.fspath(where)}: the report could not be written: {error.strerror or error}; "
            "the results are kept, magbear report draws it again"
        ) from error
