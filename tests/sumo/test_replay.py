"""Replays of recorded episodes: the same again, or the exact place where they part."""

from __future__ import annotations

import copy
import dataclasses
import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from cavsumo.batch.executors import Means
from cavsumo.batch.located import located
from cavsumo.batch.preflight import Manner
from cavsumo.batch.prepared import prepare
from cavsumo.batch.replay import (
    Record,
    Replayed,
    compare,
    recorded,
    recorded_alone,
    replayed,
)
from cavsumo.batch.worker import Worker
from cavsumo.cli import main
from cavsumo.cli.commands.replay import ReplayOptions, replay
from cavsumo.cli.commands.run import run
from cavsumo.errors import DivergenceError, Exit, InputError, ResultsError
from cavsumo.results.columns import COLUMNS
from cavsumo.results.trace_file import read_trace_text

Frames = list[dict[str, Any]]
RUN = 1  # the episode that is played again


@dataclass(frozen=True)
class Recording:
    """A batch on disk and one of its episodes, played again in another process."""

    csv_file: Path
    record: Record
    again: Replayed

    @property
    def row(self) -> dict[str, str]:
        """The recorded row."""
        return dict(self.record.row)

    @property
    def frames(self) -> Frames:
        """The recorded frames, to be changed at will."""
        assert self.record.trace is not None
        return [dict(copy.deepcopy(frame)) for frame in self.record.trace.frames]

    @property
    def trace_file(self) -> Path:
        """The trace on disk."""
        return self.csv_file.parent / self.row["trace"]

    @property
    def frames_again(self) -> list[Any]:
        """The frames of the replay."""
        assert self.again.trace is not None
        return list(self.again.trace.frames)

    def difference(
        self, *, row: dict[str, str] | None = None, frames: Frames | None = None
    ) -> DivergenceError | None:
        """Where the replay parts from a changed record."""
        assert self.record.trace is not None
        trace = dataclasses.replace(self.record.trace, frames=frames or self.frames)
        try:
            compare(dataclasses.replace(self.record, row=row or self.row, trace=trace), self.again)
        except DivergenceError as error:
            return error
        return None


@pytest.fixture(scope="module")
def recording(networks: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Two episodes with traffic at the Helsinki crossing, the second one replayed."""
    file = tmp_path_factory.mktemp("batch") / "results.csv"
    settings = {"net": networks["crossing"], "agents": ["timing"], "runs": 2, "trace": "all"}
    run(settings, file, Means(), Manner(quiet=True, exit_zero=True))
    record = recorded(file, RUN)
    with Worker(prepare(record.plan)) as worker:
        return Recording(file, record, replayed(worker, record))


def test_a_recorded_episode_comes_out_the_same(recording: Recording) -> None:
    """Row and frames of the replay equal those on disk, in every bit of every body."""
    assert recording.difference() is None
    assert recording.frames == recording.frames_again
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
    frames = recording.frames
    frame = frames[step]
    pose = frame["ego"] if body == "ego" else frame["testers"][body]
    i = "xyvo".index(quantity)
    pose[i] = math.nextafter(pose[i], math.inf)
    said = recording.difference(frames=frames)
    place = f"at step {frame['step']} ({frame['time_s']:.3f} s): {body}.{quantity}"
    new = recording.frames_again[step]
    was = (new["ego"] if body == "ego" else new["testers"][body])[i]
    assert str(said) == f"run 1 (timing) diverged {place} recorded {pose[i]!r}, replayed {was!r}"
    assert said is not None
    assert (said.step, said.body, said.quantity) == (frame["step"], body, quantity)


def test_a_changed_number_of_the_traffic_is_named(recording: Recording) -> None:
    """The background is compared as the testers are."""
    frames = recording.frames
    body = next(iter(frames[9]["background"]))
    frames[9]["background"][body][1] += 1e-12
    said = recording.difference(frames=frames)
    assert f"diverged at step 9 (0.900 s): {body}.y recorded" in str(said)


@pytest.mark.parametrize("key", ["steering", "time_s", "step"])
def test_a_changed_number_beside_the_bodies_is_named(recording: Recording, key: str) -> None:
    """The ego's steering angle, from which the zones follow, and the clock count as well."""
    frames = recording.frames
    frames[5][key] += 1
    said = recording.difference(frames=frames)
    assert said is not None
    assert (said.body, said.quantity) == ("", key)
    assert f": {key} recorded " in str(said)


def test_the_first_of_several_changes_is_named(recording: Recording) -> None:
    """Two changes: the earlier timestep is the one to look at."""
    frames = recording.frames
    for step in (8, 3):
        frames[step]["ego"][2] += 0.5
    assert "diverged at step 3 (0.300 s): ego.v" in str(recording.difference(frames=frames))


def test_bodies_that_come_or_go_are_named(recording: Recording) -> None:
    """A body missing from the record, or one that was never there."""
    frames = recording.frames
    body, pose = frames[4]["background"].popitem()
    assert str(recording.difference(frames=frames)).endswith(f"step 4 (0.400 s): {body} is new")
    frames[4]["background"] |= {body: pose, "ghost": [0.0, 0.0, 0.0, 0.0]}
    assert str(recording.difference(frames=frames)).endswith("step 4 (0.400 s): ghost is gone")


def test_a_trace_of_another_length_is_named(recording: Recording) -> None:
    """A trace cut short: how many frames there were and are."""
    n = len(recording.frames)
    said = recording.difference(frames=recording.frames[:-2])
    assert str(said).endswith(f"{n - 2} frames were recorded, {n} replayed")


@pytest.mark.parametrize("column", ["outcome", "reward", "min_gap_m", "seed", "tester"])
def test_a_changed_row_is_named_by_column(recording: Recording, column: str) -> None:
    """The frames agree and the row does not: which column, and both values."""
    row = recording.row | {column: "7.125"}
    said = recording.difference(row=row)
    was = recording.row[column]
    assert str(said).endswith(f"at the row: {column} recorded '7.125', replayed {was!r}")


def test_real_time_is_not_compared(recording: Recording) -> None:
    """The only column that no replay can repeat."""
    assert recording.difference(row=recording.row | {"wall_s": "99.000"}) is None
    assert "wall_s" in COLUMNS


# The command


def test_the_command_says_the_same(
    recording: Recording, capsys: pytest.CaptureFixture[str]
) -> None:
    """cavsumo replay of an untouched record: exit status 0 and one line that says so."""
    assert replay(recording.csv_file, ReplayOptions(RUN)) == Exit.OK
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
    lines = read_trace_text(trace).splitlines()
    frame = json.loads(lines[1 + 6])
    frame["testers"]["tester1"][0] += 1e-9
    lines[1 + 6] = json.dumps(frame)
    trace.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert main(["replay", str(file), str(RUN)]) == Exit.VIOLATED
    said = capsys.readouterr().err
    assert said.startswith("cavsumo: run 1 (timing) diverged at step 6 (0.600 s): tester1.x ")
    assert said.count("\n") == 1


def test_another_version_is_pointed_out_and_another_network_refused(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The manifest knows versions and checksums: only the recorded network is played on."""
    file = _copied(recording.csv_file, tmp_path)
    manifest = json.loads(file.with_suffix(".json").read_text(encoding="utf-8"))
    net = next(name for name in manifest["sha256"] if name.endswith(".net.xml"))
    manifest["versions"]["libsumo"] = "1.0.0"
    file.with_suffix(".json").write_text(json.dumps(manifest), encoding="utf-8")
    assert replay(file, ReplayOptions(RUN)) == Exit.OK
    assert "libsumo was 1.0.0" in capsys.readouterr().err
    manifest["sha256"][net] = "0" * 64
    file.with_suffix(".json").write_text(json.dumps(manifest), encoding="utf-8")
    with pytest.raises(
        InputError, match=r"sha256 a72e56a374a8, not the 'crossing.net.xml' \(sha25"
    ):
        replay(file, ReplayOptions(RUN))


def test_a_learners_episode_can_be_replayed(networks: dict[str, Path], tmp_path: Path) -> None:
    """The third episode of a learner, replayed after what it learned in the first two."""
    file = tmp_path / "learning.csv"
    settings = {"net": networks["pedestrians"], "agents": ["noop", "q-learning"], "runs": 3}
    run(settings | {"trace": "all", "end": 5.0}, file, Means(), Manner(quiet=True, exit_zero=True))
    assert replay(file, ReplayOptions(5)) == Exit.OK
    alone = file.with_suffix("") / "run000005.jsonl.gz"
    assert replay(alone, ReplayOptions()) == Exit.OK  # what it knew before is in its trace


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
        replay(file, ReplayOptions(7 if damage == "no such run" else RUN))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("line", [b'{"a": 1}', b"[1, 2]", b"\xff"])
def test_a_trace_of_something_else_is_refused(
    recording: Recording, tmp_path: Path, line: bytes
) -> None:
    """Lines that hold no frame, or no text: refused as damaged, not with a traceback."""
    file = _copied(recording.csv_file, tmp_path)
    trace = tmp_path / recording.row["trace"]
    trace.write_bytes(read_trace_text(trace).encode("utf-8") + line + b"\n")
    with pytest.raises(ResultsError, match="trace"):
        recorded(file, RUN)


def test_an_error_is_replayed_and_cannot_be_shown(
    networks: dict[str, Path],
    tmp_path: Path,
    controller: Callable[..., str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    """An episode in which the ego fails: the same error again, and no page of it."""
    name = controller(
        "class Ego:\n    def act(self, snapshot):\n        raise ValueError('lost')\n"
    )
    file = tmp_path / "results.csv"
    settings = {"net": networks["pedestrians"], "ego": f"{name}:Ego", "runs": 1}
    run(settings, file, Means(), Manner(quiet=True, exit_zero=True))
    assert main(["replay", str(file), "0", "--trust"]) == Exit.OK
    assert "run 0 (timing): error, its row" in capsys.readouterr().out
    page = tmp_path / "page.html"
    assert main(["replay", str(file), "0", "--trust", "--html", str(page)]) == Exit.USAGE
    assert "ended in an error" in capsys.readouterr().err
    assert not page.exists()


def test_what_was_recorded_is_shown_without_playing(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The page of a record that could not come out the same any more; it says so."""
    file, page = _sent(recording, tmp_path), tmp_path / "page.html"
    text = read_trace_text(file).replace('"libsumo": "', '"libsumo": "0.')
    file.write_text(text.replace('"lights": ""', '"lights": "r"'), encoding="utf-8")
    assert main(["replay", str(file), "--recorded", "--html", str(page)]) == Exit.OK
    assert "as recorded" in capsys.readouterr().out
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")


# A trace alone


def test_a_trace_is_replayed_from_its_file_alone(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One file and the network beside it, elsewhere: the same row and the same frames."""
    file = _sent(recording, tmp_path)
    assert main(["replay", str(file)]) == Exit.OK
    n = len(recording.frames)
    assert f"run 1 (timing): {recording.row['outcome']}, {n} frames: the same" in (
        capsys.readouterr().out
    )


def test_one_changed_number_of_a_lone_trace_is_named(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A frame or the row in the head: the first difference, and exit status 1."""
    file = _sent(recording, tmp_path)
    head, *lines = read_trace_text(file).splitlines()
    other = json.loads(head)
    other["row"]["min_gap_m"] = "1.234"
    file.write_text("\n".join([json.dumps(other), *lines]) + "\n", encoding="utf-8")
    assert main(["replay", str(file)]) == Exit.VIOLATED
    assert "diverged at the row: min_gap_m recorded '1.234'" in capsys.readouterr().err


def test_a_trace_is_played_back_without_its_routes(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its actions and departures are in it; the page is that of the record, byte for byte."""
    file, pages = _sent(recording, tmp_path), [tmp_path / "a.html", tmp_path / "b.html"]
    assert main(["replay", str(file), "--recorded", "--html", str(pages[0])]) == Exit.OK
    (tmp_path / "crossing.rou.xml").unlink()
    capsys.readouterr()
    assert main(["replay", str(file), "--playback", "--html", str(pages[1])]) == Exit.OK
    said, n = capsys.readouterr(), len(recording.frames)
    verdict = recording.row["outcome"]
    assert said.out == f"run 1 (timing): {verdict}, {n} frames: the same, played back\n"
    assert said.err == f"cavsumo: wrote {pages[1]}\n"
    assert pages[0].read_bytes() == pages[1].read_bytes()


def test_another_action_is_named_played_anew_and_back(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Anew the agent chooses otherwise than recorded; back the body goes elsewhere."""
    file = _sent(recording, tmp_path)
    lines = read_trace_text(file).splitlines()
    frame = json.loads(lines[1 + 6])
    frame["actions"][1][0] = min(1.4, frame["actions"][1][0] + 0.25)
    frame["actions"][1][1] += 0.01
    lines[1 + 6] = json.dumps(frame)
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert main(["replay", str(file)]) == Exit.VIOLATED
    assert "diverged at step 6 (0.600 s): tester1.throttle recorded" in capsys.readouterr().err
    assert main(["replay", str(file), "--playback"]) == Exit.VIOLATED
    assert "diverged at step 7 (0.700 s): tester1." in capsys.readouterr().err


def test_a_trace_of_format_1_is_replayed_and_not_played_back(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It holds no actions to compare or to play."""
    file = _sent(recording, tmp_path)
    head, *lines = map(json.loads, read_trace_text(file).splitlines())
    head["format"] = "cavsumo-trace-1"
    for key in ("starts", "waited", "departures", "approaches"):
        del head[key]
    for line in lines:
        del line["actions"]
    file.write_text("".join(json.dumps(line) + "\n" for line in (head, *lines)), encoding="utf-8")
    assert main(["replay", str(file)]) == Exit.OK
    assert "frames: the same\n" in capsys.readouterr().out
    assert main(["replay", str(file), "--playback"]) == Exit.USAGE
    said = capsys.readouterr().err
    assert said == "cavsumo: --playback: the trace of run 1 is of format 1, without actions\n"


@pytest.mark.parametrize(
    ("absent", "words"),
    [
        ("net", "needs 'crossing.net.xml' (sha256 a72e56a374a8), which is not here; name it with"),
        (
            "routes",
            "(sha256 cfad45f80d2e), which is not here; name it with --routes FILE or put it "
            "beside it, or play back who departed with --playback",
        ),
        ("other", "not the 'crossing.net.xml' (sha256 a72e56a374a8) of"),
    ],
)
def test_a_lone_trace_needs_its_very_files(
    recording: Recording, tmp_path: Path, networks: dict[str, Path], absent: str, words: str
) -> None:
    """Missing, or with another checksum: one sentence that names the file and the way out."""
    file = _sent(recording, tmp_path)
    wanted = ReplayOptions(net=networks["junction"]) if absent == "other" else ReplayOptions()
    if absent != "other":
        (tmp_path / f"crossing.{'net' if absent == 'net' else 'rou'}.xml").unlink()
    with pytest.raises(InputError) as error:
        replay(file, wanted)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_the_files_of_a_trace_can_be_named(
    recording: Recording, tmp_path: Path, networks: dict[str, Path], routes: dict[str, Path]
) -> None:
    """Wherever they are now: found by --net and --routes, in the plan from there on."""
    file = _sent(recording, tmp_path)
    for name in ("crossing.net.xml", "crossing.rou.xml"):
        (tmp_path / name).unlink()
    found = located(recorded_alone(file), networks["crossing"], routes["crossing"])
    assert found.plan.scenario.net_file == networks["crossing"]
    assert found.plan.scenario.routes_file == routes["crossing"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"plan": {}}, "holds no valid plan"),
        ({"row": {"run": "x"}}, "line 1: run is 'x', expected a whole number"),
        ({"memory_kept": False}, "had learned before, which is large"),
        ({"format": "x"}, "format x, this version reads cavsumo-trace-1 and cavsumo-trace-2"),
        ({"format": 7}, "line 1 is not the head"),
    ],
)
def test_heads_that_do_not_suffice_are_refused(
    recording: Recording, tmp_path: Path, change: dict[str, Any], words: str
) -> None:
    """What cannot be replayed alone says so."""
    file = _sent(recording, tmp_path)
    head, *lines = read_trace_text(file).splitlines()
    text = "\n".join([json.dumps(json.loads(head) | change), *lines])
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ResultsError, match=words):
        recorded_alone(file)


def test_an_episode_of_a_shared_simulation_is_not_replayed_alone(
    recording: Recording, tmp_path: Path
) -> None:
    """Its history is not in the trace."""
    file = _sent(recording, tmp_path)
    text = read_trace_text(file).replace('"reset": "fresh"', '"reset": "shared"')
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ResultsError, match="other episodes had used before"):
        recorded_alone(file)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["{csv}"], "which run of"),
        (["{trace}", "1"], "is the trace of one episode"),
        (["{csv}", "1", "--html", "no/such/page.html"], "no such folder 'no/such'"),
        (["{csv}", "1", "--fcd", "no/such/fcd.xml"], "no such folder 'no/such'"),
        (["{csv}", "1", "--recorded", "--playback"], "name one of them"),
    ],
)
def test_replays_that_mean_nothing_are_refused(
    recording: Recording, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """One sentence and exit status 2 before anything is played."""
    names = {"csv": recording.csv_file, "trace": recording.trace_file}
    assert main(["replay", *(word.format(**names) for word in words)]) == Exit.USAGE
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1


def _sent(recording: Recording, folder: Path) -> Path:
    """A trace on another machine: the network and the routes lie beside it."""
    scenario = recording.record.plan.scenario
    assert scenario.routes is not None
    for source in (scenario.net, scenario.routes, recording.trace_file):
        (folder / source.name).write_bytes(source.read_bytes())
    file = folder / recording.trace_file.name
    elsewhere = str(scenario.net.parent.parent)
    file.write_text(read_trace_text(file).replace(elsewhere, "/elsewhere"))
    return file


def _copied(csv_file: Path, folder: Path) -> Path:
    """A batch copied to another folder: rows, manifest and traces."""
    traces = folder / csv_file.stem
    traces.mkdir()
    for source in (csv_file, csv_file.with_suffix(".json")):
        (folder / source.name).write_bytes(source.read_bytes())
    for source in csv_file.with_suffix("").glob("run*"):
        (traces / source.name).write_bytes(source.read_bytes())
    return folder / csv_file.name
