"""``magbear status``: how far a run has come."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from magbear_cli.cli.options import RESULTS, as_json
from magbear_cli.errors import InputError

if TYPE_CHECKING:
    from magbear_cli.study.plan import Case

MOST_FAILURES = 12


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
    put(f"{document['study']}: {document['stored']} of {document['cases']} cases stored in {directory}")
    counts: dict[str, int] = document["counts"]
    put(", ".join(f"{count} {name}" for name, count in counts.items()) or "nothing is stored yet")
    put("a run holds the directory" if document["running"] else "no run holds the directory")
    failures: list[dict[str, Any]] = document["failures"]
    for failure in failures[:MOST_FAILURES]:
        put(f"{failure['id']} {failure['status']}: {failure['sentence']}")
    if len(failures) > MOST_FAILURES:
        put(f"and {len(failures) - MOST_FAILURES} more; --json names them all")
    if document["stored"] < document["cases"] and not document["running"]:
        put("run the same command again to compute the rest")


def _document(directory: Path) -> dict[str, Any]:
    from magbear_cli.cli.planning import planned_cases
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
