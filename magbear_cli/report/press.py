"""Draw the figures of a report in several processes: each takes every n-th of them, and the bytes are those of one.

Drawing takes half a second a figure, nearly all of it in turning a figure into files. Started as ``python -m
magbear_cli.report.press PART PARTS PARENT`` with the study on standard input.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import subprocess
import sys
from collections.abc import Iterator
from itertools import cycle
from typing import IO

from magbear_cli.errors import ResumableError
from magbear_cli.report.gallery import PER_CASE, wanted_figures
from magbear_cli.report.printing import Print, prints
from magbear_cli.report.selection import drawn
from magbear_cli.study.outcome import StudyResults
from magbear_cli.study.protocol import FrameReader, pack_frame
from magbear_cli.study.supervision import fresh_interpreter, quiet_environment
from magbear_cli.study.worker import die_with_parent

LEAST_FIGURES = 8  # for fewer a further process, which takes a second to start, does not pay
RECEIVE_BYTES = 1 << 20


def printed_by_several(results: StudyResults, processes: int) -> Iterator[Print]:
    """The figures of a study in their order, drawn by so many processes where there are enough of them.

    Raises
    ------
    ResumableError
        when a process is lost.
    """
    kinds = sum(kind in PER_CASE for kind in wanted_figures(results))
    if processes < 2 or kinds * len(drawn(results.outcomes)) < LEAST_FIGURES:
        yield from prints(results)
        return
    study = pickle.dumps(results, protocol=pickle.HIGHEST_PROTOCOL)
    with contextlib.ExitStack() as stack:
        presses = [stack.enter_context(_started(part, processes, study)) for part in range(processes)]
        for press in cycle(presses):
            sheet = next(press, None)
            if sheet is None:  # the figures are dealt in turn, so the first to run out has been dealt the last round
                return
            yield sheet


@contextlib.contextmanager
def _started(part: int, parts: int, study: bytes) -> Iterator[Iterator[Print]]:
    """A process that draws its part, as what comes from it; it does not outlive the context."""
    line = [*fresh_interpreter(), "-m", "magbear_cli.report.press", str(part), str(parts), str(os.getpid())]
    with subprocess.Popen(  # noqa: S603 - this interpreter, arguments of our own
        line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=quiet_environment()
    ) as process:
        try:
            if process.stdin is None or process.stdout is None:
                raise ResumableError("a process that draws figures has no streams")
            with contextlib.suppress(OSError), process.stdin as stdin:  # it died: what comes from it tells
                stdin.write(study)
            yield _received(process.stdout)
        finally:
            process.kill()


def _received(stream: IO[bytes]) -> Iterator[Print]:
    reader = FrameReader()
    while received := os.read(stream.fileno(), RECEIVE_BYTES):
        for message in reader.messages(received):
            if message is None:
                return
            if not isinstance(message, Print):
                raise ResumableError("what came from a process that draws figures is none")
            yield message
    raise ResumableError(
        "a process that draws figures was lost; the results are kept, magbear report draws the figures again"
    )


def main(part: int, parts: int, parent: int) -> None:
    """Draw a part of the figures of the study on standard input, and put them on standard output."""
    die_with_parent(parent)
    results: StudyResults = pickle.load(sys.stdin.buffer)  # noqa: S301 - written by the process that started this one
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever else is printed does not go between the figures
    for sheet in prints(results, part, parts):
        _send(out, sheet)
    _send(out, None)


def _send(out: IO[bytes], message: object) -> None:
    rest = memoryview(pack_frame(message))
    while rest:
        rest = rest[out.write(rest) :]


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
