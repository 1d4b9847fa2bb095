"""Let one call of the system go wrong: the first, the second, the third of a run, each in every way, until all did.

The calls are those on the run directory by the process that holds it. After each fault the command must have ended as
the README says (killed, or 4, or 0 with everything in place), and running it again must end in the bytes of a calm run.

    python tests/campaigns/faults.py             every index and every fault
    python tests/campaigns/faults.py --rotate    every index, one fault after the other
"""

from __future__ import annotations

import argparse
import collections
import errno
import functools
import io
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from quick_run import compute_here, ended, fingerprint, preload, start, study_text, use_quick_cases

ERRORS = {name: getattr(errno, name) for name in ("ENOSPC", "EIO", "EROFS", "EMFILE")}
FAULTS = ("kill before", "kill after", "torn write", *ERRORS)
WRITES = {"write", "pwrite"}
BY_PATH = ("open", "replace", "unlink", "mkdir", "scandir")
BY_DESCRIPTOR = ("write", "pwrite", "pread", "fsync", "ftruncate", "close")


class Shim:
    """Counts the calls on a folder; at one of them (None: at none) something goes wrong."""

    def __init__(self, folder: Path, place: int | None, fault: str, journal: Path) -> None:
        """Nothing is replaced yet."""
        self.folder, self.place, self.fault, self.journal = str(folder), place, fault, journal
        self.count = 0
        self.descriptors: set[int] = set()
        self.is_ours = False

    def install(self) -> None:
        """Stand before the functions of ``os``, and ``open``, in this process."""
        for name in BY_PATH:
            setattr(os, name, self._guarded(name, getattr(os, name), self._has_path))
        for name in BY_DESCRIPTOR:
            setattr(os, name, self._guarded(name, getattr(os, name), self._has_descriptor))
        real = io.open

        @functools.wraps(real)
        def opened(file: Any, *arguments: Any, **named: Any) -> Any:  # noqa: ANN401 - as open is
            if not self._has_path(file):
                return real(file, *arguments, **named)
            return _File(self._call("open", real, file, *arguments, **named), self)

        io.open = opened

    def _guarded(self, name: str, real: Callable[..., Any], concerns: Callable[[object], bool]) -> Callable[..., Any]:
        @functools.wraps(real)
        def guarded(first: Any = ".", *arguments: Any, **named: Any) -> Any:  # noqa: ANN401 - as the function is
            if not concerns(first):
                return real(first, *arguments, **named)
            result = self._call(name, real, first, *arguments, **named)
            if name == "open":
                self.descriptors.add(result)
            elif name == "close":
                self.descriptors.discard(first)
            return result

        return guarded

    def _has_path(self, path: object) -> bool:
        return isinstance(path, str | os.PathLike) and os.fspath(path).startswith(self.folder)

    def _has_descriptor(self, descriptor: object) -> bool:
        return descriptor in self.descriptors

    def _call(self, name: str, real: Callable[..., Any], *arguments: Any, **named: Any) -> Any:  # noqa: ANN401
        self.count += 1
        if self.place is None:
            with self.journal.open("a") as file:
                file.write(f"{name}\n")
            return real(*arguments, **named)
        if self.count != self.place:
            return real(*arguments, **named)
        if self.fault in ERRORS:
            if name == "close":
                real(*arguments)
            where = [str(argument) for argument in arguments[:1] if isinstance(argument, str | os.PathLike)]
            raise OSError(ERRORS[self.fault], os.strerror(ERRORS[self.fault]), *where)
        if self.fault == "torn write":
            content = memoryview(arguments[-2 if name == "pwrite" else -1])
            half = content[: len(content) // 2]
            real(arguments[0], half, *arguments[2:]) if name == "pwrite" else real(*arguments[:-1], half)
        if self.fault == "kill after":
            real(*arguments, **named)
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError


class _File:
    """A file object whose reads and writes are calls too."""

    def __init__(self, file: Any, shim: Shim) -> None:  # noqa: ANN401 - any file object
        self._file, self._shim = file, shim

    def read(self, *arguments: Any) -> Any:  # noqa: ANN401 - as the file's
        return self._shim._call("read", self._file.read, *arguments)

    def write(self, content: Any) -> Any:  # noqa: ANN401 - as the file's
        def write(content: Any) -> Any:  # noqa: ANN401 - the same
            done = self._file.write(content)
            self._file.flush()
            return done

        return self._shim._call("write", write, content)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever it is
        return getattr(self._file, name)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *end: object) -> None:
        self._file.close()


class Campaign:
    """Runs with one fault each, and what came of them."""

    def __init__(self, folder: Path, cases: int) -> None:
        """Learn which calls a calm run makes, and what it leaves."""
        self.folder, self.study = folder, folder / "study.yaml"
        self.study.write_text(study_text(cases), "utf-8")
        self.bad: list[str] = []
        self.codes: collections.Counter[int | None] = collections.Counter()
        code = self.run("calm", None, "")
        if code != 0:
            raise SystemExit((folder / "said").read_text("utf-8"))
        self.calls = (folder / "journal").read_text("utf-8").split()
        self.calm = fingerprint(folder / "calm")

    def run(self, name: str, place: int | None, fault: str) -> int | None:
        """Run the command on a directory, with a fault at one place if there is one; its exit code."""
        target = self.folder / name

        def prepare() -> None:
            from magbear_cli.study import runner

            runner.run_cases = compute_here  # type: ignore[assignment]
            if place is not None or not fault:
                Shim(target, place, fault, self.folder / "journal").install()

        line = ["run", str(self.study), "-o", str(target), "-j", "1", "--no-progress"]
        return ended(start(line, self.folder / "said", prepare))

    def disturb(self, place: int, fault: str) -> None:
        """One fault, and the run after it."""
        (self.folder / "said").unlink()
        code = self.run("run", place, fault)
        self.codes[code] += 1
        what = f"{fault} at call {place} ({self.calls[place - 1]})"
        said = (self.folder / "said").read_text("utf-8")
        if fault in ERRORS:
            if code not in {0, 4} or "Traceback" in said or (code == 4 and "error: " not in said):
                self.bad.append(f"{what}: exit code {code}: {said[-300:]}")
            if code == 0 and fingerprint(self.folder / "run") != self.calm:
                self.bad.append(f"{what}: exit code 0, and other bytes")
        elif code != -signal.SIGKILL:
            self.bad.append(f"{what}: exit code {code}")
        again = self.run("run", None, "none")
        if again != 0:
            self.bad.append(f"{what}: running again gave {again}: {(self.folder / 'said').read_text('utf-8')[-300:]}")
        elif fingerprint(self.folder / "run") != self.calm:
            self.bad.append(f"{what}: running again gave other bytes")
        shutil.rmtree(self.folder / "run")


def main() -> int:
    """Run the campaign and tell what came of it; 1 if anything was not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=6)
    parser.add_argument("--rotate", action="store_true", help="one fault an index, not all")
    parser.add_argument("--from", dest="first", type=int, default=1, help="the first index")
    parser.add_argument("--stop", type=int, default=1 << 30, help="the index to stop before")
    asked = parser.parse_args()
    os.environ["QUICK_SECONDS"] = "0"
    use_quick_cases()
    preload()
    folder = Path(tempfile.mkdtemp(prefix="magbear-faults-"))
    campaign = Campaign(folder, asked.cases)
    injected: collections.Counter[str] = collections.Counter()
    for place in range(asked.first, min(asked.stop, len(campaign.calls) + 1)):
        possible = [fault for fault in FAULTS if fault != "torn write" or campaign.calls[place - 1] in WRITES]
        for fault in [possible[place % len(possible)]] if asked.rotate else possible:
            campaign.disturb(place, fault)
            injected[fault] += 1
    calls = ", ".join(f"{count} {name}" for name, count in collections.Counter(campaign.calls).most_common())
    print(f"calls of a run of {asked.cases} cases: {len(campaign.calls)} ({calls})")
    print(f"faults: {injected.total()} ({', '.join(f'{injected[fault]} {fault}' for fault in FAULTS)})")
    print(f"exit codes: {', '.join(f'{count} times {code}' for code, count in campaign.codes.most_common())}")
    print(f"not as it should be: {len(campaign.bad)}")
    for sentence in campaign.bad[:20]:
        print(f"  {sentence}")
    shutil.rmtree(folder)
    return int(bool(campaign.bad))


if __name__ == "__main__":
    sys.exit(main())
