"""The cases of a legal study, with the matrices of controllers that exist already put in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from magbear_cli.library.stored import StoredControllers

if TYPE_CHECKING:
    from magbear_cli.spec import Study
    from magbear_cli.study.plan import Case


def planned_cases(study: Study) -> tuple[Case, ...]:
    """The cases in the order of the study.

    Raises
    ------
    InputError
        when a ``stored`` controller cannot be read.
    """
    from magbear_cli.study.plan import plan_cases

    stored = StoredControllers(study.folder)
    return plan_cases(stored.put_into(inputs) for inputs in study.cases())
