"""Wherever episodes are played, in threads, processes or on a cluster: the same rows."""

from __future__ import annotations

import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from inline import played_here
from support import PATIENCE_S, rows, until

from cavsumo.batch.dispatch import run_batch
from cavsumo.batch.executors import Means, local_executor, opened
from cavsumo.batch.prepared import PreparedBatch, prepare
from cavsumo.cli import main
from cavsumo.errors import BatchError
from cavsumo.model.scenario import plan_from
from cavsumo.results.reading import read_manifest
from cavsumo.results.rows import Outcome

RUNS = 6
WORDS = f"-r none --agent timing --agent q-learning --testers 2 --end 8 --runs {RUNS} -q".split()


def lasting(outcome: Outcome) -> tuple[dict[str, Any], str]:
    """A row without the real time it took, and the trace."""
    return {key: value for key, value in outcome.row.items() if key != "wall_s"}, outcome.trace


@pytest.fixture(scope="module")
def prepared(networks: dict[str, Path]) -> PreparedBatch:
    """An agent that learns and one that does not, with traces."""
    chosen = {"net": networks["crossing"], "routes": "none", "end": 8.0, "runs": RUNS}
    chosen |= {"agents": ["timing", "q-learning"], "testers": 2}
    return prepare(plan_from(chosen, "test"))


@pytest.fixture(scope="module")
def quiet(prepared: PreparedBatch) -> list[Any]:
    """What comes out of this process, episode by episode."""
    with played_here(), local_executor(1) as executor:
        return played(prepared, executor)


def played(prepared: PreparedBatch, executor: Executor) -> list[Any]:
    """What comes out of an executor: rows, traces and what was learned, in order."""
    batch = run_batch(prepared, executor, prepared.plan.todo())
    return [(lasting(answer.outcome), answer.memory) for answer in batch]


def quiet_rows(quiet: list[Any], upto: int | None = None) -> list[tuple[str, str, str]]:
    """Run, outcome and reward of the quiet batch, as they are compared with a file."""
    return [
        (str(row["run"]), row["outcome"], f"{row['reward']:.3f}") for (row, _), _ in quiet[:upto]
    ]


def file_rows(file: Path) -> list[tuple[str, str, str]]:
    """The same of a file."""
    return [(row["run"], row["outcome"], row["reward"]) for row in rows(file)]


# Processes of this machine ------------------------------------------------------------------------


def test_two_at_a_time_play_what_one_plays(prepared: PreparedBatch, quiet: list[Any]) -> None:
    """-j 2 changes nothing but the time it takes."""
    with opened(Means(jobs=2)) as (executor, jobs):
        assert jobs == 2
        assert played(prepared, executor) == quiet


def test_a_plain_thread_pool_will_do(prepared: PreparedBatch, quiet: list[Any]) -> None:
    """Any executor of the standard library can be given, as others keep to its interface."""
    with played_here(), ThreadPoolExecutor(3) as executor:
        assert played(prepared, executor) == quiet


def test_a_plain_process_pool_will_do(prepared: PreparedBatch, quiet: list[Any]) -> None:
    """All that is sent there and back can be pickled."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as executor:
        assert played(prepared, executor) == quiet


def test_an_executor_that_is_shut_down_is_one_sentence(prepared: PreparedBatch) -> None:
    """Nothing is played, and nobody waits for it."""
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    with pytest.raises(BatchError, match="takes no more episodes"):
        played(prepared, executor)


# Words that make no sense -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("-j 0", "jobs: expected a number of at least 1, got 0"),
        ("-j -1", "jobs: expected a number of at least 1, got -1"),
        ("-j two", "invalid int value: 'two'"),
        ("--executor dask", "--executor dask and --scheduler ADDRESS go together"),
        ("--scheduler tcp://127.0.0.1:1", "--executor dask and --scheduler ADDRESS go together"),
        ("--executor slurm", "invalid choice: 'slurm'"),
    ],
)
def test_means_that_make_no_sense_are_refused(
    refused: Callable[..., str], words: str, said: str
) -> None:
    """Exit 2 and one sentence before anything starts."""
    assert said in refused(*words.split())


def test_two_runs_never_write_one_file(
    networks: dict[str, Path],
    quiet: list[Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The second is refused, however it asks, and the first ends as if it had been alone."""
    monkeypatch.chdir(tmp_path)
    words = ["run", "-n", str(networks["crossing"]), *WORDS, "-o", "r.csv"]
    first = subprocess.Popen([sys.executable, "-m", "cavsumo", *words])
    file = tmp_path / "r.csv"
    try:
        until(lambda: file.is_file() and file.read_bytes().count(b"\n") > 1, "there is a row")
        first.send_signal(signal.SIGSTOP)  # so that it is there as long as the second one
        for more in ([], ["--resume"], ["--overwrite"]):
            assert main([*words, *more]) == 2
            assert "'r.csv': another run is writing them" in capsys.readouterr().err
        first.send_signal(signal.SIGCONT)
        assert first.wait(PATIENCE_S) in (0, 1)
    finally:
        first.kill()
        first.wait()
    assert file_rows(file) == quiet_rows(quiet)
    assert read_manifest(file)["status"] == "finished"


# dask ---------------------------------------------------------------------------------------------


def new_cluster() -> Any:
    """Two dask workers of one thread each."""
    distributed = pytest.importorskip("distributed")
    return distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",
        host="127.0.0.1",
        silence_logs=50,
    )


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A cluster for several tests."""
    with new_cluster() as cluster:
        yield cluster


@pytest.fixture
def dask_words(networks: dict[str, Path]) -> Callable[[Any], list[str]]:
    """Call with a cluster for the words that play the batch there."""

    def words(cluster: Any) -> list[str]:
        there = ["--executor", "dask", "--scheduler", cluster.scheduler_address]
        return ["run", "-n", str(networks["crossing"]), *WORDS, *there]

    return words


def test_dask_plays_what_one_process_plays(
    prepared: PreparedBatch, quiet: list[Any], cluster: Any
) -> None:
    """Rows, traces and what was learned; as many at a time as the cluster has threads."""
    with opened(Means(None, "dask", cluster.scheduler_address)) as (executor, jobs):
        assert jobs == 2
        assert played(prepared, executor) == quiet


def test_a_dask_client_of_the_users_is_an_executor(prepared: PreparedBatch, cluster: Any) -> None:
    """It plays, as many at a time as it has threads, and stays open."""
    distributed = pytest.importorskip("distributed")
    with distributed.Client(cluster) as client:
        with opened(Means(executor=client)) as (executor, jobs):
            assert jobs == 2
            outcomes = run_batch(prepared, executor, range(2))
            assert [answer.outcome.row["run"] for answer in outcomes] == [0, 1]
        assert client.status == "running"


def test_a_dask_worker_that_is_killed_loses_nothing(
    quiet: list[Any],
    cluster: Any,
    dask_words: Callable[[Any], list[str]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A node fails in mid-batch: its episodes are played by another, with the same rows."""
    monkeypatch.chdir(tmp_path)
    killed: list[int] = []

    def kill() -> None:
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            if Path("results.csv").is_file() and Path("results.csv").read_bytes().count(b"\n") > 2:
                pid = next(iter(cluster.workers.values())).pid
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)
                return
            time.sleep(0.01)

    killer = threading.Thread(target=kill)
    killer.start()
    assert main(dask_words(cluster)) in (0, 1)
    killer.join()
    assert killed
    assert file_rows(Path("results.csv")) == quiet_rows(quiet)


@pytest.mark.slow
def test_a_cluster_that_goes_in_mid_batch_keeps_the_rows(
    quiet: list[Any],
    dask_words: Callable[[Any], list[str]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The scheduler's time is up: exit 3, whole rows, and --resume ends it on this machine."""
    monkeypatch.chdir(tmp_path)
    file = Path("results.csv")
    with new_cluster() as cluster:
        line = [sys.executable, "-m", "cavsumo", *dask_words(cluster)]
        with Path("stderr").open("wb") as stderr:
            process = subprocess.Popen(line, stderr=stderr)
        until(lambda: file.is_file() and file.read_bytes().count(b"\n") > 2, "there are rows")
        process.send_signal(signal.SIGSTOP)  # so that the batch is not over before the cluster is
        time.sleep(0.1)
    process.send_signal(signal.SIGCONT)
    try:
        assert process.wait(2 * PATIENCE_S) == 3, Path("stderr").read_text()
    finally:
        process.kill()
        process.wait()
    said = Path("stderr").read_text()
    assert "Traceback" not in said
    assert "cavsumo: the executor" in said.splitlines()[-1]
    assert read_manifest(file)["status"] == "broken"
    there = file_rows(file)
    assert 0 < len(there) < 2 * RUNS
    assert there == quiet_rows(quiet, len(there))
    assert main(["run", "--resume", "-q"]) in (0, 1)
    assert file_rows(file) == quiet_rows(quiet)


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as some:
        some.bind(("127.0.0.1", 0))
        port: int = some.getsockname()[1]
        return port


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:PORT", "nonsense://127.0.0.1:1"])
def test_a_scheduler_that_is_not_there_is_one_sentence(
    refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch, address: str
) -> None:
    """Exit 2 after a while, and nothing is written."""
    pytest.importorskip("distributed")
    monkeypatch.setattr("cavsumo.batch.executors.CONNECT_S", 2.0)
    there = address.replace("PORT", str(free_port()))
    said = refused("--executor", "dask", "--scheduler", there)
    assert f"scheduler {there!r}: cannot be reached" in said
