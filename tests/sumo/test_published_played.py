"""Published scenarios played in SUMO: tracks, replays, variations, and refusals of the command."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from inline import cavsumo as command
from published_tracks import (
    AHEAD,
    BICYCLIST,
    SCENARIOS,
    WALKER,
    Reference,
    differences,
    references,
    states,
)
from support import rows

import cavsumo
from cavsumo.openscenario.reading import ScenarioSource, read_scenario
from cavsumo.results.traces import read_trace

# A slow and a fast case of each scenario; tests/unit/test_published_scenarios.py has all of them.
CASES = {
    "CPNA/StandardRange/0", "CPNA/StandardRange/32", "CPFA/StandardRange/4",
    "CPNCO/StandardRange/10", "CPLA/StandardRange/2", "CBLA/StandardRange/0",
    "CBNA/StandardRange/0", "CBNA/StandardRange/11",
}  # fmt: skip
PLAYED = [case for case in references() if case.id in CASES]


def test_the_cases_are_there() -> None:
    """None of them is missing in the reference tracks."""
    assert {case.id for case in PLAYED} == CASES


@pytest.mark.parametrize("case", [pytest.param(case, id=case.id) for case in PLAYED])
def test_a_target_is_where_the_reference_track_has_it(tmp_path: Path, case: Reference) -> None:
    """Within 0.02 m and 0.02 m/s, before an ego that keeps its speed; and it is hit."""
    found = cavsumo.run(
        scenario=case.file,
        scenario_params=case.values,
        ego="constant",
        trace="all",
        output=tmp_path / "results.csv",
        progress=False,
    )
    (row,) = found.rows.to_dict("records")
    assert (row["outcome"], row["tester"]) == ("violated", "tester0")
    assert row["case"] == case.file.stem
    frames = read_trace(tmp_path / row["trace"]).frames
    played = [
        (frame["time_s"], _state(frame["ego"]), _state(frame["testers"]["tester0"]))
        for frame in frames
    ]
    place, speed = differences(case.rows, played)
    assert place < 0.02
    assert speed < 0.02


def _state(given: list[float]) -> tuple[float, float, float, float]:
    """A state of a trace as one of a track."""
    x, y, v, o = given
    return x, y, o, v


def test_the_road_of_the_file_is_played_and_replayed_without_it(tmp_path: Path) -> None:
    """netconvert's network is kept with the results; a replay needs nothing else."""
    file = tmp_path / "results.csv"
    path = SCENARIOS / BICYCLIST
    done = command(
        tmp_path,
        "run",
        "--scenario",
        str(path),
        "--ego",
        "time-gap",
        "-o",
        str(file),
        "--trace",
        "all",
    )
    assert done.returncode in (0, 1), done.stderr
    (row,) = rows(file)
    assert row["outcome"] in ("held", "violated")
    plan = json.loads(file.with_suffix(".json").read_text("utf-8"))["plan"]["scenario"]
    assert plan["net"] == str(SCENARIOS / "crossing.xodr")
    assert plan["ego_route"] == ["-west", "-east"]
    again = command(tmp_path, "replay", str(file), "0")
    assert again.returncode == 0, again.stderr
    assert "the same" in again.stdout


def test_a_stop_trigger_ends_a_playback_where_it_ended_the_episode(tmp_path: Path) -> None:
    """Same verdict and same time, played anew and played back."""
    file = tmp_path / "results.csv"
    words = ("--scenario", str(SCENARIOS / BICYCLIST), "--ego", "time-gap", "--trace", "all")
    done = command(tmp_path, "run", *words, "-o", str(file))
    assert done.returncode == 0, done.stderr
    (row,) = rows(file)
    assert row["outcome"] == "held"
    assert float(row["time_s"]) < 20.0  # the horizon is at 60 s
    for way in ([], ["--playback"]):
        again = command(tmp_path, "replay", str(file), "0", *way)
        assert again.returncode == 0, again.stderr
        assert "the same" in again.stdout


def test_a_body_that_leaves_its_way_is_where_a_rehearsal_has_it(tmp_path: Path) -> None:
    """Within 0.01 m, on both arcs of its lane change too; the box in front keeps its gap."""
    script = cavsumo.run(
        scenario=SCENARIOS / "overtaker.xosc",
        ego="constant",
        trace="all",
        output=tmp_path / "results.csv",
        progress=False,
    )
    (row,) = script.rows.to_dict("records")
    made = read_scenario(ScenarioSource(SCENARIOS / "overtaker.xosc", {}))
    trace, expected = read_trace(tmp_path / row["trace"]), states(made)
    assert trace.frames[-1]["time_s"] > 5.0
    for frame, (time, bodies) in zip(trace.frames, expected, strict=False):
        assert frame["time_s"] == pytest.approx(time)
        for name, (x, y, *_) in frame["testers"].items():
            assert math.dist((x, y), bodies[name][1:3]) < 0.01


def test_a_straight_road_is_laid_where_the_file_has_none(tmp_path: Path) -> None:
    """And that is said."""
    file = tmp_path / "results.csv"
    done = command(tmp_path, "run", "--scenario", str(SCENARIOS / WALKER), "-o", str(file))
    assert "names no OpenDRIVE: played on a straight proving road" in done.stderr
    assert done.returncode == 0
    assert rows(file)[0]["outcome"] == "held"


def test_variations_are_played_as_batches(tmp_path: Path) -> None:
    """A results file for each combination."""
    file = tmp_path / "cbna.csv"
    path = SCENARIOS / "bicyclist-variations.xosc"
    done = command(
        tmp_path, "run", "--scenario", str(path), "--ego", "constant", "-o", str(file), "-q"
    )
    assert done.returncode == 1, done.stderr
    found = sorted(tmp_path.glob("*.csv"))
    assert [one.name for one in found] == [
        f"cbna-ego_kmh{speed}-impact_percent{share}.csv" for speed in (40, 50) for share in (50, 75)
    ]
    speeds = [float(rows(one)[0]["ego_speed_mps"]) for one in found]
    assert speeds == pytest.approx([40 / 3.6, 40 / 3.6, 50 / 3.6, 50 / 3.6], abs=1e-3)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--scenario", "no.xosc"), "scenario 'no.xosc': cannot be read"),
        (("--scenario-param", "a=1"), "--scenario-param: needs --scenario FILE"),
        (("--scenario", str(SCENARIOS / AHEAD), "--testers", "2"), "testers: "),
        (("--scenario", str(SCENARIOS / AHEAD), "--net", "crossing"), "net: "),
        (
            ("--scenario", str(SCENARIOS / AHEAD), "--scenario-ego", "Egon"),
            "unknown entity 'Egon'; did you mean 'Ego'?",
        ),
        (
            ("--scenario", str(SCENARIOS / AHEAD), "--scenario-param", "who=tram"),
            "unknown entry of catalog 'bodies' 'tram'",
        ),
    ],
    ids=["file", "alone", "testers", "net", "ego", "entry"],
)
def test_what_is_wrong_is_said_and_nothing_is_written(
    tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    """One sentence, exit status 2."""
    done = command(tmp_path, "run", *words, "-o", "results.csv")
    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())
