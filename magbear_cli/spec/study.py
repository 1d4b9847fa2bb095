"""A study file, believed: its cases, its report and its limits; everything that is wrong with it is told at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from magbear_cli.spec.cases import LARGEST_COUNT, Plan, read_axes
from magbear_cli.spec.files import STDIN_NAME, read_text
from magbear_cli.spec.grammar import methods_in
from magbear_cli.spec.limits import set_aside
from magbear_cli.spec.models import FRAME_KEYS, Report, Run, StudyFile
from magbear_cli.spec.nodes import Mark, Node, PathError, assign, child_of, descendant, plain
from magbear_cli.spec.overrides import apply_override, parse_override
from magbear_cli.spec.parts import Shelf
from magbear_cli.spec.problems import Faults, printable
from magbear_cli.spec.reading import read_nodes
from magbear_cli.spec.sentences import note_errors
from magbear_cli.spec.writing import written


@dataclass(frozen=True)
class RunLimits:
    """What one case may take."""

    timeout_s: float
    memory_gib: float


@dataclass(frozen=True)
class Study:
    """A legal study.

    ``text`` is the study exactly as given, or, with overrides, written anew with them in place. ``folder`` is where
    relative paths in it are counted from.
    """

    name: str
    text: str
    source: str
    description: str | None
    report: Mapping[str, Any]
    run: RunLimits
    folder: Path | None
    _plan: Plan

    @property
    def case_count(self) -> int:
        """How many cases there are, without enumerating them."""
        return self._plan.count

    @property
    def sweep(self) -> dict[str, list[Any]]:
        """The swept dotted keys with their values, as written."""
        return {axis.key: [plain(value) for value in axis.values] for axis in self._plan.axes}

    def cases(self) -> Iterator[dict[str, Any]]:
        """The canonical inputs of each case, in the order of the product; the first swept key is the slowest.

        Raises
        ------
        StudyError
            When a case is reached that is not legal; possible only beyond the cases that reading looks at.
        """
        for index in range(self.case_count):
            yield self.case(index)

    def case(self, index: int) -> dict[str, Any]:
        """The canonical inputs of one case, counted from 0."""
        self._check(index)
        faults = Faults()
        inputs = replace(self._plan, shelf=self._plan.shelf.copy(faults)).case(index, faults)
        faults.stop()
        if inputs is None:
            raise RuntimeError(f"case {index} was refused without a reason")
        return inputs

    def swept(self, index: int) -> dict[str, Any]:
        """The values that the swept keys have in a case, as written."""
        self._check(index)
        pairs = zip(self._plan.axes, self._plan.positions(index), strict=True)
        return {axis.key: plain(axis.values[position]) for axis, position in pairs}

    def _check(self, index: int) -> None:
        """Refuse an index that is no case's."""
        if not 0 <= index < self.case_count:
            raise IndexError(f"there is no case {index}: the study has {self.case_count}, counted from 0")


def read_study(path: Path | str, overrides: Sequence[str] = (), *, for_limits: bool = False) -> Study:
    """The study in a file, or on standard input for ``-``, with ``KEY=VALUE`` overrides.

    ``for_limits`` reads it as the base of ``compile_limits``: see ``read_study_text``.

    Raises
    ------
    StudyError
        With everything that is wrong with the file, the study or the overrides.
    """
    faults = Faults()
    text = read_text(path, faults)
    faults.stop()
    is_stdin = str(path) == "-"
    folder = Path.cwd() if is_stdin else Path(path).parent
    return read_study_text(text or "", STDIN_NAME if is_stdin else str(path), overrides, folder, for_limits=for_limits)


def read_study_text(
    text: str,
    source: str,
    overrides: Sequence[str] = (),
    folder: Path | None = None,
    *,
    for_limits: bool = False,
) -> Study:
    """The study in a text; ``source`` names it in messages, ``folder`` is where its relative paths begin.

    ``for_limits`` puts the sections that a limit does not look at aside before anything is validated, so that nothing
    in them, and nothing between them and a limit, is a fault.

    Raises
    ------
    StudyError
        With everything that is wrong with the study or the overrides.
    """
    faults = Faults()
    shelf = Shelf(folder, faults)
    root = _read_root(text, source, faults)
    if root is not None and for_limits:
        root = set_aside(root)
    for item in overrides:
        override = parse_override(item, faults, [] if root is None else methods_in(root))
        if override is not None and root is not None:
            root = apply_override(root, override, shelf, faults)
    if root is None:
        faults.stop()
        raise RuntimeError("a study was refused without a reason")
    axes = read_axes(child_of(root, "sweep"), faults, methods_in(root))
    plan = Plan(_without(root, FRAME_KEYS), axes, shelf)
    if plan.count > LARGEST_COUNT:
        place = (child_of(root, "sweep") or root).place
        sentence = f"the sweeps make {plan.count} cases; a study may have {LARGEST_COUNT}"
        faults.add(place, "E116", sentence, "take fewer values, or make several studies")
        plan = replace(plan, axes=())
    frame = _validate_frame(root, plan, faults)
    plan.check(faults)
    faults.stop()
    if frame is None:
        raise RuntimeError("a study was refused without a reason")
    return Study(
        name=frame.name,
        text=_rewritten(root, overrides) if overrides else text,
        source=source,
        description=frame.description,
        report=(frame.report or Report.model_validate({})).model_dump(),
        run=RunLimits(**(frame.run or Run.model_validate({})).model_dump()),
        folder=folder,
        _plan=plan,
    )


def _read_root(text: str, source: str, faults: Faults) -> Node | None:
    """The top-level mapping; None when there is none, which is noted."""
    before = len(faults)
    root = read_nodes(text, source, faults)
    if root is not None and isinstance(root.value, dict):
        return root
    if len(faults) == before:
        if root is None or root.value is None:
            faults.add(
                Mark(source, 1, 1), "E101", "the study is empty", "begin it with 'magbear: 1', or see magbear new"
            )
        else:
            what = "a list" if isinstance(root.value, tuple) else "a single value"
            faults.add(root.mark, "E104", f"a study is a mapping of keys, not {what}", "begin it with 'magbear: 1'")
    return None


def _without(root: Node, keys: Sequence[str]) -> Node:
    """The mapping without some of its keys."""
    value = root.value if isinstance(root.value, dict) else {}
    return replace(root, value={key: child for key, child in value.items() if key not in keys})


def _validate_frame(root: Node, plan: Plan, faults: Faults) -> StudyFile | None:
    """The study as written, with the first value of every swept key it leaves out; None when it is not legal."""
    frame = _without(root, ["sweep"])
    for axis in sorted(plan.axes, key=lambda axis: len(axis.path)):
        if descendant(frame, axis.path) is None:
            try:
                frame = assign(frame, axis.path, axis.values[0], plan.shelf.open_at)
            except PathError:
                continue  # the cases will tell
    frame = plan.shelf.resolved(frame)
    try:
        return StudyFile.model_validate(plain(frame))
    except ValidationError as error:
        note_errors(error, frame, faults)
        return None


def _rewritten(root: Node, overrides: Sequence[str]) -> str:
    """The study's text with its overrides in place."""
    notes = "".join(f"# --set {printable(override)}\n" for override in overrides)
    return f"# Written anew by magbear with:\n{notes}{written(plain(root))}"
