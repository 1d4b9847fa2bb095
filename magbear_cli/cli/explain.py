"""``magbear explain``: what an error code, a status or an exit code means, and what to do."""

from __future__ import annotations

import click

from magbear_cli.errors import ExitCode, InputError, Status

STATUSES = {
    Status.OK: "Met: proven for the controller as stored, for every mass and every frequency.\n"
    "  magbear verify checks the proof again.",
    Status.INFEASIBLE: "Proven: no linear controller meets the specification. The certificate is stored.\n"
    "  Allow a larger omega_c_rad_s, ask less of performance, or narrow mass_kg; magbear limits says how far.",
    Status.NOT_ACHIEVED: "This method did not get there; that proves nothing about others.\n"
    "  Try mu_convex, which seeks the optimum over all orders, or a higher order of fixed_order.",
    Status.UNVERIFIED: "The method and samples say yes, and the proof did not succeed. Of an adaptive controller:\n"
    "  its runs stay bounded, and nothing can be proven. A worst case within 0.1 % of 1 is hard to prove.",
    Status.UNSTABLE: "The loop is not stable for every mass of the range.\n"
    "  A method that designs for one mass (lqg, hinf, …) cannot know the others: take mu_convex or fixed_order.",
    Status.TIMEOUT: "The case took longer than its limit and was stopped; nothing was computed.\n"
    "  Run it again with --timeout SECONDS, or set run.timeout_s.",
    Status.CRASHED: "The worker process was lost twice over this case: a fault in a library, or too little memory.\n"
    "  The line that repeats it alone is in the report; run.memory_gib is the limit of a case.",
    Status.FAILED: "Nothing was computed, for the reason in the case's sentence: numbers no solver can use.\n"
    "  The line that repeats it alone, with --debug, shows the traceback.",
}
CODES = {
    ExitCode.DONE: "All cases were computed; a specification that is not met is a computed answer.",
    ExitCode.DIFFERENCE: "A comparison or a check found a difference: compare, limits --check, verify, doctor.",
    ExitCode.USAGE: "The command line, the study or an input file is wrong; the sentence says where, and the remedy.",
    ExitCode.SOME_FAILED: "Some cases ended without an answer; the rest is stored, and running again tries them again.",
    ExitCode.RESUMABLE: "Stopped for a reason outside (full disk, another runner); run the same command again.",
    ExitCode.BUG: "A bug of magbear; the message names a file with the details, for a report.",
    ExitCode.INTERRUPTED: "Interrupted (Ctrl-C); what was finished is stored, and running again goes on.",
    ExitCode.TERMINATED: "Terminated (SIGTERM); what was finished is stored, and running again goes on.",
}


def _codes(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[str]:
    """What the shell may complete."""
    from magbear_cli.spec.problems import CODES as ERRORS

    names = [*ERRORS, *(status.value for status in STATUSES), *(str(int(code)) for code in CODES)]
    return [name for name in names if name.lower().startswith(incomplete.lower())]


@click.command()
@click.argument("code", required=False, shell_complete=_codes)
def explain(code: str | None) -> None:
    """Tell what an error code, a status or an exit code means.

    Without CODE every one is listed.

    \b
    Example:  magbear explain E102
              magbear explain not_achieved
    """
    from magbear_cli.cli.output import put
    from magbear_cli.spec.problems import CODES as ERRORS

    if code is not None:
        put(_explained(code))
        return
    put("Errors of a study, with the place and a remedy in the message:")
    for name, meaning in ERRORS.items():
        put(f"  {name}  {meaning}")
    put("\nStatuses of a case:")
    for status, text in STATUSES.items():
        put(f"  {status.value:<12}  {text.splitlines()[0]}")
    put("\nExit codes:")
    for number, text in CODES.items():
        put(f"  {int(number):>4}  {text}")


def _explained(code: str) -> str:
    from magbear_cli.spec.explanations import explain_code
    from magbear_cli.spec.problems import CODES as ERRORS
    from magbear_cli.spec.problems import did_you_mean

    error = explain_code(code.upper())
    if error is not None:
        return str(error)
    name = code.lower().replace("-", "_")
    if name in tuple(Status):
        return f"{name}: {STATUSES[Status(name)]}"
    if code.isdecimal() and int(code) in tuple(ExitCode):
        return f"exit code {int(code)}: {CODES[ExitCode(int(code))]}"
    names = [*ERRORS, *(status.value for status in Status), *(str(int(number)) for number in ExitCode)]
    raise InputError(f"there is no code '{code}': {did_you_mean(code, names, 'there are')}")
