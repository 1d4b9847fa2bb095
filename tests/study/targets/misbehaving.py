"""A target for the runner whose cases do what a kernel at its worst may do."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_info

from magbear_cli.errors import InputError, NumericsError, Status
from magbear_cli.study.outcome import CaseOutcome, Summary

PanicException = type("PanicException", (BaseException,), {})


def act(inputs: dict[str, Any], case_id: str, index: int) -> object:
    """Do what ``inputs["act"]`` says; the part after a colon is its argument."""
    name, _, argument = inputs["act"].partition(":")
    result = ACTS[name](argument)
    if result is not None:
        return result
    drawn = float(np.random.random())  # noqa: NPY002 - a library that draws from the global generator
    summary = Summary(level=float(inputs["number"]), worst_case=drawn)
    return CaseOutcome(case_id, index, inputs, Status.OK, summary=summary)


def _answer(_: str) -> None:
    """Be good."""


def _sleep(argument: str) -> None:
    time.sleep(float(argument))


def _hang(_: str) -> None:
    """Hang in native code with the interpreter lock held."""
    ctypes.PyDLL(None).pause()
    time.sleep(3600)


def _signal(argument: str) -> None:
    os.kill(os.getpid(), getattr(signal, argument))


def _segfault(_: str) -> None:
    ctypes.string_at(0)


def _once(argument: str) -> None:
    """Crash, but only the first time."""
    mark = Path(argument)
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)


def _exit(argument: str) -> None:
    os._exit(int(argument))


def _leave(_: str) -> None:
    sys.exit("enough")


def _raise(argument: str) -> None:
    errors = {
        "ours": NumericsError("two numbers disagree"),
        "input": InputError("no such thing"),
        "other": KeyError("k"),
    }
    raise errors[argument]


def _panic(_: str) -> None:
    raise PanicException("called `Option::unwrap()` on a `None` value")


def _garbage(_: str) -> None:
    """Write onto everything that can be written to, the socket included."""
    for descriptor in range(3, 64):
        try:
            os.write(descriptor, b"** On entry to DGESDD parameter number 4 had an illegal value\n")
        except OSError:
            continue


def _print(argument: str) -> None:
    """Print a lot, as compiled code does, on both streams."""
    for descriptor in (1, 2):
        for _ in range(int(argument)):
            os.write(descriptor, b"** On entry to SB10AD parameter number 7 had an illegal value\n" * 16)


def _allocate(argument: str) -> None:
    """Take memory and touch it."""
    kept = [np.ones(8 << 20) for _ in range(int(argument))]  # 64 MiB each
    time.sleep(60.0 if kept else 0.0)


def _reserve(argument: str) -> None:
    """Ask for GiB of memory and touch none of it."""
    np.empty(int(argument) << 27)


def _memory_error(_: str) -> None:
    raise MemoryError


def _threads(_: str) -> None:
    """Fail with the number of threads, if it is not one."""
    for pool in threadpool_info():
        if pool["num_threads"] != 1:
            raise NumericsError(f"{pool['num_threads']} threads")


def _number(_: str) -> int:
    return 7


def _lambda(_: str) -> Callable[[], None]:
    return lambda: None


ACTS: dict[str, Callable[[str], object]] = {
    "answer": _answer,
    "sleep": _sleep,
    "hang": _hang,
    "signal": _signal,
    "segfault": _segfault,
    "once": _once,
    "exit": _exit,
    "leave": _leave,
    "raise": _raise,
    "panic": _panic,
    "garbage": _garbage,
    "print": _print,
    "allocate": _allocate,
    "reserve": _reserve,
    "memory_error": _memory_error,
    "threads": _threads,
    "number": _number,
    "lambda": _lambda,
}


def chore(name: str, argument: str) -> object:
    """Do an act that has no case, and answer with what was asked."""
    result = ACTS[name](argument)
    return (name, argument, os.getpid()) if result is None else result
