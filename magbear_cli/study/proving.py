"""The two proofs of a case: what its controller reaches at every frequency, and what no linear controller can reach."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from magbear_cli.analysis.certificate import check_certificate
from magbear_cli.analysis.gridless import LevelProof, prove_level
from magbear_cli.analysis.verification import Verification, verify
from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.impossibility_certificate import (
    PAIR_NUMBERS,
    ImpossibilityCertificate,
    fast_end_excess,
    without_certificate,
)
from magbear_cli.model.problem import ControlProblem
from magbear_cli.study.outcome import ImpossibilityProof
from magbear_cli.synthesis.impossibility import ImpossibilityOptions, find_impossibility

SPECIFIED = 1.0  # the level that meets the specification
LAG_DENSITIES = (14.0, 12.0, 10.0, 16.0)  # lags per decade of a certificate's functions, as they are tried
_TIGHT = 5e-4  # of the worst case: how far above it the proof is sought first
_FIRST_GAP = 0.0035  # of the level reached: how far below it a proof is sought first
_LEVEL_SLOPE, _BANDWIDTH_SLOPE = 1.17, 0.76  # what a certificate's margin gains over the gap in level, and in ω_c
_NEEDED = 5e-4  # of that margin, for what the exchange of frequencies takes away
_HALVINGS = 2  # of the step to the first ω_c that is proven
_LEAST_STEP, _MOST_STEP, _FARTHEST_GAP = 0.12, 1.0, 0.3  # of the gap: how much farther away the next attempt is


def verify_controller(problem: ControlProblem, controller: StateSpace, worst_case: float | None) -> Verification:
    """Whether the controller, as stored, is proven to meet the specification for every mass at every frequency.

    ``worst_case`` is what sampling found: it says how tight a proof to try first, and a proof never overrules it.
    Where there is no proof, a dense search tells why, and whether the loop is stable at all.
    """
    worst = np.nan if worst_case is None else worst_case
    if not worst >= SPECIFIED:  # NaN too may be proven
        proof = prove_tightly(problem, controller, worst)
        if proof.proved:
            boxes = {"boxes": float(proof.boxes), "narrowest_box": proof.narrowest_box}
            return Verification(
                verified=True, sentence=proof.sentence, worst_level=worst, statistics={"level": proof.level, **boxes}
            )
        found = verify(problem, controller, SPECIFIED)
        if found.verified:  # on samples only, and that is not what is claimed
            return Verification(verified=False, sentence=proof.sentence, worst_level=found.worst_level)
        return found
    found = verify(problem, controller, SPECIFIED, tolerance=0.0)
    if found.verified:
        sentence = f"one search finds a worst case of {worst:.6g}, another of {found.worst_level:.6g}"
        return Verification(verified=False, sentence=sentence, worst_level=found.worst_level)
    return found


def prove_tightly(problem: ControlProblem, controller: StateSpace, worst: float) -> LevelProof:
    """The proof of a level just above the sampled worst case, however high; failing that, of the specification."""
    tight = worst * (1.0 + _TIGHT)
    if not (np.isfinite(tight) and tight > 0):
        return prove_level(problem, controller, SPECIFIED)
    level = min(tight, SPECIFIED) if worst < SPECIFIED else tight
    proof = prove_level(problem, controller, level)
    return proof if proof.proved or level >= SPECIFIED else prove_level(problem, controller, SPECIFIED)


def prove_impossible(problem: ControlProblem, level: float = SPECIFIED) -> ImpossibilityProof | None:
    """A checked proof that every linear controller's worst case is above the level; None says nothing."""
    by_fast_end = prove_by_fast_end(problem, level)
    if by_fast_end is not None or without_certificate(problem):
        return by_fast_end
    return _attempt(problem, level)[0]


def prove_by_fast_end(problem: ControlProblem, level: float) -> ImpossibilityProof | None:
    """The proof without functions that the weight alone is: |W1(∞)| is above the level, and S(∞) = 1 in every loop."""
    if fast_end_excess(problem.performance, level) <= 0:
        return None
    none = np.zeros(0)
    sentence = f"proven: |W1| is above {level:.6g} at infinite frequency, where S = 1 with every proper controller"
    return ImpossibilityProof(level, none, none, none, none, np.zeros((0, PAIR_NUMBERS)), sentence)


def prove_lower_bound(problem: ControlProblem, reached: float) -> ImpossibilityProof | None:
    """The proof of the highest level found that is below what a controller reaches and that no controller reaches."""
    if not np.isfinite(reached) or reached <= 0 or without_certificate(problem):
        return None
    nearest = _nearest_proof(lambda gap: (problem, reached * (1.0 - gap)), _FIRST_GAP, _LEVEL_SLOPE)
    return nearest.proof


@dataclass(frozen=True)
class NearestProof:
    """The proof found nearest to a met side, the gap to it as a part of that side, and how many gaps were tried."""

    proof: ImpossibilityProof | None
    gap: float
    tried: int


def prove_bandwidth_impossible(problem: ControlProblem, level: float, first_gap: float) -> NearestProof:
    """The proof for the largest ω_c found that is at least a gap below the problem's own, which is met."""
    met = problem.omega_c_rad_s or np.nan
    return _nearest_proof(
        lambda gap: (replace(problem, omega_c_rad_s=met * (1.0 - gap)), level),
        first_gap,
        _BANDWIDTH_SLOPE,
        halvings=_HALVINGS,
    )


def _nearest_proof(
    question: Callable[[float], tuple[ControlProblem, float]], gap: float, slope: float, halvings: int = 0
) -> NearestProof:
    """Attempts ever farther from the met side; how much farther, the margin that was missing tells.

    Between the last that failed and the one that did not, so many halvings look for a nearer one.
    """
    missed, tried, proof = 0.0, 1, None
    while True:
        proof, margin = _attempt(*question(gap))
        missing = (_NEEDED - margin) / slope if np.isfinite(margin) else np.inf  # no program was solved: far away
        farther = gap + min(max(missing, _LEAST_STEP * gap), _MOST_STEP * gap)
        if proof is not None or farther > _FARTHEST_GAP:
            break
        missed, gap, tried = gap, farther, tried + 1
    for _ in range(halvings if missed and proof is not None else 0):
        middle, tried = 0.5 * (missed + gap), tried + 1
        nearer = _attempt(*question(middle))[0]
        proof, gap, missed = (proof, gap, middle) if nearer is None else (nearer, middle, missed)
    return NearestProof(proof, gap, tried)


def _attempt(problem: ControlProblem, level: float) -> tuple[ImpossibilityProof | None, float]:
    """A checked proof, or None and the margin of the first search: what fewer lags miss too."""
    margin = np.nan
    for density in LAG_DENSITIES:
        found = find_impossibility(problem, level, ImpossibilityOptions(lags_per_decade=density))
        margin = found.margin if np.isnan(margin) else margin
        if found.certificate is not None:
            check = check_certificate(problem, found.certificate)
            if check.valid:
                return _in_numbers(found.certificate, check.sentence), margin
        elif found.margin <= 0:  # fewer lags have less of it
            break
    return None, margin


def is_proof(problem: ControlProblem, proof: ImpossibilityProof) -> bool:
    """Whether the stored numbers are a proof, by the checker alone."""
    if not proof.x_poles_rad_s.size:
        return fast_end_excess(problem.performance, proof.level) > 0
    numbers = {
        "level": proof.level,
        "x_poles_rad_s": proof.x_poles_rad_s.tolist(),
        "x_coefficients": proof.x_coefficients.tolist(),
        "y_poles_rad_s": proof.y_poles_rad_s.tolist(),
        "y_coefficients": proof.y_coefficients.tolist(),
        "y_pairs": proof.y_pairs.ravel().tolist(),
    }
    try:
        return check_certificate(problem, ImpossibilityCertificate.of_numbers(numbers)).valid
    except NumericsError:
        return False


def _in_numbers(certificate: ImpossibilityCertificate, sentence: str) -> ImpossibilityProof:
    return ImpossibilityProof(
        certificate.level,
        np.array(certificate.x_poles_rad_s),
        np.array(certificate.x_coefficients),
        np.array(certificate.y_poles_rad_s),
        np.array(certificate.y_coefficients),
        np.array(certificate.y_pairs, dtype=float).reshape(-1, PAIR_NUMBERS),
        sentence,
    )
