"""The two proofs of a case: what its controller reaches at every frequency, and what no linear controller can reach."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from magbear_cli.analysis.certificate import check_certificate
from magbear_cli.analysis.gridless import LevelProof, prove_level
from magbear_cli.analysis.verification import Verification, verify
from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.impossibility_certificate import ImpossibilityCertificate
from magbear_cli.model.problem import ControlProblem
from magbear_cli.study.outcome import ImpossibilityProof
from magbear_cli.synthesis.impossibility import ImpossibilityOptions, find_impossibility

SPECIFIED = 1.0  # the level that meets the specification
LAG_DENSITIES = (12.0, 16.0, 14.0, 10.0)  # lags per decade of a certificate's functions, as they are tried
_TIGHT = 5e-4  # of the worst case: how far above it the proof is sought first
_GAPS = (0.007, 0.0095, 0.013, 0.02, 0.03, 0.05)  # of the level reached: how far below it a proof is sought


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
    for density in LAG_DENSITIES:
        certificate = find_impossibility(problem, level, ImpossibilityOptions(lags_per_decade=density))
        if certificate is None:
            continue
        check = check_certificate(problem, certificate)
        if check.valid:
            return _in_numbers(certificate, check.sentence)
    return None


def prove_lower_bound(problem: ControlProblem, reached: float) -> ImpossibilityProof | None:
    """The proof of the highest level found that is below what a controller reaches and that no controller reaches."""
    if not np.isfinite(reached) or reached <= 0:
        return None
    return _first(prove_impossible(problem, reached * (1.0 - gap)) for gap in _GAPS)


def is_proof(problem: ControlProblem, proof: ImpossibilityProof) -> bool:
    """Whether the stored numbers are a proof, by the checker alone."""
    numbers = {
        "level": proof.level,
        "x_poles_rad_s": proof.x_poles_rad_s.tolist(),
        "x_coefficients": proof.x_coefficients.tolist(),
        "y_poles_rad_s": proof.y_poles_rad_s.tolist(),
        "y_coefficients": proof.y_coefficients.tolist(),
    }
    try:
        return check_certificate(problem, ImpossibilityCertificate.of_numbers(numbers)).valid
    except NumericsError:
        return False


def _first(proofs: Iterable[ImpossibilityProof | None]) -> ImpossibilityProof | None:
    return next((proof for proof in proofs if proof is not None), None)


def _in_numbers(certificate: ImpossibilityCertificate, sentence: str) -> ImpossibilityProof:
    return ImpossibilityProof(
        certificate.level,
        np.array(certificate.x_poles_rad_s),
        np.array(certificate.x_coefficients),
        np.array(certificate.y_poles_rad_s),
        np.array(certificate.y_coefficients),
        sentence,
    )
