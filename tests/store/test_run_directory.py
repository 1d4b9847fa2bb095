"""What was kept is found again, whatever happened in between; what cannot be trusted is computed again and named."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import namedtuple
from collections.abc import Callable
from pathlib import Path

import pytest

from magbear_cli.errors import ResumableError, Status
from magbear_cli.store.run_directory import RunDirectory
from magbear_cli.store.shards import DamagedShardError, read_head, read_shard, take_inventory, write_shard
from magbear_cli.store.toolchain import Toolchain, this_toolchain
from magbear_cli.study.outcome import CaseOutcome
from magbear_cli.study.plan import Case

FullCase = Callable[[int], CaseOutcome]
Same = Callable[[object, object], bool]


def case_of(outcome: CaseOutcome) -> Case:
    """The case that ended so."""
    return Case(outcome.case_id, outcome.index, outcome.inputs)


def shards_in(path: Path) -> list[Path]:
    """The shards of a run directory."""
    return sorted(path.glob("cases/*/*.case"))


@pytest.fixture
def outcomes(full_case: FullCase) -> tuple[CaseOutcome, ...]:
    """Four finished cases."""
    return tuple(full_case(index) for index in range(4))


@pytest.fixture
def cases(outcomes: tuple[CaseOutcome, ...]) -> tuple[Case, ...]:
    """The same before they were computed."""
    return tuple(map(case_of, outcomes))


@pytest.fixture
def filled(tmp_path: Path, outcomes: tuple[CaseOutcome, ...], toolchain: Toolchain) -> Path:
    """A run directory in which all four were kept."""
    path = tmp_path / "out"
    with RunDirectory(path, "magbear: 1\r\n", toolchain) as directory:
        for outcome in outcomes:
            directory.keep(outcome)
    return path


def test_what_was_kept_is_not_missing(
    filled: Path, cases: tuple[Case, ...], outcomes: tuple[CaseOutcome, ...], toolchain: Toolchain, are_same: Same
) -> None:
    """Opening again finds every case, exactly, wherever it stands in the edited study; the study is kept verbatim."""
    assert (filled / "study.yaml").read_bytes() == b"magbear: 1\r\n"
    with RunDirectory(filled, "magbear: 1 # edited", toolchain) as directory:
        assert directory.missing(cases) == ()
        assert are_same(tuple(directory.outcomes(cases)), outcomes)
        moved = [Case(case.id, 7 - case.index, case.inputs) for case in reversed(cases)]
        assert [outcome.index for outcome in directory.gather(moved, "n", {}).outcomes] == [4, 5, 6, 7]
        new = Case("0" * 16, 4, {"mass_kg": 1.0})
        assert directory.missing([*cases, new]) == (new,)
        assert directory.notes == []
    assert (filled / "study.yaml").read_text() == "magbear: 1 # edited"


def test_results_do_not_depend_on_the_order_of_ending(
    filled: Path, tmp_path: Path, cases: tuple[Case, ...], outcomes: tuple[CaseOutcome, ...], toolchain: Toolchain
) -> None:
    """Two directories filled in opposite orders give the same bytes of results, and the same shards."""
    other = tmp_path / "other"
    with RunDirectory(other, "magbear: 1\r\n", toolchain) as directory:
        for outcome in reversed(outcomes):
            directory.keep(outcome)
    for path in (filled, other):
        with RunDirectory(path, "magbear: 1\r\n", toolchain) as directory:
            directory.gather(cases, "n", {})
    assert (filled / "results.h5").read_bytes() == (other / "results.h5").read_bytes()
    assert [path.name for path in shards_in(filled)] == [path.name for path in shards_in(other)]


@pytest.mark.parametrize("status", [Status.TIMEOUT, Status.CRASHED, Status.FAILED])
def test_failures_are_kept_for_the_report_and_tried_again(
    status: Status, tmp_path: Path, outcomes: tuple[CaseOutcome, ...], toolchain: Toolchain
) -> None:
    """A case without an answer is stored, is missing in the next run, and its shard goes when an answer comes."""
    failed = CaseOutcome(outcomes[0].case_id, 0, outcomes[0].inputs, status, "why")
    case = case_of(failed)
    with RunDirectory(tmp_path, "", toolchain) as directory:
        directory.keep(failed)
        assert next(directory.outcomes([case])).sentence == "why"
        assert directory.missing([case]) == (case,)
        assert f"ended as {status.value} before" in directory.notes[0]
        directory.keep(outcomes[0])
        assert directory.missing([case]) == ()
    assert len(shards_in(tmp_path)) == 1


@pytest.mark.parametrize("status", [Status.INFEASIBLE, Status.NOT_ACHIEVED, Status.UNVERIFIED, Status.UNSTABLE])
def test_answers_are_not_computed_again(
    status: Status, tmp_path: Path, outcomes: tuple[CaseOutcome, ...], toolchain: Toolchain
) -> None:
    """An answer that disappoints is an answer."""
    with RunDirectory(tmp_path, "", toolchain) as directory:
        directory.keep(dataclasses.replace(outcomes[0], status=status))
        assert directory.missing([case_of(outcomes[0])]) == ()


def test_another_toolchain_is_named_and_not_mixed(
    filled: Path, cases: tuple[Case, ...], outcomes: tuple[CaseOutcome, ...]
) -> None:
    """Cases of other versions are missing and not in the results until they are computed again."""
    newer = Toolchain({"magbear": "1.0", "numpy": "2.1"})
    with RunDirectory(filled, "", newer) as directory:
        assert directory.missing(cases) == cases
        assert "numpy 2.0 -> 2.1" in directory.notes[0]
        assert "4 cases" in directory.notes[0]
        directory.keep(outcomes[1])
        assert [outcome.index for outcome in directory.outcomes(cases)] == [1]
    assert len(shards_in(filled)) == 4


def test_another_toolchain_is_taken_when_asked_and_named_in_the_results(
    filled: Path, tmp_path: Path, cases: tuple[Case, ...], outcomes: tuple[CaseOutcome, ...]
) -> None:
    """With mixing accepted nothing is missing, what is computed here goes first, and the results say what is whose."""
    newer = Toolchain({"magbear": "1.0", "numpy": "2.1"})
    with RunDirectory(filled, "", newer) as directory:
        assert "--accept-mixed" in (directory.missing(cases), directory.notes)[1][0]
        directory.keep(outcomes[1])
    merged = tmp_path / "merged"
    with (
        RunDirectory(filled, "", newer, accept_mixed=True) as part,
        RunDirectory(merged, "", newer, accept_mixed=True) as directory,
    ):
        assert [case.index for case in part.missing(cases)] == []
    with (
        RunDirectory(tmp_path / "old", "", Toolchain({"magbear": "1.0", "numpy": "2.0"})) as old,
        RunDirectory(merged, "", newer, accept_mixed=True) as directory,
    ):
        old.keep(outcomes[0])
        directory.keep(outcomes[1])
        directory.adopt(old, cases)
        assert directory.missing(cases[:2]) == ()
        results = directory.gather(cases[:2], "n", {})
        assert results.provenance["computed_by_other_toolchains"] == "1 case: numpy 2.0 -> 2.1"
    with RunDirectory(merged, "", newer) as strict:
        assert strict.missing(cases[:2]) == (cases[0],)
        assert "computed_by_other_toolchains" not in strict.gather(cases[:2], "n", {}).provenance


def test_this_toolchain_is_the_same_in_another_process() -> None:
    """The fingerprint does not depend on what happens to be imported."""
    script = "import scipy.linalg; from magbear_cli.store.toolchain import *; print(this_toolchain().fingerprint)"
    told = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert told.stdout.strip() == this_toolchain().fingerprint
    assert Toolchain.of_text(this_toolchain().text) == this_toolchain()


def test_damage_to_a_shard_is_detected(filled: Path, cases: tuple[Case, ...]) -> None:
    """200 flipped bits and 40 truncations anywhere: each is noticed, none passes for a number."""
    draw = random.Random(3)  # noqa: S311 - which bits does not matter
    shard = take_inventory(filled / "cases").paths[cases[0].id][0]
    content = shard.read_bytes()
    for trial in range(240):
        place = draw.randrange(8 * len(content))
        damaged = bytearray(content)
        if trial < 200:
            damaged[place // 8] ^= 1 << place % 8
        else:
            del damaged[place // 8 :]
        shard.write_bytes(damaged)
        with pytest.raises(DamagedShardError):
            read_head(shard)
        with pytest.raises(DamagedShardError):
            read_shard(shard, cases[0])


def test_a_damaged_case_is_computed_again(
    filled: Path, cases: tuple[Case, ...], outcomes: tuple[CaseOutcome, ...], toolchain: Toolchain
) -> None:
    """Damage makes a case missing, with a note; keeping it anew repairs the file."""
    shard = take_inventory(filled / "cases").paths[cases[2].id][0]
    content = bytearray(shard.read_bytes())
    content[-100] ^= 1
    shard.write_bytes(content)
    with RunDirectory(filled, "", toolchain) as directory:
        assert directory.missing(cases) == (cases[2],)
        assert "damaged" in directory.notes[0]
        directory.keep(outcomes[2])
        assert directory.missing(cases) == ()


def test_strange_files_are_left_alone_and_leftovers_removed(
    filled: Path, cases: tuple[Case, ...], toolchain: Toolchain
) -> None:
    """Temporary files of killed writers go; swapped, foreign and renamed files are not taken for cases."""
    first, second = shards_in(filled)[:2]
    (first.parent / ".tmp-x.h5").write_bytes(b"half")
    (filled / ".tmp-results.h5").write_bytes(b"half")
    (first.parent / "notes.txt").write_text("mine")
    swapped, kept = first.read_bytes(), second.read_bytes()
    first.write_bytes(kept)
    second.write_bytes(swapped)
    with RunDirectory(filled, "", toolchain) as directory:
        assert len(directory.missing(cases)) == 2
        assert any("removed 1 unfinished" in note for note in directory.notes)
        assert any("left alone 1 files" in note for note in directory.notes)
    assert (first.parent / "notes.txt").read_text() == "mine"
    assert not list(filled.rglob(".tmp-*"))


def test_a_shard_of_another_case_under_this_name_is_refused(
    tmp_path: Path, outcomes: tuple[CaseOutcome, ...], toolchain: Toolchain
) -> None:
    """Even a matching digest does not make one case pass for another."""
    path = write_shard(tmp_path, outcomes[0], toolchain)
    other = path.with_name(path.name.replace(outcomes[0].case_id, outcomes[1].case_id))
    shutil.copy(path, other)
    with pytest.raises(DamagedShardError, match="another case"):
        read_shard(other, case_of(outcomes[1]))


def test_one_of_two_runs_wins(tmp_path: Path, toolchain: Toolchain) -> None:
    """While one process holds the directory another one is told who does; after it died, however, it is free."""
    script = (
        "import sys, time, pathlib; from magbear_cli.store.run_directory import RunDirectory\n"
        "directory = RunDirectory(pathlib.Path(sys.argv[1]), ''); print('held', flush=True); time.sleep(60)"
    )
    holder = subprocess.Popen([sys.executable, "-c", script, tmp_path], stdout=subprocess.PIPE)
    assert holder.stdout is not None
    assert holder.stdout.readline() == b"held\n"
    with pytest.raises(ResumableError, match=f"process {holder.pid} on "):
        RunDirectory(tmp_path, "", toolchain)
    holder.kill()
    holder.wait()
    holder.stdout.close()
    RunDirectory(tmp_path, "", toolchain)._lock.release()


def test_a_disk_too_small_is_told_before_the_run(
    tmp_path: Path, toolchain: Toolchain, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The space for the missing cases is looked for at the start, and named in MB."""
    usage = namedtuple("usage", "total used free")  # noqa: PYI024 - as shutil gives it
    with RunDirectory(tmp_path, "", toolchain) as directory:
        directory.reserve(10)
        monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(10, 10, 5_000_000))
        with pytest.raises(ResumableError, match="100 MB are needed for 100 cases and 5 MB are free"):
            directory.reserve(100)


def test_a_disk_that_is_really_full_loses_no_kept_case(
    mounted: Callable[[str], Path], tmp_path: Path, full_case: FullCase, toolchain: Toolchain
) -> None:
    """Cases are refused in a sentence when there is no room, those before stay, and with room the run goes on."""
    outcomes = [full_case(index) for index in range(12)]
    cases = [case_of(outcome) for outcome in outcomes]
    folder = mounted("size=600k")

    def keep_all(directory: RunDirectory) -> None:
        for outcome in outcomes:
            directory.keep(outcome)

    with RunDirectory(folder / "out", "", toolchain) as directory, pytest.raises(ResumableError, match="no space is"):
        keep_all(directory)
    kept = len(shards_in(folder / "out"))
    assert 1 <= kept < 12
    subprocess.run(["mount", "-o", "remount,size=16m", folder], check=True)
    with RunDirectory(folder / "out", "", toolchain) as directory:
        missing = directory.missing(cases)
        assert len(missing) == 12 - kept
        for case in missing:
            directory.keep(outcomes[case.index])
        directory.gather(cases, "n", {})
        whole = directory.results_path.read_bytes()
    with RunDirectory(tmp_path / "calm", "", toolchain) as directory:
        keep_all(directory)
        directory.gather(cases, "n", {})
        assert directory.results_path.read_bytes() == whole


def test_a_full_disk_at_the_end_of_a_run_spares_the_process(
    mounted: Callable[[str], Path], full_case: FullCase, toolchain: Toolchain
) -> None:
    """HDF5 does not survive a full disk; a results file that does not fit is a sentence, and the old one stands."""
    outcomes = [full_case(index) for index in range(4)]
    cases = [case_of(outcome) for outcome in outcomes]
    folder = mounted("size=4m")
    with RunDirectory(folder / "out", "", toolchain) as directory:
        for outcome in outcomes:
            directory.keep(outcome)
        directory.gather(cases[:1], "n", {})
        old = directory.results_path.read_bytes()
        free = shutil.disk_usage(folder).free
        (folder / "filler").write_bytes(bytes(free - 100_000))
        with pytest.raises(ResumableError, match="no space is left"):
            directory.gather(cases, "n", {})
        assert directory.results_path.read_bytes() == old
        assert not list(folder.rglob(".tmp-*"))
        (folder / "filler").unlink()
        assert len(directory.gather(cases, "n", {}).outcomes) == 4


def test_the_log_survives_a_torn_line(tmp_path: Path, toolchain: Toolchain) -> None:
    """A line cut off by a kill does not spoil the next one."""
    with RunDirectory(tmp_path, "", toolchain) as directory:
        directory.log("start", cases=3)
        with directory.log_path.open("ab") as file:
            file.write(b'{"time": 1')
        directory.log("end", path=tmp_path)
    lines = (tmp_path / "log.jsonl").read_text().splitlines()
    assert [json.loads(line)["event"] for line in (lines[0], lines[2])] == ["start", "end"]


CAMPAIGN = """
import sys, pathlib
from magbear_cli.store.run_directory import RunDirectory
from magbear_cli.store.toolchain import Toolchain
from magbear_cli.study.events import CaseEnded, CaseStarted
from magbear_cli.study.plan import plan_cases
from magbear_cli.study.runner import RunnerOptions, run_cases
cases = plan_cases({"controller": {"method": "x"}, "mass_kg": 1.0 + n} for n in range(16))
options = RunnerOptions(jobs=2, target="small_target:answer", warm_modules=())
with RunDirectory(pathlib.Path(sys.argv[1]), "magbear: 1", Toolchain({"magbear": "1"})) as directory:
    for event in run_cases(directory.missing(cases), options):
        if isinstance(event, CaseStarted):
            print("worker", event.pid, event.attempt, flush=True)
        if isinstance(event, CaseEnded):
            directory.keep(event.outcome)
            print("kept", event.outcome.case_id, event.outcome.status.value, flush=True)
    directory.gather(cases, "campaign", {})
"""

TARGET = """
import time
from magbear_cli.errors import Status
from magbear_cli.study.outcome import CaseOutcome, Summary
def answer(inputs, case_id, index):
    time.sleep(0.01)
    return CaseOutcome(case_id, index, inputs, Status.OK, summary=Summary(level=inputs["mass_kg"] / 3))
"""


class Campaign:
    """Runs of the same small study that are killed, and what they acknowledged before."""

    def __init__(self, target_folder: Path) -> None:
        self.environment = {**os.environ, "PYTHONPATH": str(target_folder)}
        self.draw = random.Random(11)  # noqa: S311 - when does not matter
        self.acknowledged: set[str] = set()
        self.kills = 0

    def run(self, folder: Path, victim: str) -> bool:
        """Run in this folder, kill the victim (workers: up to four) at random instants; whether it came to its end."""
        command: list[str | Path] = [sys.executable, "-c", CAMPAIGN, folder]
        due = self.draw.randrange(20)
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=self.environment) as parent:
            assert parent.stdout is not None
            for number, line in enumerate(parent.stdout):
                words = line.split()
                if words[0] == "kept" and words[2] == "ok":
                    self.acknowledged.add(words[1])
                if number == due and victim == "parent":
                    time.sleep(self.draw.random() * 0.02)
                    parent.send_signal(signal.SIGKILL)
                    self.kills += 1
                elif number >= due and victim == "worker" and words[0] == "worker" and words[2] == "1":
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(int(words[1]), signal.SIGKILL)
                        self.kills += 1
                    due = number + 7
        return parent.returncode == 0


def test_kills_at_random_instants_lose_no_finished_case(tmp_path: Path) -> None:
    """20 kills of parents and workers: what was acknowledged is there, and the final bytes are those of a calm run."""
    (tmp_path / "small_target.py").write_text(TARGET)
    campaign = Campaign(tmp_path)
    assert campaign.run(tmp_path / "calm", "nobody")
    calm = (tmp_path / "calm" / "results.h5").read_bytes()
    while campaign.kills < 20:
        campaign.acknowledged.clear()
        folder = tmp_path / f"run{campaign.kills}"
        while not campaign.run(folder, campaign.draw.choice(["parent", "worker", "worker"])):
            assert campaign.acknowledged <= {path.name[:16] for path in shards_in(folder)}
        assert (folder / "results.h5").read_bytes() == calm
        assert len(shards_in(folder)) == 16
