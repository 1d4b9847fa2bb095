"""Changes of units that leave a system what it is: another unit of time, and states of comparable size."""

from __future__ import annotations

import numpy as np

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace

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
    """The same system with its states scaled by powers of two, so that rows and columns of [A B; C 0] are alike.

    The scaling is exact in binary arithmetic: poles, zeros and response are those of the original to the last bit.
    The 1-norms of row i and column i of [A B; C 0], diagonal left out, end within a factor of two of each other
    (Osborne 1960; Parlett and Reinsch 1969, who stop at the same improvement of 5 %).
    """
    a, b, c = system.a.copy(), system.b.copy(), system.c.copy()
    for _ in range(SWEEPS):
        settled = True
        for i in range(system.order):
            diagonal = abs(a[i, i])
            row = float(np.abs(a[i]).sum() - diagonal + np.abs(b[i]).sum())
            column = float(np.abs(a[:, i]).sum() - diagonal + np.abs(c[:, i]).sum())
            if row <= 0.0 or column <= 0.0:
                continue
            factor = 2.0 ** round(0.5 * np.log2(row / column))
            if column * factor + row / factor < 0.95 * (row + column):
                a[i] /= factor
                b[i] /= factor
                a[:, i] *= factor
                c[:, i] *= factor
                settled = False
        if settled:
            break
    return StateSpace(a, b, c, system.d)
