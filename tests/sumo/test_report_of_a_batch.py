"""cavsumo report of a batch that was played."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from report_files import FAILED, HELD

from cavsumo.cli import main
from cavsumo.report.analysis import analyse
from cavsumo.report.formats import FORMATS
from cavsumo.report.pages.report.scenes import scenes
from cavsumo.results.reading import read_rows
from cavsumo.results.traces import read_trace

Says = Callable[..., str]


@pytest.fixture
def says(capsys: pytest.CaptureFixture[str]) -> Says:
    """Call with the words of ``cavsumo report`` for what it prints."""

    def said(*words: str | Path) -> str:
        assert main(["report", *map(str, words)]) == 0
        found = capsys.readouterr()
        assert all(line.startswith("cavsumo: wrote ") for line in found.err.splitlines())
        return found.out

    return said


@pytest.fixture(scope="module")
def real(networks: Mapping[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small batch that was really played."""
    file = tmp_path_factory.mktemp("report") / "real.csv"
    words = ["run", "-n", str(networks["pedestrians"]), "-r", "none", "-o", str(file), "-q"]
    words += ["--agent", "proximity", "--agent", "timing", "--runs", "8", "--exit-zero"]
    assert main(words) == 0
    return file


def test_a_real_batch_in_figures(real: Path) -> None:
    """Counts, times and seconds are those of the rows; every test has a trace and so a cell."""
    report, rows = analyse([real]), read_rows(real)
    for found, time, effort, distinct in zip(
        report.rates, report.times, report.efforts, report.distinct, strict=True
    ):
        own = [row for row in rows if row["agent"] == found.agent]
        tests = [row for row in own if row["outcome"] in (HELD, FAILED)]
        assert found.tests.count == len(tests)
        assert found.tests.total == len(own) == 8
        assert time.censored == 8 - len(tests)
        assert effort.simulated_s == pytest.approx(sum(float(row["time_s"]) for row in own))
        assert effort.real_s == pytest.approx(sum(float(row["wall_s"]) for row in own))
        assert distinct.tests.known == distinct.tests.total == len(tests)
    assert sum(found.tests.count for found in report.rates) >= 4, "too few to mean anything"
    assert [c.pairs.total for c in report.comparisons] == [8, 8]


def test_a_network_by_name_and_by_path_is_one_setting(
    networks: Mapping[str, Path], routes: Mapping[str, Path], tmp_path: Path
) -> None:
    """Files are what they hold; another network is another setting."""
    given = {
        "name": ["-n", "pedestrians", "--seed", "1"],
        "path": [
            "-n",
            str(networks["pedestrians"]),
            "-r",
            str(routes["pedestrians"]),
            "--seed",
            "2",
        ],
        "other": ["-n", str(networks["crossing"]), "-r", "none"],
    }
    for name, words in given.items():
        more = ["--runs", "2", "-e", "5", "-q", "--exit-zero", "-o", str(tmp_path / f"{name}.csv")]
        assert main(["run", *words, *more]) == 0
    files = [tmp_path / f"{name}.csv" for name in given]
    report = analyse(files[:2])
    assert [(found.setting, found.tests.total) for found in report.rates] == [("", 4)]
    assert [scene.batches for scene in scenes(report.evidence.batches)] == [[0, 1]]
    assert len(analyse(files).rates) == 2


def test_what_the_traces_tell(real: Path) -> None:
    """Closing speed, side and place at the trigger, from frames parsed the long way."""
    report = analyse([real])
    rows = report.evidence.rows
    for index, test in report.tests.items():
        row = rows.loc[index]
        frames = read_trace(real.parent / row["trace"]).frames
        i = next(i for i, f in enumerate(frames) if f["time_s"] >= row["trigger_time_s"] - 1e-6)
        ego, tester = frames[i]["ego"], frames[i]["testers"][row["tester"]]
        way = [f["ego"][:2] for f in frames[: i + 1]]
        driven = sum(math.dist(a, b) for a, b in itertools.pairwise(way))
        assert test.trigger.place == pytest.approx(driven)
        assert (test.trigger.x, test.trigger.y) == tuple(tester[:2])
        assert test.trigger.speed == ego[2] - tester[2] * math.cos(tester[3] - ego[3])
        assert (test.impact is not None) == (row["outcome"] == FAILED)
        if test.impact is not None:
            assert test.impact.speed == row["impact_speed_mps"]
            assert test.impact.place >= test.trigger.place


@pytest.mark.parametrize("form", FORMATS)
def test_a_real_batch_can_be_printed(
    real: Path, says: Says, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, form: str
) -> None:
    """In every format, on the terminal or into a file; the same twice, 100 columns wide."""
    monkeypatch.chdir(real.parent)
    printed = says(real.name, "--format", form)
    assert says(real.name, "--format", form, "-o", tmp_path / "out") == ""
    assert (tmp_path / "out").read_text(encoding="utf-8") == printed
    if form == "table":
        lines = printed.splitlines()
        assert max(map(len, lines)) <= 100
        assert not any(line != line.rstrip() for line in lines)
