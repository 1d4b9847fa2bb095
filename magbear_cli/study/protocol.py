"""How the parent and a worker speak: frames of a magic word, a length and a pickle, over one socket.

The socket is the worker's own; what kernels print goes elsewhere and cannot be taken for an answer.
"""

from __future__ import annotations

import pickle
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from magbear_cli.study.outcome import CaseOutcome

MAGIC = b"MGBR"
HEADER = struct.Struct(">4sQ")
LARGEST_FRAME_BYTES = 1 << 31


class GarbledError(Exception):
    """What came over the socket is not a frame of ours."""


@dataclass(frozen=True)
class Request:
    """One case for a worker; the inputs travel as their canonical JSON, so every worker sees the same values."""

    case_id: str
    index: int
    inputs_json: str


@dataclass(frozen=True)
class Chore:
    """A call for a worker that has no case: the function at ``MODULE:NAME`` with these arguments."""

    number: int
    target: str
    arguments: tuple[object, ...]


@dataclass(frozen=True)
class ChoreDone:
    """What a chore returned; None where it raised something."""

    number: int
    result: object


@dataclass(frozen=True)
class Ready:
    """The worker has imported everything and has one BLAS thread."""


@dataclass(frozen=True)
class StartFailed:
    """The worker cannot work, and another one could not either."""

    sentence: str


@dataclass(frozen=True)
class Answer:
    """How a case ended in the worker: an outcome, or the sentence of what was raised.

    ``out_of_memory`` asks for another try on a fresh worker; ``retire`` says that this worker is not to be used again.
    """

    case_id: str
    outcome: CaseOutcome | None
    sentence: str = ""
    detail: str = ""  # the traceback, for the log
    out_of_memory: bool = False
    retire: bool = False


def pack_frame(message: object) -> bytes:
    """The bytes of one message."""
    payload = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
    return HEADER.pack(MAGIC, len(payload)) + payload


class FrameReader:
    """Bytes as they arrive, cut into messages."""

    def __init__(self) -> None:
        """Start with nothing received."""
        self._buffer = bytearray()

    def messages(self, received: bytes) -> list[object]:
        """The messages completed by these bytes, oldest first.

        Raises
        ------
        GarbledError
            when the bytes are no frame, or a frame does not hold a message.
        """
        self._buffer += received
        complete: list[object] = []
        while len(self._buffer) >= HEADER.size:
            magic, size = HEADER.unpack_from(self._buffer)
            if magic != MAGIC or size > LARGEST_FRAME_BYTES:
                raise GarbledError("what the worker sent is not an answer")
            end = HEADER.size + size
            if len(self._buffer) < end:
                break
            complete.append(_unpickle(bytes(self._buffer[HEADER.size : end])))
            del self._buffer[:end]
        return complete


def _unpickle(payload: bytes) -> object:
    try:
        message: object = pickle.loads(payload)  # noqa: S301 - written by a process of our own
    except Exception as error:
        raise GarbledError(f"the worker's answer cannot be read: {error}") from error
    return message
