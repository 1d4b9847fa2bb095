"""A worker process: computes one case at a time for the parent that started it, and dies with it.

Started as ``python -m magbear_cli.study.worker SOCKET PARENT MEMORY TARGET WARM``. Kernels may hang with the
interpreter lock held, crash, print or eat memory here; only the parent can and does stop them.
"""

from __future__ import annotations

import ctypes
import faulthandler
import importlib
import json
import os
import random
import resource
import signal
import socket
import subprocess
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from magbear_cli.errors import MagbearError
from magbear_cli.study import guardian
from magbear_cli.study.protocol import (
    Answer,
    Chore,
    ChoreDone,
    FrameReader,
    Ready,
    Request,
    StartFailed,
    pack_frame,
)

Target = Callable[[dict[str, Any], str, int], Any]

PR_SET_PDEATHSIG = 1  # linux/prctl.h
ADDRESS_SPACE_ALLOWANCE_BYTES = 4 << 30  # libraries and their untouched buffers, on top of the memory limit


def main(arguments: list[str]) -> None:
    """Serve the parent until its end of the socket closes."""
    descriptor, parent, memory_bytes, target, warm = arguments
    _bind_life_to(int(parent), int(descriptor))
    connection = socket.socket(fileno=int(descriptor))
    connection.set_inheritable(False)
    _limit_resources(int(memory_bytes))
    try:
        function = _load(target, warm.split(",") if warm else [])
    except BaseException as error:  # noqa: BLE001 - a compiled module may panic while it loads
        connection.sendall(pack_frame(StartFailed(_sentence_of(error))))
        return
    connection.sendall(pack_frame(Ready()))
    _serve(connection, function)


def _bind_life_to(parent: int, descriptor: int) -> None:
    """Ignore Ctrl-C, which reaches the whole group, and die when the parent dies."""
    if sys.platform != "linux":
        script = [sys.executable, "-I", "-S", guardian.__file__, str(descriptor), str(os.getpid())]
        subprocess.Popen(script, pass_fds=(descriptor,))  # noqa: S603 - a script of our own
    die_with_parent(parent)


def die_with_parent(parent: int) -> None:
    """Ignore Ctrl-C, which the parent answers for all, and die when the parent dies, where the kernel sees to that."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # it died before the line above
        os._exit(1)


def _limit_resources(memory_bytes: int) -> None:
    """No core files; the address space as a backstop behind the limit that the parent watches."""
    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if memory_bytes and sys.platform == "linux":
        soft = memory_bytes + ADDRESS_SPACE_ALLOWANCE_BYTES
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        if hard == resource.RLIM_INFINITY or soft < hard:
            resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _load(target: str, warm: list[str]) -> Target:
    """Import what the cases need, once, and make sure that no numerical library brought threads along."""
    function: Target = _named(target)
    for name in warm:
        try:
            importlib.import_module(name)
        except ImportError:  # the kernel that needs it says so in the case's own sentence
            continue
    from threadpoolctl import threadpool_info  # noqa: PLC0415 - after the libraries it looks for

    for pool in threadpool_info():
        if pool["num_threads"] != 1:
            raise MagbearError(f"{pool['filepath']} runs {pool['num_threads']} threads; a worker must have one")
    return function


def _named(target: str) -> Callable[..., Any]:
    """The function at ``MODULE:NAME``."""
    module_name, _, function_name = target.partition(":")
    function: Callable[..., Any] = getattr(importlib.import_module(module_name), function_name)
    return function


def _serve(connection: socket.socket, function: Target) -> None:
    reader = FrameReader()
    while received := connection.recv(1 << 16):
        for request in reader.messages(received):
            if isinstance(request, Chore):
                connection.sendall(_chore_done(request))
                continue
            if not isinstance(request, Request):
                return
            answer = _answer(request, function)
            connection.sendall(_packed(answer))
            if answer.retire:
                return


def _answer(request: Request, function: Target) -> Answer:
    """The outcome of one case, or the sentence of whatever was raised in place of it."""
    _seed_generators(request.case_id)
    try:
        outcome = function(json.loads(request.inputs_json), request.case_id, request.index)
    except MemoryError:
        return Answer(
            request.case_id, None, "ran out of memory", traceback.format_exc(), out_of_memory=True, retire=True
        )
    except BaseException as error:  # noqa: BLE001 - compiled solvers raise PanicException, a BaseException
        unusable = not isinstance(error, Exception)
        return Answer(request.case_id, None, _sentence_of(error), traceback.format_exc(), retire=unusable)
    return Answer(request.case_id, outcome)


def _chore_done(chore: Chore) -> bytes:
    """What came of a chore; nothing, where it raises or its result cannot leave the process."""
    try:
        return pack_frame(ChoreDone(chore.number, _named(chore.target)(*chore.arguments)))
    except Exception:  # noqa: BLE001 - who asked does it in another way, and meets the same error where it can be told
        return pack_frame(ChoreDone(chore.number, None))


def _seed_generators(case_id: str) -> None:
    """Global generators, should a library draw from one, start from the case and not from the worker's history."""
    seed = int(case_id[:8], 16)
    random.seed(seed)
    if "numpy" in sys.modules:
        sys.modules["numpy"].random.seed(seed)


def _packed(answer: Answer) -> bytes:
    try:
        return pack_frame(answer)
    except Exception as error:  # noqa: BLE001 - pickle raises whatever the object raises
        return pack_frame(Answer(answer.case_id, None, f"the outcome cannot leave its process: {error}"))


def _sentence_of(error: BaseException) -> str:
    """One line: the sentence of an error of ours, or what was raised and where."""
    words = " ".join(str(error).split())
    if isinstance(error, MagbearError) and words:
        return words
    frames = traceback.extract_tb(error.__traceback__)
    place = f" at {Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else ""
    name = type(error).__name__
    return f"{name}{place}: {words}" if words else f"{name}{place}"


if __name__ == "__main__":
    main(sys.argv[1:])
