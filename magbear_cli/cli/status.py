"""``magbear status``: how far a run has come."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from magbear_cli.cli.options import RESULTS, as_json
from magbear_cli.errors import InputError

if TYPE_CHECKING:
    from magbear_cli.study.plan import Case

LINES, COLUMNS = 24, 80  # of the smallest terminal


@click.command()
@click.argument("directory", type=RESULTS)
@as_json
def status(directory: Path, *, as_json: bool) -> None:
    """Tell what of a run in DIRECTORY is done, what failed and why.

    It may still be running. Nothing is computed, written or locked.

    \b
    Example:  magbear status out/quickstart
    """
    from magbear_cli.cli.output import put, put_json

    document = _document(directory)
    if as_json:
        put_json(document)
        return
    put("\n".join(_told(document)))


def _told(document: dict[str, Any]) -> list[str]:
    """What there is to tell, in no more lines and columns than the smallest terminal has."""
    counts: dict[str, int] = document["counts"]
    first = [
        f"{document['study']}: {document['stored']} of {document['cases']} cases stored in {document['directory']}",
        ", ".join(f"{count} {name}" for name, count in counts.items()) or "nothing is stored yet",
        "a run holds the directory" if document["running"] else "no run holds the directory",
    ]
    if document["damaged"]:
        first.append(f"{document['damaged']} stored and damaged, will be computed again")
    last = []
    if document["answered"] < document["cases"] and not document["running"]:
        last = ["run the same command again to compute the rest"]
    first = [line for text in first for line in _folded(text)]
    causes = _causes(document["failures"])
    told: list[str] = []
    for number, cause in enumerate(causes):
        lines, left = _folded(cause), len(causes) - number
        if len(first) + len(told) + len(lines) + len(last) + (left > 1) > LINES:
            told.append(f"and {left} other reason{'' if left == 1 else 's'}; --json names every case")
            break
        told += lines
    return [*first, *told, *last]


def _causes(failures: list[dict[str, str]]) -> list[str]:
    """Why cases have no answer, the most frequent reason first, each with a case to look at."""
    groups: dict[tuple[str, str], list[str]] = {}
    for failure in failures:
        cause = failure["sentence"].replace(failure["id"], "ID").removesuffix("; --case ID repeats it alone")
        groups.setdefault((failure["status"], cause), []).append(failure["id"])
    ordered = sorted(groups.items(), key=lambda group: (-len(group[1]), group[0]))
    return [f"{len(ids)} {status}: {cause} (--case {ids[0][:7]})" for (status, cause), ids in ordered]


def _folded(text: str) -> list[str]:
    import textwrap

    return textwrap.wrap(text, COLUMNS, subsequent_indent="    ", max_lines=4, placeholder=" …")


def _document(directory: Path) -> dict[str, Any]:
    from magbear_cli.library.planning import planned_cases
    from magbear_cli.spec import read_study_text
    from magbear_cli.store.lock import LOCK_NAME, is_locked

    path = directory / "study.yaml"
    try:
        text = path.read_bytes().decode("utf-8", "surrogateescape")
    except OSError as error:
        raise InputError(f"{directory}: this is not the directory of a run: {error.strerror}") from error
    study = read_study_text(text, str(path), (), directory)
    cases = planned_cases(study)
    counts, failures, damaged = _looked_at(directory, cases)
    return {
        "study": study.name,
        "directory": str(directory),
        "cases": len(cases),
        "stored": sum(counts.values()),
        "answered": sum(counts.values()) - len(failures),
        "counts": counts,
        "damaged": damaged,
        "running": is_locked(directory / LOCK_NAME),
        "failures": failures,
    }


def _looked_at(directory: Path, cases: tuple[Case, ...]) -> tuple[dict[str, int], list[dict[str, str]], int]:
    """How many cases ended how, those without an answer with their sentences, and how many shards are damaged."""
    from collections import Counter

    from magbear_cli.store.shards import DamagedShardError, read_head, read_shard, take_inventory

    inventory = take_inventory(directory / "cases")
    counts: Counter[str] = Counter()
    failures, damaged = [], 0
    for case in cases:
        for path in inventory.paths.get(case.id, ()):
            try:
                head = read_head(path)
                if not head.status.is_answer:
                    sentence = read_shard(path, case).sentence
                    failures.append({"id": case.id, "status": head.status.value, "sentence": sentence})
            except DamagedShardError:
                damaged += 1
                continue
            counts[head.status.value] += 1
            break
    return dict(sorted(counts.items())), failures, damaged
