"""Replays of recorded episodes: the same again, or the exact place where they part."""

from __future__ import annotations

import copy
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from cavsumo.checked import Manner
from cavsumo.commands.replay import replay, replayed
from cavsumo.commands.run import run
from cavsumo.errors import Exit, ResultsError
from cavsumo.executors import Means
from cavsumo.outcomes import COLUMNS, Outcome
from cavsumo.replays import first_difference, recorded_frames, recorded_plan, recorded_row
from cavsumo.setting import prepare

Frames = list[dict[str, Any]]
RUN = 1  # the episode that is played again


@dataclass(frozen=True)
class Recording:
    """A batch on disk and one of its episodes, played again in another process."""

    csv_file: Path
    row: dict[str, str]
    frames: Frames
    again: Outcome

    def difference(
        self, *, row: dict[str, str] | None = None, frames: Frames | None = None
    ) -> str | None:
        """Where the replay parts from a changed record."""
        return first_difference(
            row or self.row, frames or self.frames, self.again.row, self.again.frames
        )


@pytest.fixture(scope="module")
def recording(networks: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Two episodes with traffic at the Helsinki crossing, the second one replayed."""
    file = tmp_path_factory.mktemp("batch") / "results.csv"
    settings = {"net": networks["crossing"], "agents": ["timing"], "runs": 2, "trace": "all"}
    run(settings, file, Means(), Manner(quiet=True, exit_zero=True))
    plan, _ = recorded_plan(file)
    row = recorded_row(file, RUN)
    frames = recorded_frames(file, row)
    assert frames is not None
    return Recording(file, row, frames, replayed(prepare(plan), RUN))


def test_a_recorded_episode_comes_out_the_same(recording: Recording) -> None:
    """Row and frames of the replay equal those on disk, in every bit of every body."""
    assert recording.difference() is None
    assert recording.frames == recording.again.frames
    assert recording.frames[-1]["background"]
    assert len(recording.frames) == int(recording.row["steps"]) + 1


@pytest.mark.parametrize(
    ("step", "body", "quantity"),
    [(0, "tester0", "o"), (7, "ego", "v"), (12, "tester2", "x"), (-1, "tester1", "y")],
)
def test_one_changed_number_is_named(
    recording: Recording, step: int, body: str, quantity: str
) -> None:
    """The least change of one number in the trace: its timestep, body, quantity, both values."""
    frames = copy.deepcopy(recording.frames)
    frame = frames[step]
    pose = frame["ego"] if body == "ego" else frame["testers"][body]
    i = "xyvo".index(quantity)
    pose[i] = math.nextafter(pose[i], math.inf)
    said = recording.difference(frames=frames)
    place = f"step {frame['step']} ({frame['time_s']:.3f} s): {body}.{quantity}"
    new = recording.again.frames[step]
    was = (new["ego"] if body == "ego" else new["testers"][body])[i]
    assert said == f"{place} recorded {pose[i]!r}, replayed {was!r}"


def test_a_changed_number_of_the_traffic_is_named(recording: Recording) -> None:
    """The background is compared as the testers are."""
    frames = copy.deepcopy(recording.frames)
    body = next(iter(frames[9]["background"]))
    frames[9]["background"][body][1] += 1e-12
    said = recording.difference(frames=frames) or ""
    assert said.startswith(f"step 9 (0.900 s): {body}.y recorded")


@pytest.mark.parametrize("key", ["steering", "time_s", "step"])
def test_a_changed_number_beside_the_bodies_is_named(recording: Recording, key: str) -> None:
    """The ego's steering angle, from which the zones follow, and the clock count as well."""
    frames = copy.deepcopy(recording.frames)
    frames[5][key] += 1
    assert key.removesuffix("_s") in (recording.difference(frames=frames) or "")


def test_the_first_of_several_changes_is_named(recording: Recording) -> None:
    """Two changes: the earlier timestep is the one to look at."""
    frames = copy.deepcopy(recording.frames)
    for step in (8, 3):
        frames[step]["ego"][2] += 0.5
    assert (recording.difference(frames=frames) or "").startswith("step 3 (0.300 s): ego.v")


def test_bodies_that_come_or_go_are_named(recording: Recording) -> None:
    """A body missing from the record, or one that was never there."""
    frames = copy.deepcopy(recording.frames)
    body, pose = frames[4]["background"].popitem()
    assert recording.difference(frames=frames) == f"step 4 (0.400 s): {body} is new"
    frames[4]["background"] |= {body: pose, "ghost": [0.0, 0.0, 0.0, 0.0]}
    assert recording.difference(frames=frames) == "step 4 (0.400 s): ghost is gone"


def test_a_trace_of_another_length_is_named(recording: Recording) -> None:
    """A trace cut short: how many frames there were and are."""
    n = len(recording.frames)
    said = recording.difference(frames=recording.frames[:-2])
    assert said == f"{n - 2} frames were recorded, {n} replayed"


@pytest.mark.parametrize("column", ["outcome", "reward", "min_gap_m", "seed", "tester"])
def test_a_changed_row_is_named_by_column(recording: Recording, column: str) -> None:
    """The frames agree and the row does not: which column, and both values."""
    row = recording.row | {column: "7.125"}
    said = recording.difference(row=row)
    assert said == f"{column}: recorded '7.125', replayed {recording.row[column]!r}"


def test_real_time_is_not_compared(recording: Recording) -> None:
    """The only column that no replay can repeat."""
    assert recording.difference(row=recording.row | {"wall_s": "99.000"}) is None
    assert "wall_s" in COLUMNS


# The command


def test_the_command_says_the_same(
    recording: Recording, capsys: pytest.CaptureFixture[str]
) -> None:
    """cavsumo replay of an untouched record: exit status 0 and one line that says so."""
    assert replay(recording.csv_file, RUN) == Exit.OK
    said = capsys.readouterr()
    verdict, n = recording.row["outcome"], len(recording.frames)
    assert said.out == f"run 1 (timing): {verdict}, {n} frames: the same\n"
    assert said.err == ""


def test_the_command_names_a_change_on_disk(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One digit changed in the file: exit status 1 and the timestep, body and quantity."""
    file = _copied(recording.csv_file, tmp_path)
    trace = tmp_path / recording.row["trace"]
    lines = trace.read_text(encoding="utf-8").splitlines()
    frame = json.loads(lines[1 + 6])
    frame["testers"]["tester1"][0] += 1e-9
    lines[1 + 6] = json.dumps(frame)
    trace.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert replay(file, RUN) == Exit.VIOLATED
    said = capsys.readouterr().out
    assert said.startswith("run 1: diverged: step 6 (0.600 s): tester1.x recorded ")


def test_another_network_than_recorded_is_pointed_out(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The manifest knows the network's hash: a replay on a changed file says that it changed."""
    file = _copied(recording.csv_file, tmp_path)
    manifest = json.loads(file.with_suffix(".json").read_text(encoding="utf-8"))
    net = next(name for name in manifest["sha256"] if name.endswith(".net.xml"))
    manifest["sha256"][net] = "0" * 64
    manifest["versions"]["libsumo"] = "1.0.0"
    file.with_suffix(".json").write_text(json.dumps(manifest), encoding="utf-8")
    assert replay(file, RUN) == Exit.OK
    said = capsys.readouterr().err
    assert f"{net} was {'0' * 64}" in said
    assert "libsumo was 1.0.0" in said


def test_a_learners_episode_can_be_replayed(networks: dict[str, Path], tmp_path: Path) -> None:
    """The third episode of a learner, replayed after what it learned in the first two."""
    file = tmp_path / "learning.csv"
    settings = {"net": networks["pedestrians"], "agents": ["noop", "q-learning"], "runs": 3}
    run(settings | {"trace": "all", "end": 5.0}, file, Means(), Manner(quiet=True, exit_zero=True))
    assert replay(file, 5) == Exit.OK


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        ("no such run", "no run 7 among 2 rows"),
        ("no manifest", "manifest .* cannot be read"),
        ("another format", "is not of the format"),
        ("no plan", "holds no valid plan"),
        ("no trace", "trace .* cannot be read"),
        ("no results", "results .* cannot be read"),
    ],
)
def test_damaged_records_are_refused(
    recording: Recording, tmp_path: Path, damage: str, words: str
) -> None:
    """Whatever is missing or foreign: one line says which file and why, before anything runs."""
    file = _copied(recording.csv_file, tmp_path)
    manifest = json.loads(file.with_suffix(".json").read_text(encoding="utf-8"))
    if damage == "no manifest":
        file.with_suffix(".json").unlink()
    elif damage == "no trace":
        (tmp_path / recording.row["trace"]).unlink()
    elif damage == "no results":
        file.unlink()
    else:
        change = {"another format": {"format": "x"}, "no plan": {"plan": {}}}.get(damage, {})
        file.with_suffix(".json").write_text(json.dumps(manifest | change), encoding="utf-8")
    with pytest.raises(ResultsError, match=words) as error:
        replay(file, 7 if damage == "no such run" else RUN)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("line", [b'{"a": 1}', b"[1, 2]", b"\xff"])
def test_a_trace_of_something_else_is_refused(
    recording: Recording, tmp_path: Path, line: bytes
) -> None:
    """Lines that hold no frame, or no text: refused as damaged, not with a traceback."""
    file = _copied(recording.csv_file, tmp_path)
    trace = tmp_path / recording.row["trace"]
    trace.write_bytes(trace.read_bytes() + line + b"\n")
    with pytest.raises(ResultsError, match="trace"):
        recorded_frames(file, recording.row)


def _copied(csv_file: Path, folder: Path) -> Path:
    """A batch copied to another folder: rows, manifest and traces."""
    traces = folder / csv_file.stem
    traces.mkdir()
    for source in (csv_file, csv_file.with_suffix(".json")):
        (folder / source.name).write_bytes(source.read_bytes())
    for source in csv_file.with_suffix("").iterdir():
        (traces / source.name).write_bytes(source.read_bytes())
    return folder / csv_file.name
