"""Systems put together: in series, side by side, in a loop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace

WELL_POSED_RCOND = 1e-14  # below this the algebraic loop has no solution that double precision can hold


def series(first: StateSpace, second: StateSpace) -> StateSpace:
    """The product second·first: the output of the first is the input of the second; states in that order."""
    _require(first.outputs == second.inputs, "series", first, second)
    return StateSpace(
        np.block([[first.a, np.zeros((first.order, second.order))], [second.b @ first.c, second.a]]),
        np.vstack([first.b, second.b @ first.d]),
        np.hstack([second.d @ first.c, second.c]),
        second.d @ first.d,
    )


def parallel(first: StateSpace, second: StateSpace) -> StateSpace:
    """The sum first + second: one input to both, outputs added."""
    _require((first.inputs, first.outputs) == (second.inputs, second.outputs), "parallel", first, second)
    return StateSpace(
        _diagonal(first.a, second.a),
        np.vstack([first.b, second.b]),
        np.hstack([first.c, second.c]),
        first.d + second.d,
    )


def append(first: StateSpace, second: StateSpace) -> StateSpace:
    """Both systems side by side, inputs and outputs of the first before those of the second."""
    return StateSpace(
        _diagonal(first.a, second.a),
        _diagonal(first.b, second.b),
        _diagonal(first.c, second.c),
        _diagonal(first.d, second.d),
    )


def feedback(forward: StateSpace, backward: StateSpace) -> StateSpace:
    """(I − F B)⁻¹ F, positive feedback: the input of F is u plus B times the output of F; states of F, then of B.

    Raises
    ------
    NumericsError
        when the sizes do not fit or the algebraic loop I − D_B D_F is singular.
    """
    _require((forward.inputs, forward.outputs) == (backward.outputs, backward.inputs), "feedback", forward, backward)
    m, p = forward.inputs, forward.outputs
    plant = StateSpace(
        forward.a,
        np.hstack([forward.b, forward.b]),
        np.vstack([forward.c, forward.c]),
        np.block([[forward.d, forward.d], [forward.d, forward.d]]).reshape(2 * p, 2 * m),
    )
    return lower_lft(plant, backward)


def lower_lft(plant: StateSpace, controller: StateSpace) -> StateSpace:
    """P11 + P12 K (I − P22 K)⁻¹ P21: the controller from the plant's last outputs to its last inputs.

    States of the plant first, then those of the controller. The loop is closed in the sign that is given: u = K y.

    Raises
    ------
    NumericsError
        when the sizes do not fit or the algebraic loop I − D22 D_K is singular.
    """
    w, z = plant.inputs - controller.outputs, plant.outputs - controller.inputs
    _require(w >= 0 and z >= 0, "lower_lft", plant, controller)
    b1, b2, c1, c2 = plant.b[:, :w], plant.b[:, w:], plant.c[:z], plant.c[z:]
    d11, d12, d21, d22 = plant.d[:z, :w], plant.d[:z, w:], plant.d[z:, :w], plant.d[z:, w:]
    loop = _loop_inverse(d22, controller.d)
    through = controller.d @ loop
    y_x, y_k, y_w = loop @ c2, loop @ d22 @ controller.c, loop @ d21  # y from x, from the controller's states, from w
    u_x, u_k, u_w = through @ c2, controller.c + controller.d @ y_k, through @ d21
    return StateSpace(
        np.block([[plant.a + b2 @ u_x, b2 @ u_k], [controller.b @ y_x, controller.a + controller.b @ y_k]]),
        np.vstack([b1 + b2 @ u_w, controller.b @ y_w]),
        np.hstack([c1 + d12 @ u_x, d12 @ u_k]),
        d11 + d12 @ u_w,
    )


def inverse(system: StateSpace) -> StateSpace:
    """The system from outputs back to inputs, for a square system with an invertible D.

    Raises
    ------
    NumericsError
        when D is not square or is singular.
    """
    if system.inputs != system.outputs or _rcond(system.d) < WELL_POSED_RCOND:
        raise NumericsError("only a square system with an invertible direct gain D has a proper inverse")
    d = np.asarray(np.linalg.inv(system.d), dtype=float)
    return StateSpace(system.a - system.b @ d @ system.c, system.b @ d, -d @ system.c, d)


def _loop_inverse(d22: NDArray[np.float64], d_k: NDArray[np.float64]) -> NDArray[np.float64]:
    loop = np.eye(d22.shape[0]) - d22 @ d_k
    if _rcond(loop) < WELL_POSED_RCOND:
        raise NumericsError("the feedback loop is not well posed: 1 − D·D_K is singular")
    return np.asarray(np.linalg.inv(loop), dtype=float)


def _rcond(matrix: NDArray[np.float64]) -> float:
    values = np.linalg.svd(matrix, compute_uv=False)
    return 1.0 if values.size == 0 else float(values[-1] / values[0]) if values[0] > 0 else 0.0


def _diagonal(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    (p, m), (q, n) = first.shape, second.shape  # a loop of a few states is closed by a dozen of these
    both = np.zeros((p + q, m + n))
    both[:p, :m], both[p:, m:] = first, second
    return both


def _require(fits: bool, name: str, first: StateSpace, second: StateSpace) -> None:  # noqa: FBT001 - a private guard
    if not fits:
        sizes = f"{first.outputs}x{first.inputs} and {second.outputs}x{second.inputs}"
        raise NumericsError(f"systems of {sizes} outputs x inputs do not fit in {name}")
