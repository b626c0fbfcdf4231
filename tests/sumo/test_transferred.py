"""Kept tests on other networks: rows as of any batch, replayed, continued, and from Python."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from inline import cavsumo as command
from support import rows

import cavsumo
from cavsumo.agents.programme import WalkProgramme
from cavsumo.batch.located import located
from cavsumo.batch.replay import recorded
from cavsumo.kept.transfer_form import PHASE, ZONE, relative_test
from cavsumo.results.reading import read_rows
from cavsumo.searchers.places import FROM_LEFT, FROM_RIGHT

FEW = "--places", "2", "--seeds", "1"


@pytest.fixture(scope="module")
def failed(found_failure: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, int]:
    """A folder with the results of a small batch, and its first preventable failure."""
    folder = tmp_path_factory.mktemp("failed")
    shutil.copytree(found_failure.parent, folder, dirs_exist_ok=True)
    found = (row for row in read_rows(folder / "found.csv") if row["outcome"] == "violated")
    return folder, next(int(row["run"]) for row in found if row["avoidable"] == "1")


@pytest.fixture(scope="module")
def tried(failed: tuple[Path, int], inline: None) -> Path:
    """A folder with that failure tried on two networks."""
    folder, run = failed
    nets = "--net", "crossing", "--net", "junction"
    done = command(folder, "transfer", f"found.csv:{run}", *nets, *FEW, "-o", "out.csv")
    assert done.returncode in (0, 1), done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    assert lines[0][:3] == ["test", "network", "places"]
    assert [line[:3] for line in lines[1:5]] == [
        [f"found.csv:{run}", "crossing", "2"],
        [f"found.csv:{run}", "junction", "2"],
        [f"found.csv:{run}", "all", "4"],
        ["all", "all", "4"],
    ]
    return folder


def test_every_form_at_every_place_is_an_agent(tried: Path) -> None:
    """Of one tester, on empty roads, with the ego of the test."""
    for net in ("crossing", "junction"):
        found = rows(tried / f"out-{net}.csv")
        names = [f"t1-p{k}-{form}" for k in (1, 2) for form in (ZONE, PHASE)]
        assert [row["agent"] for row in found] == names
        assert {row["testers"] for row in found} == {"1"}
        assert "error" not in {row["outcome"] for row in found}
        plan = json.loads((tried / f"out-{net}.json").read_text("utf-8"))["plan"]
        assert plan["scenario"]["net"] == net
        assert plan["scenario"]["routes"] is None


def test_a_row_is_replayed(tried: Path) -> None:
    """Bit for bit, and from nothing but the results."""
    done = command(tried, "replay", "out-junction.csv", "1")
    assert done.returncode == 0, done.stderr
    assert "the same" in done.stdout


def test_it_is_continued(tried: Path, failed: tuple[Path, int], tmp_path: Path) -> None:
    """The same command with --resume gives the same bytes."""
    folder, run = failed
    whole = (tried / "out-crossing.csv").read_bytes()
    for name in ("found.csv", "found.json"):
        shutil.copy(folder / name, tmp_path)
    shutil.copytree(folder / "found", tmp_path / "found")
    words = "transfer", f"found.csv:{run}", "--net", "crossing", *FEW, "-o", "out.csv"
    assert command(tmp_path, *words).returncode in (0, 1)
    file = tmp_path / "out-crossing.csv"
    head, first, *_ = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(head + first)
    assert command(tmp_path, *words, "--resume").returncode in (0, 1)
    assert [_without_time(line) for line in file.read_bytes().splitlines()] == [
        _without_time(line) for line in whole.splitlines()
    ]


def _without_time(line: bytes) -> bytes:
    """A row without the real time that it took, its last cell."""
    return line.rpartition(b",")[0].rpartition(b",")[0]


def test_from_python(tried: Path, failed: tuple[Path, int]) -> None:
    """The same table, and results of each batch."""
    folder, run = failed
    found = cavsumo.transfer(
        [f"{folder / 'found.csv'}:{run}"], ["crossing"], places=2, seeds=1, progress=False
    )
    (one,) = found.results.values()
    assert one.rows["outcome"].tolist() == [
        row["outcome"] for row in rows(tried / "out-crossing.csv")
    ]
    whole = found.table.set_index("test").loc["all"]
    assert (whole["places"], whole["episodes"]) == (2, 4)
    assert 0.0 <= whole["again_low"] <= whole["again"] <= whole["again_high"] <= 1.0


def test_a_test_of_a_search_is_its_programme(tmp_path: Path, inline: None) -> None:
    """Not a fit: all numbers are those that the searcher chose."""
    words = "search", "--net", "crossing", "--ego", "constant", "--runs", "20"
    assert command(tmp_path, *words, "-o", "s.csv", "--exit-zero").returncode == 0
    run = next(int(r["run"]) for r in rows(tmp_path / "s.csv") if r["outcome"] == "violated")
    record = located(recorded(tmp_path / "s.csv", run))
    form = relative_test("s", record)
    assert record.trace is not None
    (memory,) = record.trace.head["memory"]
    told = WalkProgramme(**memory["programmes"][0])
    assert form.programme == told
    assert form.whence in (FROM_LEFT, FROM_RIGHT)
    assert form.every == 0.0  # it decides in every timestep, so there is no phase
    assert form.enters is None


def test_what_cannot_be_transferred_is_said(failed: tuple[Path, int]) -> None:
    """One sentence, exit status 2, nothing written."""
    folder, _ = failed
    held = next(r["run"] for r in read_rows(folder / "found.csv") if r["outcome"] != "violated")
    before = sorted(folder.iterdir())
    done = command(folder, "transfer", f"found.csv:{held}", "--net", "crossing", "-o", "no.csv")
    assert done.returncode == 2
    assert "expected a test that a tester fails" in done.stderr
    assert sorted(folder.iterdir()) == before
