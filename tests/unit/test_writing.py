"""What a batch writes: nothing is lost, doubled or half there, wherever it was cut off."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import pytest
from support import content

from cavsumo.batch.batch_run import BatchRun
from cavsumo.batch.messages import Answer
from cavsumo.batch.prepared import PreparedBatch, manifest
from cavsumo.errors import BatchError, ResultsError
from cavsumo.results.columns import COLUMNS
from cavsumo.results.reading import HEADER, check_replaceable, read_manifest, read_rows
from cavsumo.results.rows import Outcome
from cavsumo.results.writing import Recorder

PLAN = {"plan": {"seed": 1}}
RUNS = 4


def outcome(run: int, **more: Any) -> Outcome:
    """An episode, those with odd numbers with a trace, those from 2 on with an ego's log."""
    row = {"run": run, "agent": "noop", "outcome": "not_triggered", "time_s": 1.5, "wall_s": 0.25}
    trace, log = b"%d" % run if run % 2 else b"", f"said {run}\n" if run >= 2 else ""
    return Outcome(row | more, trace, log)


def write(file: Path, runs: Sequence[int] = range(RUNS), status: str = "finished") -> None:
    """A whole batch, or with another status what a kill leaves of one."""
    with Recorder(file) as recorder:
        recorder.begin(PLAN)
        for run in runs:
            recorder.write(outcome(run))
        recorder.checkpoint({}) if status == "running" else recorder.finish(status, {})


def resume(file: Path, runs: int = RUNS) -> list[str]:
    """Go on with a batch to its end; the numbers of the rows that were there."""
    todo = iter(range(runs))
    with Recorder(file) as recorder:
        there = [row["run"] for row in recorder.resume(read_manifest(file), todo)]
        for run in todo:
            recorder.write(outcome(run))
        recorder.finish("finished", {})
    return there


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Where the results go, in a folder of their own."""
    return tmp_path / "r.csv"


@pytest.fixture
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of a batch that nothing disturbed."""
    folder = tmp_path_factory.mktemp("whole")
    write(folder / "r.csv")
    return content(folder)


# Cut off ------------------------------------------------------------------------------------------


def test_a_row_torn_anywhere_is_written_again(file: Path, whole: dict[str, bytes]) -> None:
    """A process killed inside the last row, after any of its bytes, loses that row only."""
    text = whole["r.csv"]
    last = text[:-1].rindex(b"\n") + 1
    for size in range(last, len(text)):
        file.unlink(missing_ok=True)
        file.with_suffix(".json").unlink(missing_ok=True)
        write(file, status="running")
        file.write_bytes(text[:size])
        assert resume(file) == ["0", "1", "2"], f"cut after {size} bytes"
        assert content(file.parent) == whole, f"cut after {size} bytes"


def test_a_torn_header_is_written_again(file: Path, whole: dict[str, bytes]) -> None:
    """A batch killed before its first row starts as if nothing had been."""
    for size in (0, 1, len(HEADER) - 1, len(HEADER)):
        write(file, runs=(), status="running")
        file.write_bytes(HEADER.encode()[:size])
        assert resume(file) == []
        assert content(file.parent) == whole


def test_rows_of_the_batch_before_are_not_taken_for_new_ones(file: Path) -> None:
    """Killed when the manifest is the new one and the old rows still lie there: none of them."""
    write(file)
    manifest = read_manifest(file)
    file.with_suffix(".json").write_text(
        json.dumps(manifest | {"plan": {"seed": 2}, "status": "starting"}), encoding="utf-8"
    )
    with Recorder(file) as recorder:
        assert list(recorder.resume(read_manifest(file), iter(range(RUNS)))) == []
        assert file.read_text(encoding="utf-8") == HEADER
        assert not list(file.with_suffix("").iterdir())
        recorder.finish("finished", {})
    assert read_manifest(file)["plan"] == {"seed": 2}


def test_a_batch_that_only_started_may_be_replaced(file: Path) -> None:
    """A manifest that says starting stands over the rows of a finished batch: nothing to lose."""
    write(file, status="starting")
    check_replaceable(file)
    write(file)
    assert read_manifest(file)["status"] == "finished"


def test_traces_behind_the_last_row_go_and_all_others_stay(
    file: Path, whole: dict[str, bytes]
) -> None:
    """A trace without a row would be taken for one; whatever else lies there is not ours."""
    write(file, runs=range(2), status="running")
    traces = file.with_suffix("")
    (traces / "run000002.jsonl.gz").write_text("half a tra", encoding="utf-8")
    (traces / "run000777.jsonl").write_text("of a longer batch", encoding="utf-8")
    (traces / "run000778.ego.log").write_text("of a longer batch", encoding="utf-8")
    for name in ("notes.txt", "runtimes.jsonl.gz", "my-run000777.jsonl", "runs.ego.log"):
        (traces / name).write_text("mine", encoding="utf-8")
    resume(file)
    kept = content(file.parent)
    assert {k: v for k, v in kept.items() if v != b"mine"} == whole
    assert len(kept) == len(whole) + 4


def test_a_batch_that_began_with_plain_traces_goes_on_with_compressed_ones(file: Path) -> None:
    """As 0.1 left one: its traces stay, those without a row go, a replaced row's goes too."""
    write(file, runs=range(3), status="running")
    folder = file.with_suffix("")
    (folder / "run000001.jsonl.gz").rename(folder / "run000001.jsonl")
    file.write_bytes(file.read_bytes().replace(b"run000001.jsonl.gz", b"run000001.jsonl"))
    (folder / "run000003.jsonl").write_text("half a tra", encoding="utf-8")
    assert resume(file) == ["0", "1", "2"]
    kept = [row["trace"] for row in read_rows(file)]
    assert kept == ["", "r/run000001.jsonl", "", "r/run000003.jsonl.gz"]
    assert {f.name for f in folder.glob("*.jsonl*")} == {Path(n).name for n in kept if n}
    with Recorder(file) as recorder:
        list(recorder.resume(read_manifest(file), iter(range(RUNS))))
        recorder.replace({1: outcome(1)})
        assert recorder.traces == 2
    assert {f.name for f in folder.glob("*.jsonl*")} == {"run000001.jsonl.gz", "run000003.jsonl.gz"}


def test_more_episodes_are_appended(file: Path, tmp_path: Path) -> None:
    """A finished batch grows; the bytes of its first rows stay what they were."""
    write(file)
    before = file.read_bytes()
    assert resume(file, runs=RUNS + 2) == ["0", "1", "2", "3"]
    assert file.read_bytes().startswith(before)
    assert len(read_rows(file)) == RUNS + 2


# Rows put in the place of others ------------------------------------------------------------------


def test_replaced_rows_stand_where_the_old_ones_stood(file: Path, whole: dict[str, bytes]) -> None:
    """Errors played again: the file is the one without errors, and can be written on."""
    with Recorder(file) as recorder:
        recorder.begin(PLAN)
        for run in range(RUNS - 1):
            failed = Outcome(outcome(run).row | {"outcome": "error", "error": "a crash"})
            recorder.write(failed if run < 2 else outcome(run))
        recorder.replace({0: outcome(0), 1: outcome(1)})
        recorder.write(outcome(RUNS - 1))
        recorder.finish("finished", {})
    assert content(file.parent) == whole


def test_a_replacement_without_a_trace_removes_the_old_one(file: Path) -> None:
    """What was a test and is none any more leaves no trace behind, nor an ego's log."""
    with Recorder(file) as recorder:
        recorder.begin(PLAN)
        for run in range(RUNS):
            recorder.write(outcome(run))
        recorder.replace({run: Outcome(outcome(run).row) for run in (1, 2)})
        recorder.finish("finished", {})
    assert [row["trace"] for row in read_rows(file)] == ["", "", "", "r/run000003.jsonl.gz"]
    left = {f.name for f in file.with_suffix("").iterdir()}
    assert left == {"run000003.jsonl.gz", "run000003.ego.log"}


def test_replaced_traces_are_counted_once(file: Path) -> None:
    """The summary says how many traces lie there, not how many were ever written."""
    with Recorder(file) as recorder:
        recorder.begin(PLAN)
        for run in range(RUNS):
            recorder.write(outcome(run))
        recorder.replace({run: outcome(run) for run in range(RUNS)})
        recorder.finish("finished", {})
        assert recorder.traces == len(list(file.with_suffix("").glob("*.jsonl.gz"))) == 2


def test_the_lock_survives_a_replacement(file: Path) -> None:
    """After rows were replaced the file is another one on the disk, and still locked."""
    with Recorder(file) as recorder:
        recorder.begin(PLAN)
        recorder.write(outcome(0))
        recorder.replace({0: outcome(0, time_s=2.0)})
        with pytest.raises(ResultsError, match="another run is writing them"), Recorder(file):
            pytest.fail("two writers")
        recorder.write(outcome(1))
        recorder.finish("finished", {})
    assert [row["time_s"] for row in read_rows(file)] == ["2.000", "1.500"]


# One writer ---------------------------------------------------------------------------------------


def test_a_recorder_that_begins_nothing_leaves_nothing(file: Path) -> None:
    """Refused after the file was locked: no empty results appear."""
    with Recorder(file):
        pass
    assert content(file.parent) == {}


# What is there already ----------------------------------------------------------------------------

JSON = '{"name": "a package"}'


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({"r.csv": "a,b\n1,2\n"}, "'r.csv' is there and not a batch of cavsumo"),
        ({"r.json": JSON}, "'r.json' is there and not a batch of cavsumo"),
        ({"r.csv": "a,b\n1,2\n", "r.json": JSON}, "'r.csv' is there and not a batch of cavsumo"),
        ({"r.csv": "a,b\n1,2\n", "r.json": "not json"}, "'r.csv' is there and not a batch"),
    ],
)
def test_what_is_not_ours_is_not_overwritten(
    file: Path, files: Mapping[str, str], words: str
) -> None:
    """A table or a package.json of the same name stays, until overwriting is asked for."""
    for name, text in files.items():
        (file.parent / name).write_text(text, encoding="utf-8")
    before = content(file.parent)
    with pytest.raises(ResultsError, match=words) as caught:
        write(file)
    assert "--overwrite" in str(caught.value)
    assert content(file.parent) == before
    with Recorder(file) as recorder:
        recorder.begin(PLAN, overwrite=True)
        recorder.finish("finished", {})
    assert file.read_text(encoding="utf-8") == HEADER


@pytest.mark.parametrize("status", ["running", "interrupted", "broken"])
def test_an_unfinished_batch_is_not_overwritten(file: Path, status: str) -> None:
    """Hours of episodes that could be gone on with do not vanish by the same command again."""
    write(file, status=status)
    before = content(file.parent)
    with pytest.raises(ResultsError, match=rf"unfinished batch \({status}\); --resume goes on"):
        write(file)
    assert content(file.parent) == before
    with Recorder(file) as recorder:
        recorder.begin(PLAN, overwrite=True)
        recorder.finish("finished", {})
    assert content(file.parent).keys() == {"r.csv", "r.json"}


@pytest.mark.parametrize("status", ["finished", "stopped"])
def test_a_finished_batch_gives_way(file: Path, status: str) -> None:
    """The same command twice plays twice; the traces of the longer batch go with it."""
    write(file, runs=range(8), status=status)
    write(file, runs=range(2))
    assert [row["run"] for row in read_rows(file)] == ["0", "1"]
    assert [f.name for f in file.with_suffix("").iterdir()] == ["run000001.jsonl.gz"]


WIDTH = len(COLUMNS)
COMMAS = b"," * (WIDTH - 1)


def edited(text: bytes, number: int, line: bytes) -> bytes:
    """A file with another line in place of one, counted from 1."""
    lines = text.splitlines(keepends=True)
    lines[number - 1] = line
    return b"".join(lines)


@pytest.mark.parametrize(
    ("number", "line", "words"),
    [
        (1, b"run,agent,outcome\n", "line 1 does not hold the columns"),
        (1, b"\n", "line 1 does not hold the columns"),
        (3, b"1,noop\n", f"line 3 has 2 cells, expected {WIDTH}"),
        (3, b"\n", "line 3"),
        (3, b"1," + COMMAS + b"\n", f"line 3 has {WIDTH + 1} cells, expected {WIDTH}"),
        (3, b"1,\xff\xfe" + COMMAS[1:] + b"\n", "line 3 is damaged"),
        (3, b"one" + COMMAS + b"\n", "line 3 begins with 'one'"),
        (3, b"-1" + COMMAS + b"\n", "line 3 begins with '-1'"),
        (3, b"2" + COMMAS + b"\n", "run 2 where run 1 is due"),
        (3, b"0" + COMMAS + b"\n", "run 0 where run 1 is due"),
        (5, b"3" + COMMAS + b"\n4" + COMMAS + b"\n", "run 4 where the batch is over"),
    ],
)
def test_damage_is_named_and_nothing_is_changed(
    file: Path, number: int, line: bytes, words: str
) -> None:
    """Somebody edited the file: the place is named, and their edit is not cut off."""
    write(file, status="running")
    file.write_bytes(edited(file.read_bytes(), number, line))
    before = content(file.parent)
    with pytest.raises(ResultsError) as caught:
        resume(file)
    assert words in str(caught.value)
    assert "r.csv" in str(caught.value)
    assert content(file.parent) == before


# Somebody else at the file while the batch is written ---------------------------------------------


def removed(file: Path) -> None:
    """As rm does."""
    file.unlink()


def replaced(file: Path) -> None:
    """As an editor does, or another run after a removal."""
    other = file.with_suffix(".other")
    other.write_bytes(file.read_bytes())
    other.replace(file)


def cut(file: Path) -> None:
    """As ``> r.csv`` does."""
    file.write_bytes(b"")


def longer(file: Path) -> None:
    """As ``>> r.csv`` does."""
    with file.open("ab") as stream:
        stream.write(b"9\n")


def spoiled(file: Path) -> None:
    """As long as before, with other content."""
    text = file.read_bytes()
    with file.open("r+b") as stream:
        stream.write(text[:-2] + b"?\n")
    os.utime(file, ns=(0, 0))


MEDDLING = [
    (removed, "the file was removed while"),
    (replaced, "the file was replaced by another file while"),
    (cut, "the file has 0 bytes where"),
    (longer, "bytes where"),
    (spoiled, "the file was changed while"),
]


@pytest.mark.parametrize(("meddle", "words"), MEDDLING)
@pytest.mark.parametrize("then", ["write", "checkpoint", "replace", "finish"])
def test_a_file_that_somebody_else_changes_is_noticed(
    file: Path, meddle: Callable[[Path], None], words: str, then: str
) -> None:
    """Before the next row, note or end: nothing more is written, and it is not said to be whole."""
    with Recorder(file) as recorder:
        recorder.begin(PLAN)
        recorder.write(outcome(0))
        meddle(file)
        there = content(file.parent)
        with pytest.raises(BatchError) as error:
            {
                "write": lambda: recorder.write(outcome(1)),
                "checkpoint": lambda: recorder.checkpoint({}),
                "replace": lambda: recorder.replace({0: outcome(0)}),
                "finish": lambda: recorder.finish("finished", {}),
            }[then]()
    assert words in str(error.value)
    assert "r.csv" in str(error.value)
    assert content(file.parent) == there
    assert read_manifest(file)["status"] == "running"


def test_a_file_that_is_only_touched_stays_ours(file: Path, whole: dict[str, bytes]) -> None:
    """Another time on it changes no row; after rows that were there, and replaced ones, too."""
    write(file, runs=range(2), status="running")
    todo = iter(range(RUNS))
    with Recorder(file) as recorder:
        list(recorder.resume(read_manifest(file), todo))
        os.utime(file, ns=(0, 0))
        recorder.write(outcome(2))
        recorder.replace({2: outcome(2)})
        os.utime(file, ns=(0, 0))
        recorder.write(outcome(3))
        recorder.finish("finished", {})
    assert content(file.parent) == whole


def test_a_run_whose_results_are_removed_ends_with_one_sentence(
    set_up: Callable[..., PreparedBatch], file: Path
) -> None:
    """It is no finished batch; what it found so far is in nobody's place."""
    prepared = set_up(agents=["noop"], runs=4, end=1.0, trace="none")

    class Meddler(Executor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            _, job = args
            if job.run == 2:
                file.unlink()
            future: Future[Any] = Future()
            future.set_result(Answer(outcome(job.run), None))
            return future

    with Recorder(file) as recorder:
        batch_run = BatchRun(prepared, recorder, Meddler(), 1, lambda: False)
        batch_run.begin(manifest(prepared))
        for way_out in (batch_run.play, batch_run.end):
            with pytest.raises(BatchError, match="was removed while"):
                way_out()
    assert not file.exists()
    assert json.loads(file.with_suffix(".json").read_text())["status"] == "running"


# Odd text -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("message", "there"),
    [
        ("lost\nthe\r\nmap", "lost the map"),
        ("a\u2028b\x85c\x0bd", "a b c d"),
        ('edge "1, 2"', 'edge "1, 2"'),
        ("Mäkelänkatu", "Mäkelänkatu"),
        ("nul\x00byte", "nul\x00byte"),
    ],
)
def test_an_error_message_is_one_line(file: Path, message: str, there: str) -> None:
    """Whatever a controller says, a row is a line, so that a torn one shows."""
    with Recorder(file) as recorder:
        recorder.begin(PLAN)
        recorder.write(outcome(0, outcome="error", error=message))
        recorder.finish("finished", {})
    assert file.read_bytes().count(b"\n") == 2
    assert read_rows(file)[0]["error"] == there
    assert resume(file) == ["0"]


def test_text_that_is_no_unicode_does_not_end_a_batch(file: Path) -> None:
    """A controller that reports a file name of undecodable bytes costs its row and no other."""
    with Recorder(file) as recorder:
        recorder.begin(PLAN)
        recorder.write(outcome(0, outcome="error", error="no file caf\udce9.map"))
        recorder.write(outcome(1))
        recorder.finish("finished", {})
    rows = read_rows(file)
    assert [row["run"] for row in rows] == ["0", "1"]
    assert rows[0]["error"].startswith("no file caf")


# A full disk --------------------------------------------------------------------------------------


def test_a_row_that_cannot_be_written_can_be_written_later(file: Path) -> None:
    """A BatchError leaves the recorder usable: what follows stands behind whole rows."""
    with Recorder(file) as recorder:
        recorder.begin(PLAN)
        recorder.write(outcome(0))
        file.with_suffix("").write_text("in the way of the traces", encoding="utf-8")
        with pytest.raises(BatchError, match="cannot be written"):
            recorder.write(outcome(1))
        recorder.finish("broken", {})
    assert [row["run"] for row in read_rows(file)] == ["0"]
    file.with_suffix("").unlink()
    assert resume(file) == ["0"]


def test_links_among_results_that_are_continued_are_not_followed(file: Path) -> None:
    """A stranger's unfinished batch: its links are replaced, a folder that leads out is refused."""
    write(file, range(1), status="running")
    outside = file.parent.parent / f"{file.parent.name}-outside"
    outside.mkdir()
    file.with_suffix("").mkdir(exist_ok=True)
    links = {file.with_suffix("") / "run000001.jsonl.gz", file.parent / ".r.json.new"}
    for link in links:
        link.symlink_to(outside / link.name)
    assert resume(file) == ["0"]
    assert not any(link.is_symlink() for link in links)
    shutil.rmtree(file.with_suffix(""))
    file.with_suffix("").symlink_to(outside)
    with pytest.raises(ResultsError, match="'r' leads out of their folder"):
        resume(file)
    assert list(outside.iterdir()) == []
