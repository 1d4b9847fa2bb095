"""How far from optimal mu_convex is: random bearings, each designed for by three routes that share little.

The peak of mu with complex blocks of ``mu_convex`` is compared with those of a direct search over controllers of order
four and of D-K iteration. Every figure is recomputed from the controller's matrices by the analysis, and counts only
if the loop is stable for every mass: a controller that does not stabilise can show a low mu on the axis.

Run it with ``python tests/campaigns/optimality.py --problems 25 --seed 1``.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from magbear_cli.analysis.frequency_grid import closed_frequency_grid
from magbear_cli.analysis.pole_family import pole_family
from magbear_cli.analysis.uncertain_loop import mu_study
from magbear_cli.analysis.verification import verify
from magbear_cli.errors import MagbearError
from magbear_cli.model.bearing import Bearing, CurrentLaw, linearization
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, design_fixed_order
from magbear_cli.synthesis.mu_convex import MuConvexOptions, design_mu_convex
from magbear_cli.synthesis.mu_dk import MuDkOptions, design_mu_dk

BEATEN = 0.01  # of mu: more than this below mu_convex is a fault of mu_convex
AGREES = 2e-3  # of mu: how far the level a method reports may be from the recomputed one
MASSES = 33
POINTS_PER_DECADE = 40

ROUTES: dict[str, Callable[[ControlProblem], Design]] = {
    "mu_convex": lambda problem: design_mu_convex(problem, MuConvexOptions("complex")),
    "order_4": lambda problem: design_fixed_order(problem, FixedOrderOptions(4, "complex")),
    "mu_dk": lambda problem: design_mu_dk(problem, MuDkOptions()),
}


@dataclass(frozen=True)
class Sample:
    """A random problem, in words for the table."""

    problem: ControlProblem
    words: str


@dataclass(frozen=True)
class Answer:
    """What a route reached: peak mu recomputed (∞ if not stable for every mass), and whether its claims hold."""

    peak: float
    order: int
    agrees: bool
    verified: bool
    seconds: float


@dataclass(frozen=True)
class Row:
    """A problem and the answers of all routes."""

    sample: Sample
    answers: dict[str, Answer]

    @property
    def excess(self) -> float:
        """How far mu_convex is above the best other route, relative; negative where it is the best."""
        return self.answers["mu_convex"].peak / min(a.peak for n, a in self.answers.items() if n != "mu_convex") - 1.0

    @property
    def is_verified_as_claimed(self) -> bool:
        """Whether the controller of mu_convex with a level below one is verified, as robust performance demands."""
        answer = self.answers["mu_convex"]
        return answer.verified or answer.peak > 1.0


def draw_sample(random: np.random.Generator) -> Sample:
    """A bearing, a mass range and bounds, over the ranges a user might try."""

    def between(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    law = CurrentLaw.FULL if random.random() < 0.5 else CurrentLaw.HALF_SWITCHED
    bearing = Bearing(between(2e-4, 1e-3), 4e-6, 0.5, law)
    linear = linearization(bearing)
    low = between(0.1, 30.0)
    mass = (low, min(low * random.uniform(1.05, 2.5), 50.0))
    corner, gain = between(5.0, 1000.0), between(2.0, 50.0)
    speed = float(np.sqrt(linear.negative_stiffness_n_per_m * (1.0 / mass[0] + 1.0 / mass[1]) / 2.0))
    ratio = between(8.0, 300.0)
    problem = ControlProblem.of_mass(
        linear.negative_stiffness_n_per_m,
        linear.current_stiffness_n_per_a,
        mass,
        RationalWeight.low_pass(gain, corner),
        ratio * speed,
    )
    words = (
        f"{law.value:13s} gap {bearing.air_gap_m * 1e3:.2f} mm, {mass[0]:5.2f}-{mass[1]:5.2f} kg, "
        f"W1 {gain:4.1f} to {corner:4.0f} rad/s, ωc {ratio:3.0f} x {speed:4.0f} rad/s"
    )
    return Sample(problem, words)


def judge(problem: ControlProblem, route: Callable[[ControlProblem], Design]) -> Answer:
    """The answer of one route, from the matrices it delivered."""
    begin = time.perf_counter()
    try:
        design = route(problem)
    except MagbearError as error:
        print(f"    {error}", file=sys.stderr)
        return Answer(float("inf"), 0, agrees=False, verified=False, seconds=time.perf_counter() - begin)
    seconds = time.perf_counter() - begin
    if design.controller is None:
        return Answer(float("inf"), 0, agrees=False, verified=False, seconds=seconds)
    order = design.controller.order
    if not pole_family(problem, design.controller, problem.family.shares(MASSES)).certainly_stable:
        return Answer(float("inf"), order, agrees=design.level > 1.0, verified=False, seconds=seconds)
    grid = closed_frequency_grid(problem, design.controller, POINTS_PER_DECADE)
    peak = mu_study(problem, design.controller, grid).peak_upper
    agrees = abs(peak / design.level - 1.0) <= AGREES
    return Answer(peak, order, agrees, verify(problem, design.controller, 1.0).verified, seconds)


def run(problems: int, seed: int, rivals: Sequence[str]) -> list[Row]:
    """mu_convex and its rivals on so many problems, each with a line of the table as it comes."""
    random = np.random.default_rng(seed)
    routes = {name: ROUTES[name] for name in ("mu_convex", *rivals)}
    print(f"{'problem':98s}" + "".join(f"{name:>23s}" for name in routes) + "   excess")
    rows = []
    for _ in range(problems):
        sample = draw_sample(random)
        row = Row(sample, {name: judge(sample.problem, route) for name, route in routes.items()})
        cells = "".join(
            f"  {a.peak:8.4f} ({a.order:2d}){' ' if a.agrees else '!'}{a.seconds:5.1f} s" for a in row.answers.values()
        )
        print(f"{sample.words:98s}{cells} {row.excess:+8.2%}", flush=True)
        rows.append(row)
    return rows


def summarise(rows: list[Row]) -> bool:
    """Print the summary; whether mu_convex was never beaten by more than one in a hundred, and all claims held."""
    excess = np.array([row.excess for row in rows])
    print(f"\nmu_convex above the best rival: {excess.max():+.2%} at worst, {np.median(excess):+.2%} in the middle")
    print(f"  beaten by more than {BEATEN:.0%}: {int((excess > BEATEN).sum())} of {len(rows)}")
    for name in rows[0].answers:
        wrong = sum(not row.answers[name].agrees for row in rows)
        above = [row.answers[name].peak / min(a.peak for a in row.answers.values()) - 1.0 for row in rows]
        print(f"{name}: wrong about its own level in {wrong}; above the best of all by {max(above):.2%} at worst")
    unverified = sum(not row.is_verified_as_claimed for row in rows)
    print(f"mu_convex below level one and not verified: {unverified}")
    claims = all(row.answers["mu_convex"].agrees for row in rows) and unverified == 0
    return bool(excess.max() <= BEATEN) and claims


def main() -> int:
    """The campaign as a command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", type=int, default=25, help="how many random problems")
    parser.add_argument("--seed", type=int, default=1, help="of the random problems")
    rivals = [name for name in ROUTES if name != "mu_convex"]
    parser.add_argument("--rivals", nargs="+", choices=rivals, default=rivals, help="what mu_convex is compared with")
    arguments = parser.parse_args()
    return 0 if summarise(run(arguments.problems, arguments.seed, arguments.rivals)) else 1


if __name__ == "__main__":
    sys.exit(main())
