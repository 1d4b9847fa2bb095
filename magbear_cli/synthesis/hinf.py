"""H-infinity mixed sensitivity: the least maximum over frequency of (|W1 S|² + |W3 T|²)^½ at the nominal mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from magbear_cli.errors import NumericsError, Status
from magbear_cli.kernels.hinf import require_hinf_plant
from magbear_cli.lti.balancing import with_balanced_states, with_time_unit
from magbear_cli.lti.norm import hinf_norm
from magbear_cli.model.generalized_plant import Form, build_mixed_sensitivity_plant
from magbear_cli.model.problem import ControlProblem
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.gamma_search import AGREEMENT, DOUBLINGS, controller_in_si, search_gamma, with_unit_penalty


@dataclass(frozen=True)
class HinfOptions:
    """How close to the least level to stop, and which form of the third output to use.

    ``gamma_tolerance`` is the relative width of the last bracket. ``as_printed`` has the slip of the thesis's
    program A.2, which makes its example look harder than it is.
    """

    gamma_tolerance: float = 1e-3
    form: Form = "mended"

    def __post_init__(self) -> None:
        """Refuse a tolerance that bisection cannot reach."""
        if not 1e-6 <= self.gamma_tolerance < 1:
            raise NumericsError(f"gamma_tolerance must lie between 1e-6 and 1, not {self.gamma_tolerance}")


def design_hinf(problem: ControlProblem, options: HinfOptions | None = None) -> Design:
    """The controller with the least H-infinity norm of [W1 S; W3 T] for the rotor of nominal mass.

    ``level`` is the norm of the closed loop of the very matrices returned, recomputed from them; ``statistics`` holds
    the gamma they were computed with, the highest gamma that failed, the frequency of the norm, the norm of the mended
    form, the worst reciprocal condition number and the number of solves. Status ``ok`` means a level of at most one;
    ``not_achieved`` a level above one, with the controller all the same, or no stabilising candidate: neither is a
    proof of impossibility; ``failed`` that the problem lies outside the method, in the sentence's words.

    Notes
    -----
    Bisection on gamma at fixed levels (the thesis, section 3.2), each candidate accepted only when its loop is
    stable and its recomputed norm is at most 1.01 gamma. The plant is solved in units of time and current that bring
    its entries near one; order = 2 + the order of W1.
    """
    options = options or HinfOptions()
    try:
        plant = build_mixed_sensitivity_plant(problem, options.form)
        per_current, unit_a = with_unit_penalty(plant.system)
        require_hinf_plant(per_current.a, per_current.b, per_current.c, per_current.d, measurements=1, controls=1)
        # The rotor's speed and the bandwidth limit span the frequencies that matter.
        unit_rad_s = float(np.sqrt(problem.natural_rad_s * (problem.omega_c_rad_s or problem.natural_rad_s)))
        search = search_gamma(with_balanced_states(with_time_unit(per_current, unit_rad_s)), options.gamma_tolerance)
        if search.best is None:
            reason = f"no stabilising controller was found up to gamma = {2.0**DOUBLINGS:.0e}: {search.sentence}"
            return Design(None, Status.NOT_ACHIEVED, reason, statistics={"solves": search.solves})
        controller = controller_in_si(search.best.controller, unit_rad_s, unit_a)
        level, omega = hinf_norm(plant.closed_by(controller))
        mended, _ = hinf_norm(build_mixed_sensitivity_plant(problem).closed_by(controller))
    except NumericsError as error:
        return Design(None, Status.FAILED, str(error))
    statistics = {
        "gamma": search.best.gamma,
        "gamma_failed": search.failed_gamma,
        "norm_omega_rad_s": omega,
        "mixed_sensitivity_norm": mended,
        "rcond": search.best.rcond,
        "solves": search.solves,
    }
    status, sentence = _verdict(level, search.best.gamma)
    return Design(controller, status, sentence, level, statistics)


def _verdict(level: float, gamma: float) -> tuple[Status, str]:
    if not level <= AGREEMENT * gamma:
        return (
            Status.UNVERIFIED,
            f"gamma = {gamma:.4g}, but the loop of the controller in SI units has norm {level:.4g}",
        )
    if level > 1.0:
        return Status.NOT_ACHIEVED, f"the least gamma found is {level:.4g}: W1 and W3 are not met together (no proof)"
    return Status.OK, f"gamma, the norm of W1 S beside W3 T, is {level:.4g}"
