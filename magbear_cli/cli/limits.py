"""``magbear limits``: where linear control ends, proven from both sides."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from magbear_cli.cli.options import RESULTS, STUDY, as_json, overrides

if TYPE_CHECKING:
    from collections.abc import Mapping

    from magbear_cli.study.limits import LimitBracket


@click.command()
@click.argument("study", type=STUDY, required=False)
@click.option(
    "--mass", "masses", multiple=True, metavar="LOW:HIGH", help="A range of masses in kg, or one. Repeatable."
)
@click.option(
    "--tol", default=0.01, show_default=True, type=click.FloatRange(1e-3, 0.5), help="Width of the bracket to reach."
)
@click.option("-o", "--output", type=RESULTS, metavar="FILE", help="Keep controllers and certificates in a JSON file.")
@overrides
@as_json
def limits(
    study: Path | None,
    masses: tuple[str, ...],
    tol: float,
    output: Path | None,
    overrides: tuple[str, ...],
    *,
    as_json: bool,
) -> None:
    """Bracket the smallest ω_c that linear control can meet.

    One bracket for each mass range. Above it a controller is proven to meet the specification for every mass and every
    frequency; below it a checked certificate proves that no linear controller does. Without STUDY, for the thesis's
    thrust bearing. The study's own bandwidth limit and controller do not matter here.

    \b
    Example:  magbear limits --mass 3.0:3.5 --mass 3.0:4.5
    """
    import json

    from magbear_cli.cli.output import put, put_json, tell
    from magbear_cli.spec import compile_sweep, parse_mass, read_study, read_study_text
    from magbear_cli.study.building import build_problem
    from magbear_cli.study.limits import LimitOptions, bracket_limit

    base = None if study is None else read_study(study)
    text = compile_sweep(
        [],
        [parse_mass(mass) for mass in masses],
        [],
        None if base is None else base.text,
        None if base is None else base.folder,
    )
    curves, kept, seen = [], [], set()
    for inputs in read_study_text(text, "limits", overrides).cases():
        problem = build_problem(inputs)
        asked = (
            problem.mass,
            problem.performance,
            problem.negative_stiffness_n_per_m,
            problem.current_stiffness_n_per_a,
        )
        if asked in seen:
            continue
        seen.add(asked)
        bracket = bracket_limit(problem, LimitOptions(tolerance=tol))
        curves.append(_curve(inputs, bracket))
        kept.append(curves[-1] | _proofs(bracket))
        if not as_json:
            put(_line(curves[-1]))
    if output is not None:
        from magbear_cli.store.durable import write_durably

        write_durably(output, (json.dumps({"curves": kept}, indent=2, allow_nan=False) + "\n").encode())
        tell(f"controllers and certificates: {output}")
    if as_json:
        put_json({"curves": curves})


def _curve(inputs: Mapping[str, Any], bracket: LimitBracket) -> dict[str, Any]:
    return {
        "mass_kg": inputs["mass_kg"],
        "omega_c_feasible": bracket.omega_c_feasible_rad_s,
        "omega_c_infeasible": bracket.omega_c_infeasible_rad_s,
        "controller_order": None if bracket.controller is None else bracket.controller.order,
        "verified": bracket.proof is not None and bracket.proof.proved,
        "sentence": bracket.sentence,
    }


def _proofs(bracket: LimitBracket) -> dict[str, Any]:
    """What a reader needs to check both sides again: the matrices of the controller, the numbers of the certificate."""
    found = bracket.controller
    controller = None if found is None else {name: getattr(found, name).tolist() for name in "abcd"}
    return {
        "controller": controller,
        "certificate": None if bracket.certificate is None else bracket.certificate.numbers(),
        "achievable": "" if bracket.proof is None else bracket.proof.sentence,
        "impossible": "" if bracket.check is None else bracket.check.sentence,
    }


def _line(curve: Mapping[str, Any]) -> str:
    mass = curve["mass_kg"]
    told = "-".join(f"{bound:g}" for bound in mass) if isinstance(mass, list) else f"{mass:g}"
    low, high = curve["omega_c_infeasible"], curve["omega_c_feasible"]
    impossible = "no proof of impossibility" if low is None else f"impossible at {low:.1f} rad/s"
    order = f"met at {high:.1f} rad/s by a controller of order {curve['controller_order']}" if high else "not met"
    return f"{told} kg: {impossible}, {order} ({curve['sentence']})"
