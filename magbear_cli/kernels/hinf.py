"""The H-infinity controller at one level gamma, by SLICOT, from a plant that has been looked at first.

SLICOT's routines can run forever on a plant that breaks their assumptions, and nothing inside the process can stop
them. So every assumption is tested here, in plain words, before the call.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import matrix_balance

from magbear_cli.errors import NumericsError

Matrix = NDArray[np.float64]
ComplexMatrix = NDArray[np.complex128]

RANK_TOLERANCE = 1e-10  # singular values below this fraction of the largest count as zero
AXIS_TOLERANCE = 1e-8  # an eigenvalue this close to the imaginary axis, relative to the matrix, counts as on it
LARGEST = 1e100  # entries beyond it overflow when they are squared

SLICOT_SAYS = {
    1: "to working precision the control does not act at some frequency: the plant's numbers span too many decades",
    2: "to working precision the measurement sees nothing at some frequency: the plant's numbers span too many decades",
    3: "the penalty on the control signal (D12) is zero or too small beside the other entries",
    4: "the disturbance on the measurement (D21) is zero or too small beside the other entries",
    5: "a singular value decomposition did not converge",
    6: "no controller of this kind reaches this level",
    7: "the Riccati equation of the control has no admissible solution at this level",
    8: "the Riccati equation of the measurement has no admissible solution at this level",
    9: "the loop through the direct gain D22 is singular",
}


@dataclass(frozen=True, eq=False)
class HinfAnswer:
    """A controller at this level, or the reason why there is none.

    ``a``, ``b``, ``c``, ``d`` are the controller's matrices, empty when ``is_solved`` is false; ``rcond`` (4,) are the
    reciprocal condition numbers of the two transformations and of the two Riccati equations.
    """

    is_solved: bool
    sentence: str
    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix
    rcond: Matrix


def hinf_controller(  # noqa: PLR0913 - the four matrices of a system are one thing
    a: Matrix,
    b: Matrix,
    c: Matrix,
    d: Matrix,
    *,
    measurements: int,
    controls: int,
    gamma: float,
    looked_at: bool = False,
) -> HinfAnswer:
    """The central controller with closed-loop norm below gamma, u = K y, for the plant (A, B, C, D).

    Parameters
    ----------
    a : (n, n), b : (n, m), c : (p, n), d : (p, m) arrays; time and channels scaled by the caller, states balanced here
    measurements, controls : how many of the last outputs go to the controller, of the last inputs come from it
    gamma : the level, positive
    looked_at : the caller knows that the plant passes ``require_hinf_plant``

    Raises
    ------
    NumericsError
        when the plant breaks an assumption of the method, in the words of ``require_hinf_plant``, or SLICOT is missing.

    Notes
    -----
    Glover and Doyle's formulas (1988) as in SLICOT's SB10FD (Petkov, Gu and Konstantinov 1998). The answer is a
    candidate: close the loop and compute its norm before believing it. The reciprocal condition numbers decide nothing:
    where the solution of a Riccati equation is zero, as for the filter of a stable plant whose disturbance enters at
    the measurement only, SLICOT's estimate is zero or noise, and the controller is good.
    """
    if not looked_at:
        require_hinf_plant(a, b, c, d, measurements=measurements, controls=controls)
    a, b, c = _with_balanced_states(a, b, c)
    if not 0 < gamma < np.inf:
        raise NumericsError(f"the level gamma must be a positive number, not {gamma}")
    sb10fd, slicot_stop = _slicot()
    n, m, p = a.shape[0], b.shape[1], c.shape[0]
    q = max(m, p)
    workspace = 2 * q * (3 * q + 2 * n) + (n + q) * (n + q + 6) + 2 * n * (n + 2 * q) + q * (4 * q + 5)
    workspace += 4 * q * q + 13 * n * n + 14 * n * q + 12 * n + 5 + 100
    try:
        *matrices, rcond = sb10fd(n, m, p, controls, measurements, gamma, a, b, c, d, ldwork=2 * workspace)
    except slicot_stop as error:
        code = int(getattr(error, "info", 0))
        return _no_controller(SLICOT_SAYS.get(code, f"SLICOT stopped with code {code}"), np.full(4, np.nan))
    if not all(np.isfinite(matrix).all() for matrix in (*matrices, rcond)):
        return _no_controller("SLICOT returned numbers that are not finite", rcond)
    a_k, b_k, c_k, d_k = (np.asarray(matrix, dtype=float) for matrix in matrices)
    return HinfAnswer(is_solved=True, sentence="", a=a_k, b=b_k, c=c_k, d=d_k, rcond=rcond)


def _slicot() -> tuple[Callable[..., tuple[Matrix, ...]], type[Exception]]:
    """SLICOT's routine and the exception it stops with, loaded only when a controller is sought."""
    try:
        from slycot import sb10fd  # noqa: PLC0415 - a compiled library
        from slycot.exceptions import SlycotArithmeticError  # noqa: PLC0415 - the same
    except ImportError as error:
        raise NumericsError(f"SLICOT cannot be loaded ({error}): install slycot again") from error
    return sb10fd, SlycotArithmeticError


def _no_controller(sentence: str, rcond: Matrix) -> HinfAnswer:
    empty = np.zeros((0, 0))
    return HinfAnswer(is_solved=False, sentence=sentence, a=empty, b=empty, c=empty, d=empty, rcond=rcond)


def require_hinf_plant(a: Matrix, b: Matrix, c: Matrix, d: Matrix, *, measurements: int, controls: int) -> None:
    """Refuse, in plain words, a plant on which the H-infinity method cannot work.

    Raises
    ------
    NumericsError
        when an entry is not finite; there are no states; sizes do not fit; (A, B2) is not stabilizable or (C2, A) not
        detectable; D12 lacks column rank or D21 row rank; or the plant from controls to errors or from disturbances
        to measurements has a zero on the imaginary axis (assumptions A1-A4 of Glover and Doyle 1988).
    """
    if not all(np.isfinite(matrix).all() for matrix in (a, b, c, d)):
        raise NumericsError("the plant holds a number that is not finite")
    if a.shape[0] == 0:
        raise NumericsError("the plant has no states: H-infinity synthesis needs at least one")
    w, z = b.shape[1] - controls, c.shape[0] - measurements
    if min(controls, measurements) < 1 or w < measurements or z < controls:
        raise NumericsError(
            f"the plant needs at least one control and one measurement, as many errors as controls ({z} and "
            f"{controls}) and as many disturbances as measurements ({w} and {measurements})"
        )
    a, b, c = _with_balanced_states(a, b, c)
    b1, b2, c1, c2, d12, d21 = b[:, :w], b[:, w:], c[:z], c[z:], d[:z, w:], d[z:, :w]
    scale = float(np.abs(d).max(initial=0.0))
    if _rank(d12, scale) < controls:
        raise NumericsError(
            "no penalty on the control signal (D12 = 0): add a bandwidth limit or a control weight"
            if not d12.any()
            else "the penalty on the control signal is not of full rank (D12): some control costs nothing"
        )
    if _rank(d21, scale) < measurements:
        raise NumericsError(
            "no disturbance on the measurement (D21 = 0): add measurement noise"
            if not d21.any()
            else "the disturbance on the measurement is not of full rank (D21): some measurement is free of noise"
        )
    _require_no_hidden_mode(
        a, b2, "the control does not reach the mode at {} rad/s, which is not stable or too slow to tell"
    )
    _require_no_hidden_mode(
        a.T,
        c2.T,
        "the measurement does not see the mode at {} rad/s, which is not stable or too slow to tell; if it belongs to "
        "a weight, move its pole to the left",
    )
    axis = "the plant from {} has a zero on the imaginary axis at {} rad/s: {}"
    zero = _axis_zero(a, b2, c1, d12)
    if zero is not None:
        raise NumericsError(axis.format("control to errors", _rad_s(zero), "weigh the errors at that frequency"))
    zero = _axis_zero(a.T, c2.T, b1.T, d21.T)
    if zero is not None:
        raise NumericsError(axis.format("disturbance to measurement", _rad_s(zero), "add a disturbance there"))


def _with_balanced_states(a: Matrix, b: Matrix, c: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """The same plant with its states scaled by powers of two, so that the rows and columns of [A B; C 0] are alike.

    Inputs and outputs have their say here: D12 and D21 give them their units.

    Raises
    ------
    NumericsError
        when no such scale fits into double precision.
    """
    n, m = a.shape[0], b.shape[1]
    whole = np.zeros((n + m + c.shape[0],) * 2)
    whole[:n, :n], whole[:n, n : n + m], whole[n + m :, :n] = a, b, c
    with np.errstate(invalid="ignore", over="ignore"):  # scipy casts the scales to integers; the check follows
        _, (scale, _) = matrix_balance(whole, permute=False, separate=True)
        scale = scale[:n]
        balanced = a / scale[:, None] * scale, b / scale[:, None], c * scale
    _require_moderate(*balanced)
    return balanced


def _require_moderate(*matrices: Matrix) -> None:
    if not all(np.isfinite(matrix).all() and np.abs(matrix).max(initial=0.0) < LARGEST for matrix in matrices):
        raise NumericsError("the plant's numbers span too many decades for double precision")


def _rank(matrix: Matrix, scale: float) -> int:
    return int((np.linalg.svd(matrix, compute_uv=False) > RANK_TOLERANCE * scale).sum())


def _require_no_hidden_mode(a: Matrix, b: Matrix, sentence: str) -> None:
    """The test of Popov, Belevitch and Hautus on every eigenvalue that is not stable."""
    size = float(np.linalg.norm(a, 2))
    norms = np.linalg.norm(b, axis=0)
    b = b / np.where(norms > 0, norms, 1.0) * (size if size > 0 else 1.0)  # the unit of a channel is arbitrary
    for mode in np.linalg.eigvals(a):
        if mode.real >= -AXIS_TOLERANCE * size and _loses_rank(np.hstack([a - mode * np.eye(a.shape[0]), b])):
            raise NumericsError(sentence.format(_rad_s(mode)))


def _axis_zero(a: Matrix, b: Matrix, c: Matrix, d: Matrix) -> complex | None:
    """A point s = jω where [A − s I, B; C, D] loses column rank, for D of full column rank.

    Eliminating u = −D⁺ (C x) leaves the modes of A − B D⁺ C that the remaining outputs (I − D D⁺) C do not see.
    """
    inverse_d = np.linalg.pinv(d)
    with np.errstate(over="ignore", invalid="ignore"):  # the check follows
        inner = a - b @ inverse_d @ c
        outer = c - d @ inverse_d @ c
    _require_moderate(inner, outer)
    size = max(float(np.linalg.norm(inner, 2)), float(np.linalg.norm(a, 2)))
    for mode in np.linalg.eigvals(inner):
        on_axis = abs(mode.real) <= AXIS_TOLERANCE * size
        if on_axis and _loses_rank(np.vstack([inner - 1j * mode.imag * np.eye(a.shape[0]), outer]).T):
            return complex(mode)
    return None


def _loses_rank(matrix: ComplexMatrix) -> bool:
    """Whether the rows of a wide matrix are dependent, each row measured against its own size."""
    sizes = np.linalg.norm(matrix, axis=1, keepdims=True)
    if (sizes == 0.0).any():
        return True
    return bool(np.linalg.svd(matrix / sizes, compute_uv=False)[-1] <= AXIS_TOLERANCE)


def _rad_s(mode: complex) -> str:
    """A mode in words: 0, a real number, ±ωj or a pair."""
    real, imaginary = float(np.real(mode)), abs(float(np.imag(mode)))
    size = AXIS_TOLERANCE * abs(mode)
    if imaginary <= size:
        return f"{real + 0.0:.4g}"
    return f"±{imaginary:.4g}j" if abs(real) <= size else f"{real:.4g}±{imaginary:.4g}j"
