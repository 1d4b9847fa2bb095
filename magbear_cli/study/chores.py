"""Work without haste for the workers of a run: idle ones do it while others compute, and all of them after.

A chore has no part in what a case's outcome is, and no chore keeps a case waiting. It is tried once: where it fails,
whoever asked for it does the work in another way.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Hashable
from types import TracebackType
from typing import TYPE_CHECKING, Self

from magbear_cli.errors import ResumableError
from magbear_cli.study.protocol import Chore

if TYPE_CHECKING:
    from magbear_cli.study.runner import Shift

GLANCE_EVERY_S = 0.02


class Chores:
    """What is to be done and what came of it; a context manager, at whose end the workers go.

    A run that is given one lends it its workers: they stay when the last case has ended.
    """

    def __init__(self) -> None:
        """Nothing is to be done, and nobody is there to do it."""
        self._waiting: deque[Chore] = deque()
        self._keys: dict[int, Hashable] = {}
        self._results: dict[Hashable, object] = {}
        self._asked = 0
        self._shift: Shift | None = None
        self._glanced_s = 0.0

    def __enter__(self) -> Self:
        """Give the chores."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Send the workers away."""
        if self._shift is not None:
            self._shift.close()
            self._shift = None

    def __len__(self) -> int:
        """How many nobody has begun."""
        return len(self._waiting)

    @property
    def has_workers(self) -> bool:
        """Whether a run has lent its workers."""
        return self._shift is not None

    def lend(self, shift: Shift) -> None:
        """Take over the workers of a run."""
        self._shift, shift.chores = shift, self

    def ask(self, key: Hashable, target: str, *arguments: object) -> None:
        """Have the function at ``MODULE:NAME`` called in a worker; ``result`` gives under the key what it returned."""
        self._asked += 1
        self._keys[self._asked] = key
        self._waiting.append(Chore(self._asked, target, arguments))

    def take(self) -> Chore | None:
        """The next one for an idle worker."""
        return self._waiting.popleft() if self._waiting else None

    def end(self, number: int, result: object) -> None:
        """Note what came of one: None where nothing did."""
        self._results[self._keys.pop(number)] = result

    def glance(self) -> None:
        """Hand out and take in what can be at once; quick enough to be called again and again within other work."""
        if self._shift is not None and time.monotonic() - self._glanced_s > GLANCE_EVERY_S:
            self._attend(0.0)
            self._glanced_s = time.monotonic()

    def result(self, key: Hashable) -> object:
        """What came of the chore that was asked for under the key, once: waits for it; None where nothing did."""
        while key in self._keys.values():
            self._attend(None)
        return self._results.pop(key, None)

    def forget(self) -> None:
        """Drop what nobody has begun, and all results."""
        for chore in self._waiting:
            self._keys.pop(chore.number)
        self._waiting.clear()
        self._results.clear()

    def _attend(self, patience_s: float | None) -> None:
        try:
            if self._shift is not None:
                self._shift.do_chores(patience_s)
                return
        except ResumableError:  # the cases are stored; what is left can be done without workers
            pass
        self._waiting.clear()
        self._results.update(dict.fromkeys(self._keys.values()))
        self._keys.clear()
