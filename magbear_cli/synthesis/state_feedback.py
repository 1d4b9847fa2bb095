"""Full-state feedback u = −(k_p z + k_d z'): poles placed, eigenvectors assigned, or a quadratic cost minimised.

The thesis's Table 2.3 presumes that position and speed are both measured. Here the position alone is, so that the speed
is taken from it by a differentiator with a fast pole: K = −(k_p + k_d s/(1 + s/ω_d)), one state.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.connection import feedback
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import Plant
from magbear_cli.model.problem import ControlProblem
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.lqg import lqr_gain, require_weights, rotor_matrices

Matrix = NDArray[np.float64]

DIFFERENTIATOR = 1000.0  # times the fastest closed-loop pole, where no pole is given
NEAREST = 1e-6  # relative distance below which two eigenvalues count as one, which has one eigenvector only


@dataclass(frozen=True)
class PolePlacementOptions:
    """The poles of s² + 2 ζ ω s + ω², and the pole of the differentiator (None: 1000 times as fast as these)."""

    omega_rad_s: float = 600.0
    zeta: float = 1.0
    derivative_rad_s: float | None = None

    def __post_init__(self) -> None:
        """Refuse numbers that are not positive."""
        _require_positive("omega_rad_s", self.omega_rad_s)
        _require_positive("zeta", self.zeta)
        _require_derivative(self.derivative_rad_s)


@dataclass(frozen=True)
class EigenstructureOptions:
    """The closed loop's eigenvalues, (real, imaginary) each, and the eigenvectors (position, speed) wished for them.

    With one current the eigenvalue fixes its eigenvector, (1, λ); a wish is met as nearly as that allows.
    """

    eigenvalues_rad_s: tuple[tuple[float, float], ...] = ((-500.0, 0.0), (-700.0, 0.0))
    eigenvectors: tuple[tuple[float, float], ...] = ((1.0, -500.0), (1.0, -700.0))
    derivative_rad_s: float | None = None

    def __post_init__(self) -> None:
        """Refuse eigenvalues that no real loop has, that are not stable or that are one, and vectors that are none."""
        first, second = (complex(*value) for value in self.eigenvalues_rad_s)
        if first.imag != 0.0 and first != second.conjugate():
            raise NumericsError(f"eigenvalues_rad_s must be real or a conjugate pair, not {first} and {second}")
        if first.imag == 0.0 and second.imag != 0.0:
            raise NumericsError(f"eigenvalues_rad_s must be real or a conjugate pair, not {first} and {second}")
        if not max(first.real, second.real) < 0.0:
            raise NumericsError(f"eigenvalues_rad_s must lie in the left half-plane, not {first} and {second}")
        if abs(first - second) <= NEAREST * abs(first):
            raise NumericsError("two equal eigenvalues have one eigenvector; pole_placement takes them")
        if not all(any(vector) for vector in self.eigenvectors):
            raise NumericsError("an eigenvector must not be zero")
        _require_derivative(self.derivative_rad_s)


@dataclass(frozen=True)
class LqrOptions:
    """The cost zᵀQz + R u²: the diagonal of Q over (z, z'), per m² and per (m/s)², and R, per A²."""

    q: tuple[float, float] = (1.0, 1e-5)
    r: float = 3e-9
    derivative_rad_s: float | None = None

    def __post_init__(self) -> None:
        """Refuse weights of the wrong sign."""
        require_weights(self.q, "q", self.r, "r")
        _require_derivative(self.derivative_rad_s)


def design_pole_placement(problem: ControlProblem, options: PolePlacementOptions | None = None) -> Design:
    """The feedback that gives the nominal rotor the poles asked for (Ackermann's formula for two states)."""
    options = options or PolePlacementOptions()
    omega, zeta = options.omega_rad_s, options.zeta
    gain = placed_gain(problem.nominal, omega, zeta)
    return _realised(problem, gain, options.derivative_rad_s)


def placed_gain(plant: Plant, omega_rad_s: float, zeta: float) -> Matrix:
    """(k_p, k_d) in A/m and A s/m for which this plant has the poles of s² + 2 ζ ω s + ω²."""
    position = plant.negative_stiffness_n_per_m + plant.mass_kg * omega_rad_s**2
    return np.array([position, 2.0 * zeta * omega_rad_s * plant.mass_kg]) / plant.current_stiffness_n_per_a


def design_eigenstructure(problem: ControlProblem, options: EigenstructureOptions | None = None) -> Design:
    """The feedback whose closed loop has these eigenvalues, and eigenvectors as near the wishes as can be had.

    ``statistics`` holds, for each eigenvector, the sine of the angle between the wish and what is attained, the speed
    being counted in units of |λ| times the position.

    Notes
    -----
    For each eigenvalue λ the attainable vectors v, with the input w that holds them, span the null space of
    [λ I − A, B]; the wish is projected onto it and K = W V⁻¹ up to sign (Moore 1976; Andry, Shapiro and Chung 1983).
    """
    options = options or EigenstructureOptions()
    a, b, _ = rotor_matrices(problem)
    vectors, inputs, misfits = [], [], []
    for value, wish in zip(options.eigenvalues_rad_s, options.eigenvectors, strict=True):
        vector, held = _attainable(a, b, complex(*value), np.asarray(wish, dtype=complex))
        vectors.append(vector)
        inputs.append(held)
        unit = np.array([1.0, 1.0 / abs(complex(*value))])  # a vector of the eigenvalue itself is then (1, 1) in size
        misfits.append(_sine(unit * vector, unit * np.asarray(wish)))
    gain = np.real(np.linalg.solve(np.array(vectors), np.array(inputs)))[:, 0]
    design = _realised(problem, gain, options.derivative_rad_s)
    misfit = {f"eigenvector_{number}_misfit": value for number, value in enumerate(misfits, 1)}
    return Design(design.controller, design.status, design.sentence, statistics={**design.statistics, **misfit})


def design_lqr(problem: ControlProblem, options: LqrOptions | None = None) -> Design:
    """The feedback of least ∫ xᵀQx + R u² dt for the nominal rotor. Status ``failed`` when there is none."""
    options = options or LqrOptions()
    try:
        control = lqr_gain(problem, np.diag(options.q), options.r)
    except NumericsError as error:
        return Design(None, Status.FAILED, str(error))
    design = _realised(problem, control.gain, options.derivative_rad_s)
    statistics = {**design.statistics, "control_riccati_residual": control.residual}
    return Design(design.controller, design.status, design.sentence, statistics=statistics)


def _attainable(
    a: Matrix, b: Matrix, value: complex, wish: NDArray[np.complex128]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """The attainable eigenvector nearest to a wish, and K times it, in units in which A is balanced."""
    size = a.shape[0]
    unit = np.diag(np.r_[1.0, np.full(size - 1, 1.0 / abs(value))])  # speed in units of position times |λ|
    scaled_a, scaled_b = unit @ a @ np.linalg.inv(unit), unit @ b
    size_b = np.abs(scaled_b).max()
    pencil = np.hstack([value * np.eye(size) - scaled_a, scaled_b / size_b * abs(value)])
    _, _, right = np.linalg.svd(pencil)
    basis = right[size:].conj().T  # (n + m, m)
    share, *_ = np.linalg.lstsq(basis[:size], unit @ wish, rcond=None)
    found = basis @ share
    return np.linalg.inv(unit) @ found[:size], found[size:] * abs(value) / size_b


def _sine(first: NDArray[Any], second: NDArray[Any]) -> float:
    """The sine of the angle between two vectors."""
    lengths = float(np.linalg.norm(first)) * float(np.linalg.norm(second))
    cosine = min(1.0, float(abs(np.vdot(first, second))) / lengths)
    return float(np.sqrt(1.0 - cosine**2))


def _realised(problem: ControlProblem, gain: Matrix, derivative_rad_s: float | None) -> Design:
    """The feedback on measured position and differentiated position, with the poles of the ideal and the real loop."""
    a, b, c = rotor_matrices(problem)
    ideal = np.linalg.eigvals(a - b @ gain[None, :])
    pole = derivative_rad_s or DIFFERENTIATOR * float(np.abs(ideal).max())
    # k_d s/(1 + s/p) = k_d p − k_d p²/(s + p), the state being measured in metres
    controller = StateSpace.of([[-pole]], [[pole]], [[gain[1] * pole]], [[-(gain[0] + gain[1] * pole)]])
    slowest = float(feedback(StateSpace(a, b, c, np.zeros((1, 1))), controller).poles().real.max())
    statistics = {
        "gain_position_a_per_m": float(gain[0]),
        "gain_speed_a_s_per_m": float(gain[1]),
        "derivative_rad_s": pole,
        "ideal_slowest_pole_rad_s": float(ideal.real.max()),
        "slowest_pole_rad_s": slowest,
    }
    if slowest >= 0.0:
        sentence = "the closed loop is unstable in double precision"
        return Design(controller, Status.UNSTABLE, sentence, statistics=statistics)
    return Design(controller, Status.OK, statistics=statistics)


def _require_positive(name: str, value: float) -> None:
    if not 0 < value < np.inf:
        raise NumericsError(f"{name} must be a positive number, not {value}")


def _require_derivative(value: float | None) -> None:
    if value is not None:
        _require_positive("derivative_rad_s", value)
