"""What tells cases apart."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from magbear_cli.report.series import Labels, file_stem, frequency_view
from magbear_cli.study.outcome import CaseOutcome

MakeCase = Callable[..., CaseOutcome]


def test_only_options_that_differ_are_told(make_case: MakeCase) -> None:
    """A method's options appear in its name when the study has several of them."""
    cases = [
        make_case(index, controller=controller, curves=False)
        for index, controller in enumerate(
            [
                {"method": "hinf", "form": "mended", "gamma_tolerance": 1e-3},
                {"method": "fixed_order", "order": 1, "seed": 0},
                {"method": "fixed_order", "order": 2, "seed": 0},
            ]
        )
    ]
    labels = Labels(cases)
    assert [labels.controller(case) for case in cases] == ["hinf", "fixed_order 1", "fixed_order 2"]


def test_files_of_equal_ids_have_different_names(make_case: MakeCase) -> None:
    """Two cases with one id, which a results file should not hold, do not overwrite each other's figures."""
    first = make_case(3, curves=False)
    second = CaseOutcome(first.case_id, 4, first.inputs, first.status)
    assert file_stem(first, (first, second)) != file_stem(second, (first, second))


def test_the_view_holds_both_bounds(make_case: MakeCase) -> None:
    """Whole decades around the corner of W1 and the bandwidth limit are shown, within what was computed."""
    study = make_case(0).frequency
    assert study is not None
    low, high = frequency_view(study)
    assert low <= 200.0 / 10 < 20_000.0 * 10 <= high
    np.testing.assert_allclose(np.log10([low, high]), np.round(np.log10([low, high])), atol=1e-12)
