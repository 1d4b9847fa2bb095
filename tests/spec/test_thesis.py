"""The thesis's data are read as strictly as a study."""

from __future__ import annotations

from pathlib import Path

import pytest

from magbear_cli.spec.problems import StudyError
from magbear_cli.spec.thesis import read_claims, read_comparison, read_figures, studies_folder, thesis_study


def test_the_data_that_ship_are_legal() -> None:
    """Claims have tolerances that are positive; figures have names of their own."""
    assert all(value > 0 for claim in read_claims() for value in claim.tolerance.values())
    names = [figure.id for figure in read_figures()]
    assert len(set(names)) == len(names)


def test_every_study_of_the_thesis_is_needed() -> None:
    """A study that no claim and no comparison looks at would be computed by nobody."""
    needed = {str(where["study"]) for claim in read_claims() for where in claim.cases.values()}
    there = {path.stem for path in (studies_folder() / "thesis").glob("*.yaml")}
    assert needed | {str(where["study"]) for where in read_comparison()} == there
    assert all(thesis_study(name).is_file() for name in needed)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("claims:\n  - {id: C01, place: x}\n", 2),
        ("claims:\n  - {id: X1, place: x, claim: y, printed: z, judge: a, cases: {}}\n", 2),
        ("claims: []\n", 1),
        ("clams: []\n", 1),
    ],
)
def test_a_slip_is_told_with_its_line(text: str, line: int, tmp_path: Path) -> None:
    """File, line and key."""
    path = tmp_path / "claims.yaml"
    path.write_text(text, "utf-8")
    with pytest.raises(StudyError) as caught:
        read_claims(path)
    assert caught.value.problems[0].line == line
