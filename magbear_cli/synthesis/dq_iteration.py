"""The least peak mu with complex blocks: D-scales held, the controller is convex in Q; Q held, the D-scales are convex.

No rational fit of D and no growing order: D is one diagonal a frequency. Each half is convex, but the pair is not: the
result is an upper bound of the least mu, which independent designs confirm to be tight.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.conic import Cone, solve_cone_program
from magbear_cli.kernels.structured_singular_value import mu_upper_bound
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import interconnection, open_interconnection
from magbear_cli.synthesis.descent import Descended, Descent, Grids, Responds
from magbear_cli.synthesis.frequency_span import frequency_span
from magbear_cli.synthesis.parrott import held_scales, level_discs
from magbear_cli.synthesis.stabilisation import loop_resonances, stabilises
from magbear_cli.synthesis.youla import YoulaController

Floats = NDArray[np.float64]

LAGS_PER_DECADE = 4.5  # fewer cost more than 0.5 % of mu on the thesis's problems, more gain less than 0.1 %


def iterate_dq(scaled: ControlProblem, start: Responds) -> Descended[Responds]:
    """The controller of the scaled problem with the least peak mu over a rich basis of lags.

    ``start`` is any stabilising controller: the first D-scales are those of its loop. From scales of a poor loop the
    iteration creeps, so start from a good one.
    """
    span = frequency_span(scaled)
    slow, fast = 0.05 * span.slow, 10.0 * span.fast
    poles = np.geomspace(slow, fast, max(12, int(np.ceil(LAGS_PER_DECADE * np.log10(fast / slow)))))
    form = YoulaController(float(np.sqrt(max(span.fast, 1.0))), poles, np.zeros(poles.size + 1))

    def measure(controller: Responds, omega: Floats) -> Floats:
        return np.asarray(mu_upper_bound(interconnection(scaled, controller.response(omega), omega))[0])

    def propose(controller: Responds, omega: Floats, target: float) -> tuple[Responds, float]:
        return widest_margin(scaled, controller, form, omega, target)

    def resonances(controller: Responds) -> Floats:
        return loop_resonances(scaled, controller.controller())

    descent = Descent(measure, propose, lambda controller: stabilises(scaled, controller.controller()), resonances)
    return descent.run(start, Grids(span.grid(100), span.grid(900, margin=1e4)))


def widest_margin(
    scaled: ControlProblem, present: Responds, form: YoulaController, omega: Floats, level: float
) -> tuple[YoulaController, float]:
    """With the present D-scales, the Q with the largest s in |K S − centre| ≤ (1 − s) radius at every frequency.

    Raises
    ------
    NumericsError
        when no Q exists at some frequency, or the cone program has no answer.
    """
    matrices = interconnection(scaled, present.response(omega), omega)
    discs = level_discs(open_interconnection(scaled, omega), held_scales(matrices, level), level)
    if discs.floor.max() >= level:
        raise NumericsError("with these D-scales the level is below what any controller can reach at some frequency")
    offset, basis = form.affine_terms(omega)
    rows, offset = basis / discs.radius[:, None], (offset - discs.centre) / discs.radius
    unit = 1.0 / np.maximum(np.abs(rows).max(axis=0), 1e-300)
    rows = rows * unit
    count, unknowns = rows.shape
    matrix = np.zeros((3 * count + 1, unknowns + 1))
    right = np.zeros(3 * count + 1)
    matrix[:-1:3, -1], right[:-1:3] = -1.0, 1.0
    matrix[1::3, :-1], right[1::3] = -rows.real, offset.real
    matrix[2::3, :-1], right[2::3] = -rows.imag, offset.imag
    matrix[-1, -1], right[-1] = -1.0, 1.0  # the unknown excess is at least −1: a disc can shrink to its centre only
    cost = np.zeros(unknowns + 1)
    cost[-1] = 1.0
    cones = [*[(Cone.SECOND_ORDER, 3)] * count, (Cone.NONNEGATIVE, 1)]
    answer = solve_cone_program(cost, matrix, right, cones, tolerance=1e-8)
    if not answer.is_solved:
        raise NumericsError(f"the cone program in Q ended as {answer.status}")
    return replace(form, q=answer.x[:-1] * unit), float(-answer.x[-1])
