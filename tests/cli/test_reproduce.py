"""The ledger by the command: claims judged from stored numbers, a page with figures, verdicts that can change."""

from __future__ import annotations

import csv
import errno
import fcntl
import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import pytest

from magbear_cli.errors import ExitCode

CHEAP = ["C01", "C02", "C03", "C04", "C22", "C23", "C24"]


def reproduce(output: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command."""
    line = [sys.executable, "-m", "magbear_cli", "reproduce", "-o", str(output), *arguments]
    return subprocess.run(line, capture_output=True, encoding="utf-8", check=False)


@pytest.fixture(scope="module")
def ledger(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """The cheap claims, judged once."""
    output = tmp_path_factory.mktemp("ledger")
    done = reproduce(output, *CHEAP, "--json")
    assert done.returncode == 0, done.stderr
    return output, json.loads(done.stdout)


def verdicts(document: dict[str, Any]) -> dict[str, str]:
    """The verdict of each claim."""
    return {claim["id"]: claim["verdict"] for claim in document["claims"]}


def test_claims_are_judged_and_traced(ledger: tuple[Path, dict[str, Any]]) -> None:
    """Each claim has its verdict with a reason, and names datasets that are in the results files."""
    import h5py

    output, document = ledger
    assert verdicts(document) == {
        "C01": "confirmed with erratum",
        "C02": "confirmed",
        "C03": "confirmed",
        "C04": "confirmed",
        "C22": "confirmed",
        "C23": "confirmed with erratum",
        "C24": "confirmed with erratum",
    }
    for claim in document["claims"]:
        assert claim["ours"]
        assert claim["why"]
        assert claim["evidence"]
        for path in claim["evidence"]:
            file, dataset = path.split(":")
            with h5py.File(output / file) as results:
                assert dataset.split("[")[0] in results


def test_the_page_and_its_figures_are_written(ledger: tuple[Path, dict[str, Any]]) -> None:
    """The page tells of every claim, the figures whose studies ran are drawn, and each has its numbers."""
    output, document = ledger
    page = Path(document["page"]).read_text("utf-8")
    assert all(f'id="{claim}"' in page for claim in CHEAP)
    assert "http" not in page.replace("http://www.w3.org", "")
    drawn = {path.stem for path in (output / "figures").glob("*.svg")}
    assert drawn == {"fig_2_4", "fig_2_7", "fig_4_1"}
    with (output / "tables" / "fig_2_4.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["panel"] for row in rows} == {"linear model", "nonlinear model"}
    assert max(float(row["y"]) for row in rows if row["kind"] == "value") == pytest.approx(39, rel=0.05)
    stored = json.loads((output / "ledger.json").read_text("utf-8"))
    assert stored["claims"] == document["claims"]


def test_a_changed_constant_flips_the_verdicts_that_hang_on_it(tmp_path: Path) -> None:
    """With a force constant that is 20 % larger the gains are others, and the equivalent masses are not."""
    done = reproduce(
        tmp_path,
        "C01",
        "C02",
        "C23",
        "C24",
        "--json",
        "--no-figures",
        "--set",
        "bearing.force_constant_n_m2_per_a2=4.8e-6",
    )
    assert done.returncode == 0, done.stderr
    assert verdicts(json.loads(done.stdout)) == {
        "C01": "not reproduced",
        "C02": "not reproduced",
        "C23": "confirmed with erratum",
        "C24": "not reproduced",
    }


def test_a_larger_gap_flips_the_table_of_ranges(tmp_path: Path) -> None:
    """The equivalent masses of Table 4.1 hang on the air gap."""
    done = reproduce(tmp_path, "C23", "--json", "--no-figures", "--set", "bearing.air_gap_m=480.0e-6")
    assert verdicts(json.loads(done.stdout)) == {"C23": "not reproduced"}


def test_what_is_stored_is_reused(ledger: tuple[Path, dict[str, Any]]) -> None:
    """A second run computes nothing and says the same."""
    output, document = ledger
    done = reproduce(output, *CHEAP, "--json")
    assert "nothing to compute" in done.stderr
    assert json.loads(done.stdout) == document


def test_an_unknown_claim_is_refused(tmp_path: Path) -> None:
    """With the claims that there are."""
    done = reproduce(tmp_path, "C99")
    assert done.returncode == 2
    assert done.stderr.strip() == "error: there is no claim 'C99': there are C01 to C30"
    assert not list(tmp_path.iterdir())


def test_the_ledger_is_readable_on_a_terminal(ledger: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    """Every claim with what was printed, what comes out and why, and the tally."""
    copy = shutil.copytree(ledger[0], tmp_path / "copy")  # the page tells of the claims asked for last
    done = reproduce(copy, "C23", "--no-figures")
    assert "printed: 1.4, 3.8, 9.5, 3.0, 10.5, 10.5 kg" in done.stdout
    assert "1 claims: 1 confirmed with erratum" in done.stdout


def test_a_ledger_without_locks_is_made_on_request(
    command: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the file system cannot lock, the directories are refused with 4, and used with ``--no-lock``."""

    def flock(_descriptor: int, _operation: int) -> NoReturn:
        raise OSError(errno.ENOLCK, "No locks available")

    def interrupted(*_: object) -> ExitCode:
        return ExitCode.INTERRUPTED

    monkeypatch.setattr(fcntl, "flock", flock)
    monkeypatch.setattr("magbear_cli.cli.reproduction.compute", interrupted)
    refused = command("reproduce", "C01", "-o", "ledger")
    assert (refused.code, refused.out) == (4, "")
    assert "give --no-lock" in refused.err
    done = command("reproduce", "C01", "-o", "ledger", "--no-lock")
    assert done.code == ExitCode.INTERRUPTED, done.err
    assert "cannot lock (No locks available): nothing keeps another run out" in done.err
    assert list((tmp_path / "ledger").glob("*/results.h5"))
