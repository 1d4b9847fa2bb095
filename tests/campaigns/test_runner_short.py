"""The campaigns on the runner, in short: kills, faults, damaged shards, races, fuzzed studies, plants, many cases."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (["kills.py", "--kills", "6", "--cases", "12", "--seed", "5"], "finished cases lost: 0"),
        (["faults.py", "--rotate"], "not as it should be: 0"),
        (["bits.py", "--times", "200", "--cases", "20"], "not detected, or taken for another case's: 0"),
        (["races.py", "--times", "4", "--cases", "10"], "not as it should be: 0"),
        (["soak.py", "--cases", "400"], "temporary files left: 0"),
        (["fuzz.py", "--texts", "1500", "--commands", "6"], "not as it should be: 0"),
        (["zoo.py", "--plants", "10", "--limit", "4", "--kernel-limit", "1"], "not as it should be: 0"),
    ],
    ids=lambda value: value[0].removesuffix(".py") if isinstance(value, list) else "",
)
def test_a_campaign_in_short_finds_nothing(line: list[str], says: str) -> None:
    """What the long form asks two hundred or two thousand times holds a few times too."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "QUICK_FIGURES": "0"}
    command = [sys.executable, str(HERE / line[0]), *line[1:]]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert says in done.stdout
