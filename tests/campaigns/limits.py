"""How narrow the brackets of ``limits`` are for random bearings and weights of W1, and whether a met side is too high.

Each problem has a random bearing, one mass or a range, and W1 of order one to three of a random kind: real poles,
complex poles, biproper. The bracket of ``limits`` is proven from both sides. A full design of ``mu_convex`` then says,
by bisection, from which bandwidth limit on the specification is met: the met side should not lie far above it.

Run it with ``python tests/campaigns/limits.py --problems 60 --seed 1``.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from magbear_cli.analysis.gridless import prove_level
from magbear_cli.errors import NumericsError
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.study.limits import LimitBracket, LimitOptions, bracket_limit
from magbear_cli.study.proving import is_proof
from magbear_cli.synthesis.exact_mass import ExactMassOptions, design_exact_mass

KINDS = ("first order", "second order, real", "second order, complex", "third order, complex", "biproper")
TOLERANCE = 0.01  # the widest bracket that is asked for
CLOSE = 0.005  # how far above the best design the met side may lie
_BEST_ORDER = 24
_BISECTIONS = 5


@dataclass(frozen=True)
class Row:
    """One problem: the bracket, whether its proofs hold, and the smallest ω_c that a full design reaches."""

    kind: str
    bracket: LimitBracket
    sound: bool
    best_rad_s: float
    seconds: float

    @property
    def excess(self) -> float:
        """How far the met side lies above the smallest ω_c of a full design, relative to that."""
        met = self.bracket.omega_c_feasible_rad_s
        return float("inf") if met is None else max(met / self.best_rad_s - 1.0, 0.0)


def draw_problems(count: int, seed: int) -> Iterator[tuple[str, ControlProblem]]:
    """Random problems, the kinds of W1 in turn."""
    random = np.random.default_rng(seed)
    for number in range(count):
        kind = KINDS[number % len(KINDS)]
        low = float(10.0 ** random.uniform(-1.0, 1.3))
        ratio = 1.0 if random.random() < 0.2 else float(random.uniform(1.05, 6.0))
        stiffness, force = float(10.0 ** random.uniform(3.5, 6.0)), float(10.0 ** random.uniform(0.5, 2.5))
        natural = np.sqrt(stiffness / low)
        corner = natural * float(10.0 ** random.uniform(-1.0, 0.3))
        gain = float(10.0 ** random.uniform(0.3, 1.3))
        weight = _weight(kind, gain, corner, random)
        yield kind, ControlProblem.of_mass(stiffness, force, (low, low * ratio), weight)


def _weight(kind: str, gain: float, corner: float, random: np.random.Generator) -> RationalWeight:
    """W1 of a kind with a gain at rest and a corner."""
    far, damping = float(random.uniform(1.5, 8.0)), float(random.uniform(0.08, 0.8))
    if kind == "first order":
        return RationalWeight((gain * corner,), (1.0, corner))
    if kind == "biproper":
        high = float(random.uniform(0.05, 0.6))
        return RationalWeight((high, gain * corner), (1.0, corner))
    real = np.array([1.0, corner])
    pair = np.array([1.0, 2.0 * damping * corner, corner**2])
    if kind == "second order, real":
        den = np.polymul(real, [1.0, far * corner])
    elif kind == "second order, complex":
        den = pair
    else:
        den = np.polymul(pair, [1.0, far * corner])
    return RationalWeight((gain * float(den[-1]),), tuple(float(value) for value in den))


def smallest_met(problem: ControlProblem, met_rad_s: float) -> float:
    """The smallest ω_c, within 0.05 %, at which a full design is proven, from the met one down to 3 % below."""
    low, high = met_rad_s * 0.97, met_rad_s
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        at_middle = replace(problem, omega_c_rad_s=middle)
        try:
            design = design_exact_mass(at_middle, ExactMassOptions(max_order=_BEST_ORDER, loss=0.0))
            met = design.controller is not None and prove_level(at_middle, design.controller, 1.0).proved
        except NumericsError:
            met = False
        low, high = (low, middle) if met else (middle, high)
    return high


def judge(kind: str, problem: ControlProblem) -> Row:
    """The bracket of one problem, its proofs again from the numbers, and the best design."""
    begin = time.perf_counter()
    bracket = bracket_limit(problem, LimitOptions(tolerance=TOLERANCE))
    seconds = time.perf_counter() - begin
    met, impossible = bracket.omega_c_feasible_rad_s, bracket.omega_c_infeasible_rad_s
    sound = met is None or (
        bracket.controller is not None and prove_level(bracket.met_problem, bracket.controller, 1.0).proved
    )
    if impossible is not None and bracket.impossibility is not None:
        sound = sound and is_proof(replace(problem, omega_c_rad_s=impossible), bracket.impossibility)
    best = float("nan") if met is None else smallest_met(problem, met)
    if impossible is not None:
        sound = sound and not best <= impossible
    return Row(kind, bracket, sound, best, seconds)


def run(problems: int, seed: int) -> list[Row]:
    """So many random problems, each with a line of the table as it comes."""
    print(f"{'kind of W1':24s} impossible up to   met from   best design    width   excess   time")
    rows = []
    for kind, problem in draw_problems(problems, seed):
        row = judge(kind, problem)
        bracket = row.bracket
        print(
            f"{kind:24s} {bracket.omega_c_infeasible_rad_s or np.nan:16.5g} "
            f"{bracket.omega_c_feasible_rad_s or np.nan:10.5g} {row.best_rad_s:13.5g} {bracket.width:8.2%} "
            f"{row.excess:8.2%} {row.seconds:5.1f} s{'' if row.sound else ' UNSOUND'} {bracket.sentence}",
            flush=True,
        )
        rows.append(row)
    return rows


def summarise(rows: list[Row]) -> bool:
    """Print the summary by kind of weight; whether every proof holds."""
    print("\nkind of W1                problems   widest   median   farthest met side   slowest")
    for kind in KINDS:
        own = [row for row in rows if row.kind == kind]
        if not own:
            continue
        widths = np.array([row.bracket.width for row in own])
        print(
            f"{kind:24s} {len(own):9d} {widths.max():8.2%} {np.median(widths):8.2%} "
            f"{max(row.excess for row in own):19.2%} {max(row.seconds for row in own):8.1f} s"
        )
    narrow = sum(row.bracket.width <= TOLERANCE for row in rows)
    near = sum(row.excess <= CLOSE for row in rows)
    unsound = sum(not row.sound for row in rows)
    print(f"\nbrackets within {TOLERANCE:.0%}: {narrow} of {len(rows)}; met sides within {CLOSE:.1%}: {near}")
    print(f"unsound proofs: {unsound}")
    return unsound == 0


def main() -> int:
    """The campaign as a command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", type=int, default=60, help="how many random problems")
    parser.add_argument("--seed", type=int, default=1, help="of the random problems")
    arguments = parser.parse_args()
    return 0 if summarise(run(arguments.problems, arguments.seed)) else 1


if __name__ == "__main__":
    sys.exit(main())
