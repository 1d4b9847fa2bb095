"""Cases and whole studies as trees, and back: which branches there are and what each of them holds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from magbear_cli.errors import Status
from magbear_cli.model.table import Table
from magbear_cli.store.layout import (
    CASE_FIELDS,
    CONTROLLER,
    FREQUENCY,
    IMPOSSIBILITY,
    LAYOUT_VERSION,
    ORIGIN,
    POLES,
    STATISTIC,
    STEP,
    STUDY_FIELDS,
    SUMMARY,
    TABLE_FIELDS,
    Group,
)
from magbear_cli.store.tables import grow_table, harvest_table
from magbear_cli.store.tree import Branch, content_digest, grow_fields, grow_group, harvest_fields, lifted
from magbear_cli.study.outcome import CaseOutcome, StudyResults, Summary

PARTS = (CONTROLLER, FREQUENCY, POLES, IMPOSSIBILITY)
RESULTS_FORMAT = "magbear results"
DIGEST = "content_sha256"


def grow_case(outcome: CaseOutcome) -> Branch:
    """The branch of one case; parts that the case did not get to are left out. Its place in the study is not in it."""
    known = {entry.name: getattr(outcome, entry.name) for entry in CASE_FIELDS}
    children = {**grow_fields(CASE_FIELDS, known).children, SUMMARY.name: grow_group(SUMMARY, outcome.summary)}
    for group in PARTS:
        part = getattr(outcome, group.name)
        if part is not None:
            children[group.name] = grow_group(group, part)
    if outcome.steps:
        steps = {f"step_{number:02d}": grow_group(STEP, step) for number, step in enumerate(outcome.steps, 1)}
        children["steps"] = Branch(steps, {"NX_class": "NXcollection", "default": "step_01"})
    if outcome.statistics:
        names = sorted(outcome.statistics)
        named = {"name": names, "value": [outcome.statistics[name] for name in names]}
        children["statistics"] = grow_fields(STATISTIC, named)
    if outcome.tables:
        tables = {name: grow_table(outcome.tables[name]) for name in sorted(outcome.tables)}
        children["tables"] = Branch(tables, {"NX_class": "NXcollection"})
    attributes = {"NX_class": "NXentry"}
    if outcome.frequency is not None:
        attributes["default"] = FREQUENCY.name
    return Branch(children, attributes)


def harvest_case(branch: Branch, index: int) -> CaseOutcome:
    """The case of a branch, at this place in the study: the inverse of ``grow_case``.

    Raises
    ------
    KeyError, TypeError, ValueError
        when the branch does not hold a case.
    """
    known = harvest_fields(CASE_FIELDS, branch)
    summary = branch.branch(SUMMARY.name)
    parts = {group.name: _harvest(group, branch.branch(group.name)) for group in PARTS if group.name in branch.children}
    steps = branch.branch("steps") if "steps" in branch.children else Branch({})
    return CaseOutcome(
        case_id=known["case_id"],
        index=index,
        inputs=known["inputs"],
        status=Status(known["status"]),
        sentence=known["sentence"],
        summary=Summary(**harvest_fields(SUMMARY.fields, summary)),
        steps=tuple(_harvest(STEP, steps.branch(name)) for name in counted(steps.children)),
        statistics=_harvest_statistics(branch),
        tables=_harvest_tables(branch),
        **parts,
    )


def grow_provenance(about: StudyResults) -> Branch:
    """The branch of a study's origin: its text, its report's wishes, and what computed it; no outcomes."""
    names = sorted(about.provenance)
    told = {"key": names, "text": [about.provenance[name] for name in names]}
    study = {entry.name: getattr(about, entry.name) for entry in STUDY_FIELDS}
    children = {**grow_fields(STUDY_FIELDS, study).children, "toolchain": grow_fields(ORIGIN, told)}
    return Branch(children, {"NX_class": "NXcollection"})


def harvest_provenance(branch: Branch) -> StudyResults:
    """The study of a branch without its outcomes: the inverse of ``grow_provenance``.

    Raises
    ------
    KeyError, TypeError, ValueError
        when the branch does not hold one.
    """
    told = harvest_fields(ORIGIN, branch.branch("toolchain"))
    provenance = dict(zip(told["key"], told["text"], strict=True))
    return StudyResults(**harvest_fields(STUDY_FIELDS, branch), outcomes=(), provenance=provenance)


def root_attributes(first: str) -> dict[str, str | int]:
    """What a results file says of itself; ``first`` is the group that a viewer shows."""
    told: dict[str, str | int] = {"format": RESULTS_FORMAT, "layout_version": LAYOUT_VERSION}
    return {**told, "NX_class": "NXroot", "default": first}


def sealed(branch: Branch) -> Branch:
    """The branch with the digest of its content among its attributes."""
    return Branch(branch.children, {**branch.attributes, DIGEST: content_digest(branch)})


def is_intact(branch: Branch) -> bool:
    """Whether the content is what was sealed."""
    return branch.attributes.get(DIGEST) == content_digest(branch)


def grow_overview(columns: Mapping[str, Sequence[object]]) -> Branch:
    """The table of the cases: one row a case (``overview_row``), one column a figure."""
    table = lifted(TABLE_FIELDS, columns, "case")
    return Branch(table.children, {"NX_class": "NXdata", "signal": "worst_case", "axes": "case"})


def counted(names: Iterable[str]) -> list[str]:
    """The names, those that end in a number in the order of their numbers."""
    return sorted(names, key=lambda name: (len(name), name))


def case_name(index: int) -> str:
    """The name of a case's group, counted from 1."""
    return f"case_{index + 1:04d}"


def case_index(name: str) -> int:
    """The place of a case in its study, from 0, by the name of its group."""
    return int(name.removeprefix("case_")) - 1


def overview_row(outcome: CaseOutcome) -> dict[str, object]:
    """A case's row of the table."""
    mass = outcome.mass_kg
    low, high = (mass[0], mass[-1]) if isinstance(mass, Sequence) else (mass, mass)
    return {
        "case_id": outcome.case_id,
        "group": case_name(outcome.index),
        "status": outcome.status.value,
        "sentence": outcome.sentence,
        "method": outcome.method,
        "mass_low_kg": low,
        "mass_high_kg": high,
        "omega_c_rad_s": outcome.omega_c_rad_s,
        **{entry.name: getattr(outcome.summary, entry.name) for entry in SUMMARY.fields},
        "steps": len(outcome.steps),
    }


def _harvest(group: Group, branch: Branch) -> Any:  # noqa: ANN401 - an object of the type the group holds
    return group.holds(**harvest_fields(group.fields, branch))


def _harvest_statistics(branch: Branch) -> Mapping[str, float]:
    if "statistics" not in branch.children:
        return {}
    named = harvest_fields(STATISTIC, branch.branch("statistics"))
    return dict(zip(named["name"], named["value"].tolist(), strict=True))


def _harvest_tables(branch: Branch) -> Mapping[str, Table]:
    if "tables" not in branch.children:
        return {}
    tables = branch.branch("tables")
    return {name: harvest_table(tables.branch(name)) for name in tables.children}
