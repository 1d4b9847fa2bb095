"""Adaptive control by local function estimation: the numbers of its law from a problem and a reference model.

Nothing is optimised here. The state feedback puts the poles of the reference model into the loop of one rotor, and the
estimate is to make up for every other rotor and for the nonlinearity (thesis section 4.4).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from magbear_cli.errors import NumericsError
from magbear_cli.model.adaptive_law import AdaptiveLaw, Trigger
from magbear_cli.model.problem import ControlProblem
from magbear_cli.synthesis.state_feedback import placed_gain


@dataclass(frozen=True)
class AdaptiveLfeOptions:
    """The parameters of the thesis's Table 4.2 and the reference model of its section 4.5.

    ``gain`` is K in (A/m, A s/m); None places the reference model's poles for ``design_mass_kg``, which without a value
    is the lightest of the range. ``input_gain_m_per_s2_a`` is the b of the law; None takes that for which the gain
    gives the reference model its damping, 2 ζ ω/K_speed. Of a gain that is placed this is k_i/m; of a gain that is
    printed it is what its author presumed.
    """

    gamma: float = 2e9
    rho_m: float = 1e-6
    sigma_m: float = 0.5e-6
    gain: tuple[float, float] | None = (1.71e4, 52.8)
    design_mass_kg: float | None = None
    input_gain_m_per_s2_a: float | None = None
    reference_omega_rad_s: float = 600.0
    reference_zeta: float = 1.0
    taylor_order: int = 1
    trigger: str = "position"
    adaptation_input_gain_m_per_s2_a: float | None = None


@dataclass(frozen=True, eq=False)
class AdaptiveDesign:
    """An adaptive law and what is to be told of it."""

    law: AdaptiveLaw
    statistics: Mapping[str, float]


def design_adaptive_lfe(problem: ControlProblem, options: AdaptiveLfeOptions | None = None) -> AdaptiveDesign:
    """The law of the options for a linearised bearing.

    ``statistics`` holds the gain, the b of the law and that of the plant, P, and the poles that the state feedback
    alone gives the lightest and the heaviest rotor of the range: how far the estimate has to go.

    Raises
    ------
    NumericsError
        when the numbers describe no law.
    """
    options = options or AdaptiveLfeOptions()
    mass = problem.family.first.mass_kg if options.design_mass_kg is None else options.design_mass_kg
    omega, zeta = options.reference_omega_rad_s, options.reference_zeta
    gain = options.gain or placed_gain(replace(problem.nominal, mass_kg=mass), omega, zeta)
    gain = (float(gain[0]), float(gain[1]))
    if options.input_gain_m_per_s2_a is None and not gain[1] > 0.0:
        raise NumericsError(f"without a positive gain on the speed, not {gain[1]}, the law needs an input gain")
    b = options.input_gain_m_per_s2_a or 2.0 * zeta * omega / gain[1]
    law = AdaptiveLaw(
        omega_rad_s=omega,
        zeta=zeta,
        gain_position_a_per_m=gain[0],
        gain_speed_a_s_per_m=gain[1],
        input_gain_m_per_s2_a=b,
        gamma=options.gamma,
        rho_m=options.rho_m,
        sigma_m=options.sigma_m,
        taylor_order=options.taylor_order,
        trigger=Trigger(options.trigger),
        adaptation_input_gain_m_per_s2_a=options.adaptation_input_gain_m_per_s2_a,
    )
    return AdaptiveDesign(law, _statistics(problem, law, mass))


def _statistics(problem: ControlProblem, law: AdaptiveLaw, mass_kg: float) -> dict[str, float]:
    family, k_i = problem.family, problem.nominal.current_stiffness_n_per_a
    p = law.lyapunov
    found = {
        "gain_position_a_per_m": law.gain_position_a_per_m,
        "gain_speed_a_s_per_m": law.gain_speed_a_s_per_m,
        "input_gain_m_per_s2_a": law.input_gain_m_per_s2_a,
        "plant_input_gain_m_per_s2_a": k_i / mass_kg,
        "design_mass_kg": mass_kg,
        "gamma": law.gamma,
        "adaptation_gain": law.adaptation_gain,
        "lyapunov_position": float(p[0, 0]),
        "lyapunov_cross": float(p[0, 1]),
        "lyapunov_speed": float(p[1, 1]),
    }
    for name, mass in (("lightest", family.first.mass_kg), ("heaviest", family.last.mass_kg)):
        stiffness = k_i * law.gain_position_a_per_m - problem.nominal.negative_stiffness_n_per_m
        poles = np.roots([mass, k_i * law.gain_speed_a_s_per_m, stiffness])
        found[f"feedback_pole_real_{name}_rad_s"] = float(poles.real.max())
        found[f"feedback_pole_imag_{name}_rad_s"] = float(np.abs(poles.imag).max())
    return found
