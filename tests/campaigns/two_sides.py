"""How close the two proofs come, and whether they ever contradict each other: random bearings.

For each problem the exact design of ``mu_convex`` is proven from its stored matrices, and a certificate of what no
linear controller reaches is sought below it. A direct search over controllers of order three then attacks the
certificate: a controller below a checked bound would refute the proofs. The problems have in turn an uncertain
mass, an uncertain stiffness, and both with the current stiffness.

Run it with ``python tests/campaigns/two_sides.py --problems 40 --seed 1``.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, replace

import numpy as np
from optimality import draw_sample  # a neighbour, as both are run as scripts

from magbear_cli.errors import MagbearError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import PlantFamily
from magbear_cli.model.problem import ControlProblem
from magbear_cli.study.judging import judge_loop
from magbear_cli.study.proving import is_proof, prove_lower_bound, prove_tightly
from magbear_cli.synthesis.exact_mass import ExactMassOptions, design_exact_mass
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, design_fixed_order

CLOSE = 0.02  # of the level: bounds that lie further apart are counted


@dataclass(frozen=True)
class Row:
    """The level reached, the proven bounds on both sides (NaN where there is none), and the best attack on them."""

    level: float
    proven: float
    bound: float
    attack: float
    checked: bool
    seconds: float

    @property
    def contradiction(self) -> bool:
        """Whether something stable was found below what is proven to be impossible, or above what is proven."""
        return min(self.level, self.attack) <= self.bound or self.level > self.proven

    @property
    def gap(self) -> float:
        """How far the bounds lie apart, relative to the upper one."""
        return 1.0 - self.bound / self.proven


def worst_case_of(problem: ControlProblem, controller: StateSpace | None) -> float:
    """The worst case of a stable loop; infinite for one that is not."""
    if controller is None:
        return float("inf")
    summary, _, _ = judge_loop(problem, controller)
    if summary.worst_case is None or not (summary.max_pole_real_rad_s or 0.0) < 0.0:
        return float("inf")
    return summary.worst_case


def judge(problem: ControlProblem) -> Row:
    """Both proofs of one problem, and the attack on them."""
    begin = time.perf_counter()
    controller = design_exact_mass(problem, ExactMassOptions()).controller
    level = worst_case_of(problem, controller)
    proof = None if controller is None else prove_tightly(problem, controller, level)
    bound = prove_lower_bound(problem, level)
    seconds = time.perf_counter() - begin
    attack = design_fixed_order(problem, FixedOrderOptions(3)).controller
    return Row(
        level,
        proof.level if proof is not None and proof.proved else float("nan"),
        float("nan") if bound is None else bound.level,
        worst_case_of(problem, attack),
        bound is None or is_proof(problem, bound),
        seconds,
    )


def uncertain_family(masses: PlantFamily, number: int) -> tuple[str, PlantFamily]:
    """In turn the mass, the negative stiffness alone, and both with the current stiffness."""
    kind = ("mass", "stiffness", "all three")[number % 3]
    light, heavy, nominal = masses.first.mass_kg, masses.last.mass_kg, masses.nominal
    k_z, k_i = nominal.negative_stiffness_n_per_m, nominal.current_stiffness_n_per_a
    stiffness = (k_z * nominal.mass_kg / heavy, k_z * nominal.mass_kg / light)
    if kind == "stiffness":
        return kind, PlantFamily.of_ranges((nominal.mass_kg, nominal.mass_kg), stiffness, (k_i, k_i))
    if kind == "all three":
        return kind, PlantFamily.of_ranges((light, heavy), stiffness, (0.9 * k_i, 1.1 * k_i))
    return kind, masses


def run(problems: int, seed: int) -> list[Row]:
    """So many random problems, each with a line of the table as it comes."""
    random = np.random.default_rng(seed)
    print(f"{'problem':98s} uncertain   no one below    reached   proven below   order 3      gap")
    rows = []
    for number in range(problems):
        sample = draw_sample(random)
        name, family = uncertain_family(sample.problem.family, number)
        try:
            row = judge(replace(sample.problem, family=family))
        except MagbearError as error:
            print(f"{sample.words:98s} {error}", flush=True)
            nothing = float("nan")
            row = Row(nothing, nothing, nothing, nothing, checked=True, seconds=0.0)
        mark = " CONTRADICTION" if row.contradiction or not row.checked else ""
        print(
            f"{sample.words:98s} {name:9s} {row.bound:14.4f} {row.level:10.4f} {row.proven:14.4f} {row.attack:9.4f}"
            f" {row.gap:8.2%} {row.seconds:5.1f} s{mark}",
            flush=True,
        )
        rows.append(row)
    return rows


def summarise(rows: list[Row]) -> bool:
    """Print the summary; whether there was no contradiction."""
    gaps = np.array([row.gap for row in rows])
    known = gaps[np.isfinite(gaps)]
    wrong = sum(row.contradiction or not row.checked for row in rows)
    spread = f"{np.median(known):.2%} in the middle, {known.max():.2%} at most"
    print(f"\nboth sides proven: {known.size} of {len(rows)}; gap {spread}")
    print(f"  further apart than {CLOSE:.0%} or not proven: {len(rows) - int((known <= CLOSE).sum())}")
    print(f"contradictions: {wrong}")
    return wrong == 0


def main() -> int:
    """The campaign as a command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", type=int, default=40, help="how many random problems")
    parser.add_argument("--seed", type=int, default=1, help="of the random problems")
    arguments = parser.parse_args()
    return 0 if summarise(run(arguments.problems, arguments.seed)) else 1


if __name__ == "__main__":
    sys.exit(main())
