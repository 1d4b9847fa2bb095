"""Changes of units that leave a system what it is: another unit of time, and states of comparable size."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace

LARGEST_EXPONENT = 500  # of a single factor of two
SWEEPS = 60  # each sweep is a few divisions; ten suffice on every system met so far


def with_time_unit(system: StateSpace, omega_rad_s: float) -> StateSpace:
    """The system in time counted in 1/omega: its response at ω is that of the original at ω·omega.

    Parameters
    ----------
    system : StateSpace
    omega_rad_s : positive number; calling again with its inverse gives the original back

    Raises
    ------
    NumericsError
        when omega is not a positive finite number.
    """
    if not 0 < omega_rad_s < np.inf:
        raise NumericsError(f"a unit of time needs a positive frequency, not {omega_rad_s}")
    return StateSpace(system.a / omega_rad_s, system.b / omega_rad_s, system.c, system.d)


def with_balanced_states(system: StateSpace) -> StateSpace:
    """The same system with its states scaled by powers of two, so that rows and columns of A are alike.

    The scaling is exact in binary arithmetic: poles, zeros and response are those of the original to the last bit.
    The 1-norms of row i and column i of A, diagonal left out, end within a factor of two of each other (Osborne
    1960; Parlett and Reinsch 1969, who stop at the same improvement of 5 %). Inputs and outputs have no say, because
    their units are arbitrary, except on states that A alone leaves undecided; B and C end with entries of one size.
    """
    a, b, c = system.a, system.b, system.c
    size = float(np.abs(a).max(initial=0.0)) or 1.0
    rows, columns = _shares(b, size).sum(axis=1), _shares(c, size).sum(axis=0)
    inside = np.abs(a - np.diag(np.diag(a)))
    decided = (inside.sum(axis=0) > 0) & (inside.sum(axis=1) > 0)
    rows[decided], columns[decided] = 0.0, 0.0
    scale = _osborne_scale(inside, rows, columns)
    b, c = b / scale[:, None], c * scale
    b_size, c_size = float(np.abs(b).max(initial=0.0)), float(np.abs(c).max(initial=0.0))
    even = 2.0 ** round(0.5 * np.log2(b_size / c_size)) if b_size > 0 and c_size > 0 else 1.0
    return StateSpace(a * scale / scale[:, None], b / even, c * even, system.d)


def _shares(channels: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """Absolute values, the largest of them made equal to the size."""
    largest = float(np.abs(channels).max(initial=0.0))
    return np.abs(channels) * (size / largest if largest > 0 else 0.0)


def _osborne_scale(
    inside: NDArray[np.float64], rows: NDArray[np.float64], columns: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Powers of two t for which the matrix t⁻¹ M t has rows and columns alike; ``rows`` and ``columns`` add to them."""
    matrix, rows, columns = inside.copy(), rows.copy(), columns.copy()
    scale = np.ones(matrix.shape[0])
    for _ in range(SWEEPS):
        settled = True
        for i in range(scale.size):
            row, column = float(matrix[i].sum() + rows[i]), float(matrix[:, i].sum() + columns[i])
            if row <= 0.0 or column <= 0.0:
                continue
            exponent = 0.5 * (np.log2(row) - np.log2(column))  # their ratio may be beyond double precision
            factor = 2.0 ** round(float(np.clip(exponent, -LARGEST_EXPONENT, LARGEST_EXPONENT)))
            if column * factor + row / factor < 0.95 * (row + column):
                matrix[i] /= factor
                rows[i] /= factor
                matrix[:, i] *= factor
                columns[i] *= factor
                scale[i] *= factor
                settled = False
        if settled:
            break
    return scale
