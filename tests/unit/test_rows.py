"""Rows, manifest and traces on disk."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support import frame, json_lines

from cavsumo.agents.recorded import Recorded
from cavsumo.errors import ResultsError
from cavsumo.model.bodies import CAR, PEDESTRIAN, Body
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.results.columns import COLUMNS, Row
from cavsumo.results.reading import FORMAT, read_manifest, read_results, read_rows
from cavsumo.results.rows import Outcome, cell
from cavsumo.results.trace_file import packed, read_trace_text
from cavsumo.results.traces import read_trace, trace_head
from cavsumo.results.writing import Recorder


def row(run: int, **more: Any) -> dict[str, Any]:
    """The row of an episode in which nothing was tested."""
    head = {"run": run, "agent": "noop", "ego": "sumo", "seed": 7, "tester": ""}
    return head | {"outcome": "not_triggered", "time_s": 1.0, "wall_s": 0.5} | more


def snapshot(step: int, x: float = 1.0) -> Snapshot:
    """An ego, a tester and a background car."""
    ego = BodyState(Body("ego", CAR), x, 2.0, 3.0, 0.5)
    tester = BodyState(Body("tester0", PEDESTRIAN), 5.0, 6.0, 1.0, -0.5)
    other = (Body("car0", CAR), 9.0, 9.0, 9.0, 3.0)
    return Snapshot(step, 0.1 * step, ego, 0.25, (tester,), (other,))


def seen(step: int, x: float = 1.0) -> dict[str, Any]:
    """That as a frame."""
    return frame(snapshot(step, x))


def played(run: int, *frames: dict[str, Any], **more: Any) -> Outcome:
    """The outcome of an episode, with a trace if there are frames."""
    mine = row(run, **more)
    origin: Row = {"plan": {}, "sha256": {}, "versions": {}, "sumo_options": {}}
    head = trace_head(origin, mine, None, [snapshot(0)], Recorded(0, ()))
    return Outcome(mine, packed(json_lines(head, *frames)) if frames else b"")


@contextmanager
def recording(file: Path, manifest: Row | None = None) -> Iterator[Recorder]:
    """A batch that is begun, and finished on leaving."""
    with Recorder(file) as recorder:
        recorder.begin(manifest or {}, overwrite=True)
        yield recorder
        recorder.finish("finished", {})


def manifest_of(file: Path) -> dict[str, Any]:
    """What stands in the manifest now."""
    data: dict[str, Any] = json.loads(file.with_suffix(".json").read_text(encoding="utf-8"))
    return data


# Cells --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, ""),
        ("", ""),
        ("tester0", "tester0"),
        (7, "7"),
        (0, "0"),
        (1.0, "1.000"),
        (0.0004, "0.000"),
        (-0.0004, "0.000"),
        (-0.0, "0.000"),
        (-0.0006, "-0.001"),
        (-10.0002, "-10.000"),
        (2 / 3, "0.667"),
        (math.inf, ""),
        (-math.inf, ""),
        (math.nan, ""),
    ],
)
def test_cells(value: object, text: str) -> None:
    """Nothing is empty, numbers have three decimals, and zero has no sign."""
    assert cell(value) == text


@settings(deadline=None)
@given(st.floats(-1e9, 1e9))
def test_a_cell_is_its_number_to_half_a_thousandth(value: float) -> None:
    """Rounding keeps what a metre or a second is measured to, and never writes minus zero."""
    text = cell(value)
    assert abs(float(text) - value) <= 0.0005 + 1e-6
    assert math.copysign(1.0, float(text)) == 1.0 or float(text) != 0.0


# Rows and manifest --------------------------------------------------------------------------------


def test_the_header_names_every_column(tmp_path: Path) -> None:
    """The first line is there before any episode, with the columns in their order."""
    with recording(tmp_path / "r.csv"):
        pass
    assert (tmp_path / "r.csv").read_text(encoding="utf-8") == ",".join(COLUMNS) + "\n"


def test_rows_can_be_read_while_the_batch_runs(tmp_path: Path) -> None:
    """Each row is on the disk as soon as it is written, so that a killed batch keeps it."""
    file = tmp_path / "r.csv"
    with recording(file) as recorder:
        for run in range(3):
            recorder.write(played(run, time_s=1.25))
            assert [r["run"] for r in read_rows(file)] == [str(i) for i in range(run + 1)]
        assert read_rows(file)[2]["time_s"] == "1.250"


def test_text_with_commas_and_quotes_comes_back(tmp_path: Path) -> None:
    """An error message is one cell whatever is in it; its lines become one, as a row is a line."""
    message = 'SUMO: "edge, 1"\nis unknown: Mäkelänkatu'
    with recording(tmp_path / "r.csv") as recorder:
        recorder.write(played(0, outcome="error", error=message))
    assert read_rows(tmp_path / "r.csv")[0]["error"] == message.replace("\n", " ")
    assert (tmp_path / "r.csv").read_bytes().count(b"\n") == 2


def test_the_manifest_says_running_until_it_says_finished(tmp_path: Path) -> None:
    """A manifest that still says running belongs to a batch that was killed."""
    file = tmp_path / "r.csv"
    with Recorder(file) as recorder:
        recorder.begin({"plan": {"seed": 1}})
        recorder.write(played(0))
        assert manifest_of(file)["status"] == "running"
        assert manifest_of(file)["plan"] == {"seed": 1}
        recorder.finish("finished", {"episodes": 1})
    done = read_manifest(file)
    assert (done["status"], done["episodes"], done["format"]) == ("finished", 1, FORMAT)
    assert done["plan"] == {"seed": 1}
    assert done["columns"] == {c.name: c.explanation for c in COLUMNS.values()}


def test_pandas_reads_numbers_as_numbers(tmp_path: Path) -> None:
    """The table has numbers where they are, and nothing where a cell is empty."""
    with recording(tmp_path / "r.csv") as recorder:
        recorder.write(played(0, min_gap_m=1.5))
        recorder.write(played(1, min_gap_m=math.inf))
    table = read_results(tmp_path / "r.csv")
    assert list(table.columns) == list(COLUMNS)
    assert table["min_gap_m"].tolist()[0] == 1.5
    assert math.isnan(table["min_gap_m"].tolist()[1])


@pytest.mark.parametrize(
    "text", ['{"format": "something else"}', "[1, 2]", "not json", '{"name": "a package"}']
)
def test_a_foreign_manifest_is_refused(tmp_path: Path, text: str) -> None:
    """A JSON file that is no manifest of ours is refused by name, not read as one."""
    (tmp_path / "r.json").write_text(text, encoding="utf-8")
    with pytest.raises(ResultsError, match=r"r\.json"):
        read_manifest(tmp_path / "r.csv")


def test_missing_files_are_named(tmp_path: Path) -> None:
    """Manifest, rows and trace that are not there are one sentence each."""
    for read in (read_manifest, read_rows, read_results, read_trace):
        with pytest.raises(ResultsError, match="nowhere"):
            read(tmp_path / "nowhere.csv")


# Traces -------------------------------------------------------------------------------------------


def test_a_trace_lies_where_its_row_says(tmp_path: Path) -> None:
    """The path in the row is relative to the file, so that both can be moved together."""
    file = tmp_path / "r.csv"
    with recording(file) as recorder:
        returned = recorder.write(played(4, seen(0), seen(1)))
        recorder.write(played(5))
    with_trace, without = read_rows(file)
    assert with_trace["trace"] == returned["trace"] == "r/run000004.jsonl.gz"
    assert read_trace(tmp_path / with_trace["trace"]).frames == [seen(0), seen(1)]
    assert without["trace"] == ""
    assert recorder.traces == 1


def test_a_trace_begins_with_whose_it_is(tmp_path: Path) -> None:
    """The first line holds the row, but for what no replay repeats, and everybody's box."""
    with recording(tmp_path / "r.csv") as recorder:
        recorder.write(played(4, seen(0)))
    trace = read_trace(tmp_path / "r" / "run000004.jsonl.gz")
    assert trace.row == {c: cell(row(4).get(c)) for c in COLUMNS if c not in ("trace", "wall_s")}
    car = ("car", CAR.length, CAR.width, CAR.wheelbase)
    assert trace.shapes()["ego"] == trace.shapes()["car0"] == car
    assert trace.shapes()["tester0"].kind == "pedestrian"


def test_a_trace_says_when_a_memory_was_left_out() -> None:
    """What an agent knew is kept unless it is large; then the head says so."""
    heads = [
        trace_head({}, row(0), memory, [], Recorded(0, ())) for memory in ([0.5], [0.5] * 100_000)
    ]
    assert [head["memory"] for head in heads] == [[0.5], None]
    assert [head["memory_kept"] for head in heads] == [True, False]


@pytest.mark.parametrize(
    "line",
    ['{"a": 1}', '{"step": 0, "time_s": 0, "ego": [1, 2], "steering": 0, "testers": {}, '
     '"background": {}}', "[1, 2]", "nonsense"],
)  # fmt: skip
def test_lines_that_are_no_frames_are_refused(tmp_path: Path, line: str) -> None:
    """Keys or numbers missing: one sentence with the file's name."""
    with recording(tmp_path / "r.csv") as recorder:
        recorder.write(played(0, seen(0)))
    file = tmp_path / "r" / "run000000.jsonl.gz"
    file.write_bytes(packed(read_trace_text(file) + line + "\n"))
    with pytest.raises(ResultsError, match=r"run000000\.jsonl\.gz"):
        read_trace(file)


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.floats(-1e9, 1e9))
def test_traces_keep_full_precision(tmp_path: Path, x: float) -> None:
    """What is read is bit for bit what was written: a replay is compared with it."""
    with recording(tmp_path / "r.csv") as recorder:
        recorder.write(played(0, seen(0, x)))
    (again,) = read_trace(tmp_path / "r" / "run000000.jsonl.gz").frames
    assert again["ego"][0] == x
    assert math.copysign(1.0, again["ego"][0]) == math.copysign(1.0, x)


def test_a_frame_holds_every_body() -> None:
    """Ego, testers and background are all there, as x, y, v, o."""
    assert seen(2) == {
        "step": 2,
        "time_s": 0.2,
        "ego": [1.0, 2.0, 3.0, 0.5],
        "steering": 0.25,
        "testers": {"tester0": [5.0, 6.0, 1.0, -0.5]},
        "background": {"car0": [9.0, 9.0, 9.0, 3.0]},
        "lights": "",
        "actions": [],
    }


def test_the_traces_of_an_earlier_batch_go(tmp_path: Path) -> None:
    """A shorter batch of the same name leaves no trace of the longer one before it."""
    for runs in (3, 1):
        with recording(tmp_path / "r.csv") as recorder:
            for run in range(runs):
                recorder.write(played(run, seen(0)))
    assert [f.name for f in (tmp_path / "r").iterdir()] == ["run000000.jsonl.gz"]


@pytest.mark.parametrize(
    "name",
    ["notes.txt", "run000001.txt", "my-run.jsonl", pytest.param("runtimes.jsonl")],
)
def test_the_files_of_others_stay(tmp_path: Path, name: str) -> None:
    """What a batch did not write itself it does not remove, in its own folder or beside it."""
    for folder in (tmp_path / "r", tmp_path):
        folder.mkdir(exist_ok=True)
        (folder / name).write_text("mine", encoding="utf-8")
    with recording(tmp_path / "r.csv"):
        pass
    assert (tmp_path / "r" / name).read_text(encoding="utf-8") == "mine"
    assert (tmp_path / name).read_text(encoding="utf-8") == "mine"


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    """Results cannot go where there is no folder, and the message names the file."""
    with (
        pytest.raises(ResultsError, match=r"r\.csv.*cannot be written"),
        recording(tmp_path / "nowhere" / "r.csv"),
    ):
        pytest.fail("it began")


@pytest.mark.parametrize("name", ["r.json", "r"])
def test_a_name_that_manifest_or_traces_need_is_not_lost(tmp_path: Path, name: str) -> None:
    """Rows, manifest and traces never overwrite each other: names that could are refused."""
    with pytest.raises(ResultsError, match=r"ends in \.csv"):
        Recorder(tmp_path / name)
