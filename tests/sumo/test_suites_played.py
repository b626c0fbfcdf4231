"""Suites played: the targets are where the reference tracks have them, and rows are ordinary."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from inline import cavsumo as command
from support import benchmark, rows

import cavsumo
from cavsumo.egos import Acceleration, Drive
from cavsumo.model.crosswalk import CrosswalkStart, failures, normals, walked
from cavsumo.results.trace_file import read_trace_text

NAME = "euroncap-2026"
TRACKS = benchmark("reference_tracks")
REFERENCES = TRACKS.reference_tracks()
# One slow and one fast cell of each kind; benchmarks/reference_tracks.py plays all.
CELLS = (
    *("CPNA/10/75", "CPNA/60/25", "CPFA/30/50", "CPNCO/50/50", "CPLA/10/50", "CPLA/60/50"),
    *("CBNA/20/50", "CBNAO/60/75", "CBNAO/10/50", "CBFA/60/25", "CBLA/20/50"),
    *("CCRs/10/0", "CCRs/50/75", "CCFtap/10/45", "CCFtap/20/60", "CCFhos/30/50/75"),
)


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> cavsumo.Results:
    """Some cells with an ego that keeps its speed."""
    file = tmp_path_factory.mktemp("suite") / "results.csv"
    how: dict[str, Any] = {"output": file, "trace": "all", "progress": False}
    return cavsumo.suite(NAME, "constant", only=CELLS, **how)


@pytest.mark.parametrize("case", CELLS)
def test_a_target_is_where_the_reference_track_has_it(played: cavsumo.Results, case: str) -> None:
    """Within 5 cm and 0.05 m/s at gaps of 20, 10, 5 and 2 m and at contact."""
    row = played.rows.set_index("case").loc[case]
    track = TRACKS.played_track(played.file.parent / row["trace"])
    found = list(TRACKS.compared(case, track, REFERENCES[case]))
    assert len(found) >= 3
    for gap, place, speed in found:
        assert place < 0.05, gap
        assert speed < 0.05, gap


def test_every_case_is_an_ordinary_row(played: cavsumo.Results) -> None:
    """Violated by an ego that never brakes, with its case and parameters."""
    table = played.rows
    assert sorted(table["case"]) == sorted(CELLS)
    assert set(table["outcome"]) == {"violated"}
    assert set(table["tester"]) == {"tester0"}
    first = table[table["case"] == "CPNA/10/75"].iloc[0]
    said = "test=CPNA ego_kmh=10 impact_percent=75 target_kmh=5 turn_deg=0 start_m=4 variation=0"
    assert first["parameters"] == said
    assert first["ego_speed_mps"] == pytest.approx(10 / 3.6, abs=1e-3)


def test_a_case_is_replayed_from_its_results_and_from_its_trace(played: cavsumo.Results) -> None:
    """Bit for bit; the trace alone is enough."""
    played.replay(2)
    played.replay(2, playback=True)
    done = command(played.file.parent, "replay", str(played.file), "2")
    assert (done.returncode, "sha256" in done.stderr) == (0, False)
    trace = played.file.parent / played.rows["trace"].iloc[2]
    done = command(played.file.parent, "replay", str(trace))
    assert (done.returncode, "the same" in done.stdout) == (0, True)


def test_a_suite_goes_on_where_it_was_cut_off(tmp_path: Path) -> None:
    """The same bytes as in one go; more variations add rows and change none."""
    words = ["suite", NAME, "--ego", "time-gap", "--only", "CPFA/20/50,CPFA/60/50", "-q"]
    words += ["--exit-zero", "--trace", "none"]
    command(tmp_path, *words, "--vary", "2", "-o", "whole.csv")
    command(tmp_path, *words, "--vary", "1", "--shard", "1/2", "-o", "half.csv")
    command(tmp_path, *words, "--vary", "1", "-o", "short.csv")
    whole = rows(tmp_path / "whole.csv")
    assert len(whole) == 6
    assert rows(tmp_path / "short.csv") == whole[:4]
    assert rows(tmp_path / "half.csv") == whole[0:4:2]
    text = (tmp_path / "whole.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (tmp_path / "whole.csv").write_text("".join(text[:4]), encoding="utf-8")
    done = command(tmp_path, *words, "--vary", "2", "-o", "whole.csv", "--resume")
    assert done.returncode == 0
    assert rows(tmp_path / "whole.csv") == whole


class Brakes:
    """Brakes as soon as it sees a pedestrian within a distance."""

    def __init__(self, within_m: float = 30.0) -> None:
        self.within_m = within_m

    def act(self, snapshot: Any) -> Acceleration:
        walking = [body for body in snapshot.testers if body.body.kind.name == "pedestrian"]
        near = any(abs(body.x - snapshot.ego.x) < self.within_m for body in walking)
        return Acceleration(-8.0 if near else 0.0)


def test_a_car_that_cuts_in_has_its_gap_and_its_lateral_speed(tmp_path: Path) -> None:
    """When it has it, and afterwards it is in the ego's lane; the case says what is preventable."""
    how: dict[str, Any] = {"trace": "all", "progress": False, "output": tmp_path / "a.csv"}
    cut_in = cavsumo.suite("un-r157", "constant", only="cut-in/50/20/25/1.5", **how)
    track = TRACKS.played_track(tmp_path / "a" / "run000000.jsonl.gz")
    ego, other = next(pair for pair in track.states if pair[0][0] >= 3.0 - 1e-9)
    assert other[1] - ego[1] - 4.3 == pytest.approx(25.0, abs=0.02)
    after = [pair[1] for pair in track.states if 3.1 < pair[0][0] < 4.0]
    assert after[5][2] - after[0][2] == pytest.approx(5 * 0.1 * 1.5, abs=0.01)
    assert track.states[-1][1][2] == pytest.approx(-1.75, abs=0.05)
    assert cut_in.cases["preventable"].tolist() == [1]


def test_the_crosswalk_is_played_as_its_model_computes_it(tmp_path: Path) -> None:
    """The pedestrian is at each place of the model, and the same draws fail."""
    draws, start = range(1, 31), CrosswalkStart(-4.0, 0.75)
    how: dict[str, Any] = {"only": [f"start-1/{draw}" for draw in draws], "progress": False}
    how |= {"values": {"walk_mps": 0.75}, "trace": "all", "output": tmp_path / "a.csv"}
    played = cavsumo.suite("ast-crosswalk", "crosswalk", **how)
    failed = [bool(failures(start, normals(draw))[0]) for draw in draws]
    assert (played.rows["outcome"] == "violated").tolist() == failed
    assert 0 < sum(failed) < len(failed)
    pushes = normals(1)[0, :, :2] * (0.1**0.5, 0.1)
    track = TRACKS.played_track(tmp_path / "a" / "run000000.jsonl.gz").states
    for (_, state), (x, y) in zip(track, walked(start, pushes), strict=False):
        assert state[1:3] == pytest.approx((x, y - 1.75), abs=1e-3)


def test_a_driver_that_decides_once_a_second_keeps_the_speed_with_which_it_entered() -> None:
    """Also where the test begins at once, less than four seconds before the disturbance."""
    how: dict[str, Any] = {"only": "cut-in/30/20/21/1.6", "trace": "none", "progress": False}
    (row,) = cavsumo.suite("un-r157", "sumo", **how).rows.to_dict("records")
    assert row["outcome"] == "held", row["error"]


def test_the_target_commits_once(tmp_path: Path) -> None:
    """It walks on as it began, although the ego brakes."""
    how: dict[str, Any] = {"only": "CPFA/30/50", "trace": "all", "progress": False}
    cavsumo.suite(NAME, "constant", output=tmp_path / "a.csv", **how)
    brakes = cavsumo.suite(NAME, Brakes(20.0), output=tmp_path / "b.csv", **how)
    assert list(brakes.rows["outcome"]) == ["held"]
    tracks = [TRACKS.played_track(tmp_path / one / "run000000.jsonl.gz") for one in "ab"]
    targets = [[target for _, target in track.states] for track in tracks]
    assert targets[1][: len(targets[0])] == targets[0]


def test_a_controller_is_held_at_the_speed_until_the_test_begins(tmp_path: Path) -> None:
    """Four seconds before the contact; it would have given way to the car ahead before that."""
    how: dict[str, Any] = {"only": ["CCRm/30/20/100", "CCRb/50/0"], "progress": False}
    how |= {"trace": "all"}
    played = cavsumo.suite(NAME, "time-gap", output=tmp_path / "a.csv", **how)
    assert list(played.rows["outcome"]) == ["held", "held"]
    lines = read_trace_text(tmp_path / "a" / "run000000.jsonl.gz").splitlines()[1:]
    speeds = [json.loads(line)["ego"][2] for line in lines]
    before = round((6.0 - 4.0) / 0.02)  # lead_s - FOUR_S
    assert speeds[: before + 1] == pytest.approx([30 / 3.6] * (before + 1))
    assert speeds[before + 10] < 30 / 3.6 - 0.1


def test_a_target_that_drives_into_the_standing_ego_ends_the_case(tmp_path: Path) -> None:
    """Head on: the ego has no impact, and nothing that comes later changes that."""
    how: dict[str, Any] = {"only": "CCFhos/50/50/50", "progress": False}
    (row,) = cavsumo.suite(NAME, "time-gap", output=tmp_path / "a.csv", **how).rows.to_dict(
        "records"
    )
    assert (row["outcome"], row["contacts"]) == ("held", 1)
    assert row["time_s"] < 8.0


class Looks(Brakes):
    """Refuses to drive where it is not told the lane of its route."""

    def reset(self, scene: Any) -> None:
        (lane,) = scene.surroundings.route
        assert lane == (0.0, 3.5, pytest.approx(30 / 3.6))
        assert len(scene.surroundings.lanes) == 4


def test_an_ego_is_told_the_lane_of_a_scripted_test() -> None:
    """Its width, and the speed of the test as its limit, as planners need them."""
    how: dict[str, Any] = {"only": "CPFA/30/50", "progress": False, "trace": "none"}
    (row,) = cavsumo.suite(NAME, Looks(20.0), **how).rows.to_dict("records")
    assert row["outcome"] == "held", row["error"]


class Steers(Brakes):
    """The same by throttle and steering: it is not held."""

    def act(self, snapshot: Any) -> Drive:
        return Drive(super().act(snapshot).value, 0.0)


def test_an_ego_without_the_speed_of_the_test_is_a_row_that_says_so(tmp_path: Path) -> None:
    """It slowed down before the test began."""
    how: dict[str, Any] = {"only": "CPFA/30/50", "progress": False}
    played = cavsumo.suite(NAME, Steers(200.0), output=tmp_path / "a.csv", **how)
    (row,) = played.rows.to_dict("records")
    assert row["outcome"] == "error"
    assert "it entered with the speed of CPFA/30/50, 30.0 km/h: it does not hold it" in row["error"]
    assert row["case"] == "CPFA/30/50"


def test_an_ego_that_cannot_reach_the_speed_is_refused(tmp_path: Path) -> None:
    """In one sentence, and nothing is written."""
    words = ["suite", NAME, "--ego", "sumo", "--ego-param", "maxSpeed=8", "--only", "CPNA"]
    done = command(tmp_path, *words)
    assert done.returncode == 2
    assert done.stderr == "cavsumo: ego sumo: drives at most 28.8 km/h, CPNA/30/25 needs 30\n"
    assert not list(tmp_path.iterdir())


def test_the_list_of_suites_counts_their_cases(tmp_path: Path) -> None:
    """One line each, and one for each test of one."""
    assert NAME in command(tmp_path, "suite", "list").stdout
    lines = command(tmp_path, "suite", "list", NAME).stdout.splitlines()
    assert ["CPNA", "18", "12"] in [line.split()[:3] for line in lines]


def test_a_parked_car_hides_the_child_from_a_sensor(tmp_path: Path) -> None:
    """An ego that sees past nothing brakes later."""
    how: dict[str, Any] = {"only": "CPNCO/40/50", "trace": "all", "progress": False}

    def first_braking(**sensor: Any) -> int:
        results = cavsumo.suite(
            NAME, Brakes(35.0), output=tmp_path / "a.csv", overwrite=True, **how | sensor
        )
        frames = read_trace_text(tmp_path / "a" / "run000000.jsonl.gz").splitlines()[1:]
        speeds = [json.loads(frame)["ego"][2] for frame in frames]
        assert len(results) == 1
        return next(i for i, v in enumerate(speeds) if v < 11.0)

    assert first_braking() < first_braking(ego_sensor={"occlusion": True})


def test_a_report_and_junit_know_the_cases(played: cavsumo.Results) -> None:
    """A case of the suite is a case of JUnit; a page is written; certify says why it cannot."""
    folder = played.file.parent
    words = ["report", str(played.file), "--junit", "j.xml", "--html", "r.html", "-o", "r.txt"]
    done = command(folder, *words)
    assert done.returncode == 0
    cases = ElementTree.parse(folder / "j.xml").findall(".//testcase")
    assert sorted(case.get("name", "") for case in cases) == sorted(CELLS)
    assert all(case.find("failure") is not None for case in cases)
    played.suite_page(folder / "grid.html")
    assert "CPNCO/50/50" in (folder / "grid.html").read_text(encoding="utf-8")
    done = command(folder, "certify", str(played.file), "0")
    assert (done.returncode, "holds scripted tests" in done.stderr) == (2, True)


def test_a_report_of_two_networks_has_pages_of_both(tmp_path: Path) -> None:
    """A map of each, and pages that show each case on its own network and way."""
    how: dict[str, Any] = {"only": ["CPNA/60/50", "CCFtap/10/45", "CCFtap/20/30"]}
    cavsumo.suite(NAME, "constant", progress=False, output=tmp_path / "a.csv", **how)
    words = ["report", "a.csv", "--html", "r.html", "--replays", "3", "-o", "r.txt"]
    done = command(tmp_path, *words)
    assert (done.returncode, "No replay pages" in done.stderr) == (0, False), done.stderr
    pages = sorted(page.name for page in (tmp_path / "r_replays").iterdir())
    assert pages == ["run000000.html", "run000001.html", "run000002.html"]
    text = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "proving-road" in text
    assert "proving-crossing" in text


def test_a_case_of_a_suite_that_is_gone_is_replayed_from_its_trace(tmp_path: Path) -> None:
    """The file of the user's own suite is not needed for a run with a trace."""
    file = tmp_path / "mine.toml"
    original = Path(cavsumo.__file__).parent / "suites" / "r152-pedestrian.toml"
    file.write_text(original.read_text(encoding="utf-8"), encoding="utf-8")
    words = ["suite", str(file), "--ego", "constant", "--speeds", "60", "-o", "a.csv", "-q"]
    assert command(tmp_path, *words).returncode == 1
    file.unlink()
    done = command(tmp_path, "replay", "a.csv", "0")
    assert (done.returncode, "the same" in done.stdout) == (0, True), done.stderr
    assert "sha256" not in done.stderr
