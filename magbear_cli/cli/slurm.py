"""``magbear slurm``: the batch script that computes a study in parts on a cluster."""

from __future__ import annotations

from pathlib import Path

import click

from magbear_cli.cli.options import STUDY, overrides


@click.command()
@click.argument("study", type=STUDY)
@click.option(
    "--shards", type=click.IntRange(min=1), default=8, show_default=True, metavar="N", help="Parts, one a job."
)
@click.option(
    "--cpus", type=click.IntRange(min=1), default=4, show_default=True, metavar="N", help="Cores of each job."
)
@click.option("--time", "limit", default="24:00:00", show_default=True, metavar="HH:MM:SS", help="Limit of each job.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Directory of the runs.  [default: out/STUDY_NAME]"
)
@overrides
def slurm(study: Path, shards: int, cpus: int, limit: str, output: Path | None, overrides: tuple[str, ...]) -> None:
    """Print the SLURM script that computes a STUDY in parts.

    One array job a part, each into a directory of its own; a job that is requeued goes on where it stopped. The script
    ends with the command that merges the parts.

    \b
    Example:  magbear slurm study.yaml --shards 16 > study.sbatch && sbatch study.sbatch
    """
    import re
    import shlex

    from magbear_cli.cli.output import put
    from magbear_cli.cli.session import default_output
    from magbear_cli.errors import InputError
    from magbear_cli.spec import read_study

    if not re.fullmatch(r"(\d+-)?\d{1,3}(:\d{2}){0,2}", limit):
        raise InputError(f"--time {limit}: this is no time limit of SLURM; write HH:MM:SS, or DAYS-HH:MM:SS")
    read = read_study(study, overrides)
    parts = min(shards, read.case_count)
    folder = default_output(read.name) if output is None else output
    given = "".join(f"--set {shlex.quote(item)} " for item in overrides)
    part = f'{shlex.quote(str(folder))}-"$SLURM_ARRAY_TASK_ID"-of-{parts}'
    every = " ".join(f"{shlex.quote(f'{folder}-{number}-of-{parts}')}" for number in range(parts))
    lines = [
        "#!/bin/bash",
        f"#SBATCH --job-name={read.name}",
        f"#SBATCH --array=0-{parts - 1}",
        f"#SBATCH --cpus-per-task={cpus}",
        f"#SBATCH --time={limit}",
        "#SBATCH --requeue",
        "#SBATCH --signal=B:TERM@120",  # two minutes before the limit: stop, keep what is finished, write results
        f"# {read.case_count} cases in {parts} parts",
        "set -euo pipefail",
        "export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1",
        f"exec magbear run {shlex.quote(str(study))} {given}--no-progress \\",
        f'    --shard "$SLURM_ARRAY_TASK_ID"/{parts} --jobs "$SLURM_CPUS_PER_TASK" -o {part}',
        "# after all parts have ended (a part that was stopped by its limit goes on when it is submitted again):",
        f"# magbear merge {every} -o {shlex.quote(str(folder))}",
    ]
    put("\n".join(lines))
