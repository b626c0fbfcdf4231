"""Batches that were cut off, extended or repeated in part: in the end as if nothing had been."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import pytest
from support import assert_same, content, rows, traces

from cavsumo.batch import learning
from cavsumo.batch.batch_run import BatchRun
from cavsumo.batch.executors import local_executor
from cavsumo.batch.prepared import PreparedBatch, manifest, prepare
from cavsumo.cli import main
from cavsumo.errors import BatchError
from cavsumo.model.scenario import plan_from
from cavsumo.results.reading import read_manifest
from cavsumo.results.writing import Recorder

RUNS = 9
DOOMED = (1, 3)  # episodes whose starts can be made fatal

# Drives on unless the file ``doom`` names the place where its first tester starts.
MORTAL = """
from pathlib import Path
from cavsumo.egos import Acceleration

class Mortal:
    depart_speed = 6.0

    def __init__(self, doom=""):
        self.doom = Path(doom)

    def reset(self, scene):
        places = self.doom.read_text().split() if self.doom.is_file() else []
        self.doomed = repr(scene.starts[0].x) in places if scene.starts else False

    def act(self, snapshot):
        if self.doomed and snapshot.step == 5:
            raise RuntimeError("lost the map")
        return Acceleration(0.0)
"""


def never() -> bool:
    """Nobody asks to stop."""
    return False


def copied(file: Path, folder: Path) -> Path:
    """A batch's files in another folder."""
    shutil.copytree(file.parent, folder, dirs_exist_ok=True)
    return folder / file.name


@pytest.fixture(scope="module")
def settings(networks: Mapping[str, Path]) -> dict[str, Any]:
    """One agent that learns and one that does not, with traces."""
    chosen = {"net": networks["crossing"], "routes": "none", "end": 8.0, "runs": RUNS}
    return chosen | {"agents": ["timing", "q-learning"], "testers": 2}


@pytest.fixture(scope="module")
def words(networks: Mapping[str, Path]) -> list[str]:
    """The same for the command line."""
    line = f"-r none --end 8 --runs {RUNS} --agent timing --agent q-learning --testers 2 -q -j 2"
    return ["-n", str(networks["crossing"]), *line.split()]


@pytest.fixture(scope="module")
def executor() -> Iterator[Executor]:
    """Two threads for all batches."""
    with local_executor(2) as threads:
        yield threads


@pytest.fixture(scope="module")
def prepared(settings: dict[str, Any]) -> PreparedBatch:
    """The batch, set up once."""
    return prepare(plan_from(settings, "test"))


@pytest.fixture(scope="module")
def quiet(
    prepared: PreparedBatch, executor: Executor, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The batch that nobody disturbed."""
    file = tmp_path_factory.mktemp("quiet") / "results.csv"
    play(prepared, file, executor)
    assert traces(file)
    return file


def play(
    prepared: PreparedBatch,
    file: Path,
    executor: Executor,
    *,
    resume: bool = False,
    retry: bool = False,
    stopped: Callable[[], bool] = never,
) -> None:
    """What ``cavsumo run`` does, with workers that stay for the next batch."""
    now = manifest(prepared)
    with Recorder(file) as recorder:
        batch_run = BatchRun(prepared, recorder, executor, 2, stopped)
        if resume or retry:
            batch_run.resume(read_manifest(file) | {"plan": now["plan"]})
        else:
            batch_run.begin(now)
        try:
            if retry:
                batch_run.retry()
            if resume or not retry:
                batch_run.play()
        finally:
            batch_run.end()


# Killed -------------------------------------------------------------------------------------------


class Killed(BaseException):
    """What no code of cavsumo catches, as if the process ended there."""


@pytest.mark.parametrize("count", [1, 15])
def test_what_was_learned_is_caught_up_from_the_last_note(
    prepared: PreparedBatch,
    executor: Executor,
    quiet: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    count: int,
) -> None:
    """Cut off with lessons behind the last note of them: they are played again, not lost."""
    monkeypatch.setattr(learning, "CHECKPOINT_EVERY", 4)
    file = tmp_path / "results.csv"

    def cut() -> bool:
        if file.read_bytes().count(b"\n") > count:
            raise Killed
        return False

    with Recorder(file) as recorder:
        batch_run = BatchRun(prepared, recorder, executor, 2, cut)
        batch_run.begin(manifest(prepared))
        with pytest.raises(Killed):
            batch_run.play()
    cut_off = read_manifest(file)
    assert cut_off["status"] == "running"
    assert ("learned" in cut_off) == (len(rows(file)) >= 8)
    assert rows(file) == rows(quiet)[: len(rows(file))]
    assert len(rows(file)) < 2 * RUNS
    play(prepared, file, executor, resume=True)
    assert_same(file, quiet)


def test_a_batch_killed_before_its_manifest_can_be_gone_on_with(
    networks: Mapping[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed between the first file and the second: a job that starts itself again gets going."""
    monkeypatch.chdir(tmp_path)
    Path("results.csv").touch()
    line = "-r none --end 2 --runs 1 --agent noop --testers 1 -q --resume"
    assert main(["run", "-n", str(networks["pedestrians"]), *line.split()]) == 0
    assert len(rows(Path("results.csv"))) == 1


# Gone on with -------------------------------------------------------------------------------------


def test_more_episodes_can_be_asked_for_later(
    settings: dict[str, Any],
    prepared: PreparedBatch,
    executor: Executor,
    quiet: Path,
    tmp_path: Path,
) -> None:
    """A batch that was extended is the longer one, what was learned included."""
    file = tmp_path / "results.csv"
    play(prepare(plan_from({**settings, "runs": 3}, "test")), file, executor)
    play(prepared, file, executor, resume=True)
    assert_same(file, quiet)


def test_going_on_with_a_finished_batch_plays_nothing(
    quiet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same rows to the byte, and the exit status that they deserve."""
    file = copied(quiet, tmp_path)
    monkeypatch.chdir(tmp_path)
    before = content(tmp_path)
    failed = any(row["outcome"] == "violated" for row in rows(file))
    assert main(["run", "--resume", "-q"]) == int(failed)
    after = content(tmp_path)
    assert json.loads(after.pop("results.json")) == json.loads(before.pop("results.json"))
    assert after == before


def test_going_on_where_nothing_is_starts(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One command for the first time and all others, as a scheduler needs it."""
    monkeypatch.chdir(tmp_path)
    assert main(["run", *words, "--runs", "1", "--resume"]) in (0, 1)
    assert len(rows(Path("results.csv"))) == 2
    assert read_manifest(Path("results.csv"))["status"] == "finished"


@pytest.fixture
def home(quiet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the quiet batch in the working folder."""
    copied(quiet, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--seed", "2"], "seed was 1, is 2"),
        (["--end", "9"], "end was 8.0, is 9.0"),
        (["--testers", "3"], "testers was 2, is 3"),
        (["--agent", "timing"], "agents was ['timing', 'q-learning'], is ['timing']"),
        (["--trace", "none"], "trace was 'tests', is 'none'"),
        (["--param", "q-learning.alpha=0.1"], "params was {}, is {'q-learning.alpha': 0.1}"),
        (["--assert", "collision"], "assertions was ['reaction-zone'], is ['collision']"),
    ],
)
def test_another_batch_is_not_gone_on_with(
    home: Path, capsys: pytest.CaptureFixture[str], more: list[str], said: str
) -> None:
    """Rows of two batches in one file would be worth nothing: refused, saying what differs."""
    before = content(home)
    for how in ("--resume", "--retry-errors"):
        assert main(["run", how, "-q", *more]) == 2
        printed = capsys.readouterr().err
        assert "results.csv' are of another batch" in printed
        assert said in printed
        assert printed.count("\n") == 1
    assert content(home) == before


def test_another_version_is_not_gone_on_with(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another SUMO may drive otherwise: named with both versions."""
    file = home / "results.json"
    told = json.loads(file.read_text(encoding="utf-8"))
    told["versions"]["libsumo"] = "1.0.0"
    file.write_text(json.dumps(told), encoding="utf-8")
    before = content(home)
    assert main(["run", "--resume", "-q"]) == 2
    assert "versions: libsumo was 1.0.0, is 1." in capsys.readouterr().err
    assert content(home) == before


def test_another_network_of_the_same_name_is_not_gone_on_with(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The file was edited between two sessions: named."""
    file = home / "results.json"
    told = json.loads(file.read_text(encoding="utf-8"))
    net = Path(told["plan"]["scenario"]["net"])
    edited = home / net.name
    edited.write_text(net.read_text(encoding="utf-8") + "<!-- edited -->\n", encoding="utf-8")
    told["plan"]["scenario"]["net"] = str(edited)
    told["sha256"] = {str(edited): told["sha256"][str(net)]}
    file.write_text(json.dumps(told), encoding="utf-8")
    before = content(home)
    assert main(["run", "--resume", "-q"]) == 2
    assert f"sha256: {edited} was " in capsys.readouterr().err
    assert content(home) == before


def test_fewer_episodes_than_there_are_are_refused(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A batch is never shortened: what was played stays."""
    before = content(home)
    assert main(["run", "--resume", "-q", "--runs", "2"]) == 2
    assert "run 4" in capsys.readouterr().err
    assert content(home) == before


def test_nothing_to_retry_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Errors can only be played again where a batch is."""
    monkeypatch.chdir(tmp_path)
    assert main(["run", "--retry-errors"]) == 2
    assert "results.json" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


# Errors played again ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def doom(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The file that dooms episodes; the ego that minds it can be imported."""
    folder = tmp_path_factory.mktemp("controllers")
    (folder / "mortal.py").write_text(MORTAL, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        yield folder / "doom"


class Drill:
    """A batch with a mortal ego: played in peace, and with episodes in which it died."""

    def __init__(self, agents: list[str], doom: Path, folder: Path, executor: Executor) -> None:
        settings: dict[str, Any] = {"net": Path("networks/pedestrians.net.xml").resolve()}
        settings |= {"routes": "none", "ego": "mortal:Mortal", "ego_params": {"doom": str(doom)}}
        settings |= {"agents": agents, "testers": 2, "runs": 5, "end": 8.0, "trace": "all"}
        self.prepared = prepare(plan_from(settings, "test"))
        self.doom, self.executor = doom, executor
        self.quiet, self.failed = folder / "quiet" / "results.csv", folder / "failed/results.csv"
        for file in (self.quiet, self.failed):
            file.parent.mkdir()
        self.play(self.quiet)
        places = [self._place(run * len(agents)) for run in DOOMED]
        self.fatal = " ".join(map(repr, places))
        doom.write_text(self.fatal, encoding="utf-8")
        self.play(self.failed)
        doom.unlink()

    def _place(self, run: int) -> float:
        """Where the first tester of an episode starts."""
        lines = traces(self.quiet)[f"run{run:06d}.jsonl.gz"].splitlines()
        place: float = json.loads(lines[1])["testers"]["tester0"][0]
        return place

    def play(self, file: Path, **how: Any) -> None:
        """Play the batch into a file, or what is to be done with the one there."""
        play(self.prepared, file, self.executor, **how)


@pytest.fixture(scope="module")
def drill(doom: Path, executor: Executor, tmp_path_factory: pytest.TempPathFactory) -> Drill:
    """Two agents that do not learn; the last one's rows beside them."""
    return Drill(["random", "timing"], doom, tmp_path_factory.mktemp("drill"), executor)


@pytest.fixture(scope="module")
def school(doom: Path, executor: Executor, tmp_path_factory: pytest.TempPathFactory) -> Drill:
    """One agent that learns and one that does not."""
    return Drill(["random", "q-learning"], doom, tmp_path_factory.mktemp("school"), executor)


def errors(file: Path) -> list[int]:
    """The episodes that could not be played."""
    return [int(row["run"]) for row in rows(file) if row["outcome"] == "error"]


FATAL = [2 * run + agent for run in DOOMED for agent in (0, 1)]


@pytest.mark.parametrize("which", ["drill", "school"])
def test_errors_played_again_leave_the_batch_without_errors(
    request: pytest.FixtureRequest, tmp_path: Path, which: str
) -> None:
    """What crashed in passing costs nothing in the end: rows, traces, and what was learned.

    An agent that learns missed a lesson, so that its later rows are other ones until then.
    """
    trial: Drill = request.getfixturevalue(which)
    file = copied(trial.failed, tmp_path)
    assert errors(file) == FATAL
    if which == "school":
        learned = [r for r in rows(file) if r["agent"] == "q-learning" and int(r["run"]) > FATAL[1]]
        undisturbed = {r["run"]: r for r in rows(trial.quiet)}
        assert any(row != undisturbed[row["run"]] for row in learned if row["outcome"] != "error")
    trial.play(file, retry=True)
    assert_same(file, trial.quiet)


def test_errors_that_come_again_stay(drill: Drill, tmp_path: Path) -> None:
    """Played again in vain: the same rows, none twice, none lost."""
    file = copied(drill.failed, tmp_path)
    before = rows(file), traces(file)
    drill.doom.write_text(drill.fatal, encoding="utf-8")
    try:
        drill.play(file, retry=True)
    finally:
        drill.doom.unlink()
    assert (rows(file), traces(file)) == before


def test_without_errors_nothing_is_played_again(school: Drill, tmp_path: Path) -> None:
    """The file stays what it is to the byte."""
    file = copied(school.quiet, tmp_path)
    before = file.read_bytes()
    school.play(file, retry=True)
    assert file.read_bytes() == before
    assert_same(file, school.quiet)


def test_errors_can_be_played_again_before_the_rest(drill: Drill, tmp_path: Path) -> None:
    """Both at once, for a batch that was cut off: first the errors, then what is left."""
    file = copied(drill.failed, tmp_path)
    lines = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join(lines[:5]))
    assert errors(file) == FATAL[:2]
    drill.play(file, resume=True, retry=True)
    assert_same(file, drill.quiet)


class After:
    """Asks to stop when it was asked so often itself."""

    def __init__(self, count: int) -> None:
        self.count = count

    def __call__(self) -> bool:
        self.count -= 1
        return self.count < 0


def test_a_retry_of_learners_that_is_interrupted_changes_nothing(
    school: Drill, tmp_path: Path
) -> None:
    """Half a school year of one course and half of another would be a third one."""
    file = copied(school.failed, tmp_path)
    before, told = content(file.parent), read_manifest(file)
    with pytest.raises(BatchError, match="nothing changed"):
        school.play(file, retry=True, stopped=After(2))
    after = content(file.parent)
    assert after.pop("results.csv") == before.pop("results.csv")
    now = read_manifest(file)
    for key in ("learned", "learned_after", "status", "episodes", "counts"):
        assert now[key] == told[key], key
    assert after.keys() == before.keys()
    school.play(file, retry=True)
    assert_same(file, school.quiet)


def test_a_retry_that_is_interrupted_keeps_what_it_played(drill: Drill, tmp_path: Path) -> None:
    """Some errors less, and the others can be played again later."""
    file = copied(drill.failed, tmp_path)
    drill.play(file, retry=True, stopped=After(1))
    left = errors(file)
    assert set(left) <= set(FATAL)
    quiet = rows(drill.quiet)
    assert [r for r in rows(file) if int(r["run"]) not in left] == [
        r for r in quiet if int(r["run"]) not in left
    ]
    drill.play(file, retry=True)
    assert_same(file, drill.quiet)


def test_the_command_line_plays_errors_again(
    drill: Drill,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Exit 3 as long as there are errors, with the way out of it; then as without them."""
    file = copied(drill.failed, tmp_path)
    monkeypatch.chdir(tmp_path)
    assert main(["run", "--resume"]) == 3
    printed = capsys.readouterr().out
    assert f"{len(FATAL)} could not be run; run {FATAL[0]}: ego mortal:Mortal at 0.50 s" in printed
    assert "--retry-errors" in printed
    assert main(["run", "--retry-errors"]) in (0, 1)
    printed = capsys.readouterr().out
    assert "could not be run" not in printed
    assert f"({len(list(file.with_suffix('').glob('*.jsonl.gz')))} traces)" in printed
    assert_same(file, drill.quiet)
