"""A process that simulates and may die, stop, or not come up: what its owner gets then."""

from __future__ import annotations

import dataclasses
import errno
import os
import pickle
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import pytest
from support import PATIENCE_S, alive, until, workers_of

from cavsumo.batch import worker_process
from cavsumo.batch.jobs import job
from cavsumo.batch.messages import Reply, Task
from cavsumo.batch.prepared import PreparedBatch, prepare
from cavsumo.batch.worker import Worker
from cavsumo.errors import BatchError, InputError
from cavsumo.model.scenario import plan_from
from cavsumo.results.rows import Outcome

# An ego with a child of its own, whose number it leaves in a file; it waits while ``wait`` exists.
PARENT = """
import subprocess, sys, time
from pathlib import Path
from cavsumo.egos import Acceleration

class Parent:
    depart_speed = 6.0

    def __init__(self, folder):
        self.folder = Path(folder)
        self.child = None

    def reset(self, scene):
        if scene.starts and self.child is None:
            self.child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(3600)"])
            new = self.folder / "new"
            new.write_text(str(self.child.pid))
            new.replace(self.folder / "child")
        while scene.starts and (self.folder / "wait").exists():
            time.sleep(0.01)

    def act(self, snapshot):
        return Acceleration(0.0)
"""


def only_child() -> int:
    """The one process that simulates for this one."""
    (pid,) = workers_of(os.getpid())
    return pid


def lasting(outcome: Outcome) -> dict[str, Any]:
    """A row without the real time it took."""
    return {key: value for key, value in outcome.row.items() if key != "wall_s"}


@pytest.fixture(scope="module")
def prepared(networks: dict[str, Path]) -> PreparedBatch:
    """Short episodes on the straight road, which must be answered within two seconds."""
    chosen = {"net": networks["pedestrians"], "routes": "none", "end": 3.0, "trace": "none"}
    chosen |= {"agents": ["random"], "runs": 3, "testers": 1, "deadline_s": 2.0}
    return prepare(plan_from(chosen, "test"))


@pytest.fixture(scope="module")
def quiet(prepared: PreparedBatch) -> list[dict[str, Any]]:
    """The rows of its batch, undisturbed."""
    with Worker(prepared) as worker:
        return [lasting(worker.play(job(prepared.plan, run)).outcome) for run in range(3)]


@pytest.fixture(autouse=True)
def nobody_left() -> Iterator[None]:
    """No test leaves a process behind."""
    before = workers_of(os.getpid())
    yield
    assert workers_of(os.getpid()) == before


def test_a_batch_is_packed_once_for_all_its_processes(prepared: PreparedBatch) -> None:
    """What came from another process goes on to a third one in the same bytes."""
    here = pickle.loads(pickle.dumps(prepared))
    assert (here.plan, here.cast) == (prepared.plan, prepared.cast)
    assert here.key == prepared.key
    assert here.packed == prepared.packed
    assert dataclasses.replace(here, folder="elsewhere").packed != prepared.packed


# Dying --------------------------------------------------------------------------------------------


def test_a_process_killed_while_it_waits_costs_one_row_at_most(
    prepared: PreparedBatch, quiet: list[dict[str, Any]]
) -> None:
    """Nothing was under way: the next episode is played by another process, or is an error."""
    with Worker(prepared) as worker:
        first = worker.play(job(prepared.plan, 0)).outcome
        pid = only_child()
        os.kill(pid, signal.SIGKILL)
        until(lambda: not alive(pid), "it is dead")
        second = worker.play(job(prepared.plan, 1)).outcome
        third = worker.play(job(prepared.plan, 2)).outcome
        assert only_child() != pid
    assert lasting(first) == quiet[0]
    assert second.row["outcome"] == "error" or lasting(second) == quiet[1]
    assert lasting(third) == quiet[2]


def test_a_process_that_dies_at_its_start_is_started_again(
    prepared: PreparedBatch, quiet: list[dict[str, Any]]
) -> None:
    """Killed twice before it could say that it is ready: the third one plays."""
    with_killed: list[int] = []

    def kill_two() -> None:
        end = time.monotonic() + PATIENCE_S
        while len(with_killed) < 2 and time.monotonic() < end:
            for pid in workers_of(os.getpid()):
                if pid not in with_killed:
                    os.kill(pid, signal.SIGKILL)
                    with_killed.append(pid)
                    break
            time.sleep(0.01)

    killer = threading.Thread(target=kill_two)
    killer.start()
    with Worker(prepared) as worker:
        killer.join()
        outcome = worker.play(job(prepared.plan, 1)).outcome
        assert only_child() not in with_killed
    assert len(with_killed) == 2
    assert lasting(outcome) == quiet[1]


def test_a_process_that_never_comes_up_ends_the_batch(prepared: PreparedBatch) -> None:
    """Killed at every start: one error that says how it died, and no endless restarting."""
    over = threading.Event()
    killed: list[int] = []

    def kill_all() -> None:
        while not over.wait(0.01):
            for pid in workers_of(os.getpid()):
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)

    killer = threading.Thread(target=kill_all)
    killer.start()
    try:
        with pytest.raises(InputError, match="process died of SIGKILL"), Worker(prepared):
            pytest.fail("it started")
    finally:
        over.set()
        killer.join()
    assert 2 <= len(set(killed)) <= 5


def test_a_process_that_stopped_is_an_error_and_is_replaced(
    prepared: PreparedBatch, quiet: list[dict[str, Any]]
) -> None:
    """SIGSTOP, or a machine that swaps for ever: no answer in time is an answer."""
    with Worker(prepared) as worker:
        worker.play(job(prepared.plan, 0))
        pid = only_child()
        os.kill(pid, signal.SIGSTOP)
        second = worker.play(job(prepared.plan, 1)).outcome
        assert not alive(pid)
        third = worker.play(job(prepared.plan, 2)).outcome
    assert second.row["outcome"] == "error"
    assert second.row["error"] == "no answer within 2 s, killed"
    assert second.row["wall_s"] >= 2.0
    assert lasting(third) == quiet[2]


def test_closing_ends_an_episode_that_another_thread_waits_for(
    prepared: PreparedBatch, controller: Callable[..., str], tmp_path: Path
) -> None:
    """A batch that is given up does not wait for its hanging episode."""
    (tmp_path / "wait").touch()
    held = held_setting(prepared, controller(PARENT), tmp_path)
    said: list[str] = []

    def play() -> None:
        try:
            said.append(worker.play(job(held.plan, 0)).outcome.row["error"])
        except BatchError as error:
            said.append(str(error))

    with Worker(held) as worker:
        thread = threading.Thread(target=play)
        thread.start()
        until((tmp_path / "child").exists, "the episode hangs")
    thread.join(PATIENCE_S)
    assert not thread.is_alive()
    assert said == ["the simulation process died of SIGKILL"]
    with pytest.raises(BatchError):
        worker.play(job(held.plan, 1))


def held_setting(prepared: PreparedBatch, module: str, folder: Path) -> PreparedBatch:
    """The batch with an ego that has a child process."""
    chosen = {"net": prepared.plan.scenario.net, "routes": "none", "end": 3.0, "trace": "none"}
    chosen |= {"agents": ["random"], "testers": 1, "deadline_s": 600.0}
    chosen |= {"ego": f"{module}:Parent", "ego_params": {"folder": str(folder)}}
    return prepare(plan_from(chosen, "test"))


def test_the_children_of_a_controller_die_with_its_process(
    prepared: PreparedBatch, controller: Callable[..., str], tmp_path: Path
) -> None:
    """A user's controller that starts a program of its own leaves none behind, hour after hour."""
    held = held_setting(prepared, controller(PARENT), tmp_path)
    with Worker(held) as worker:
        outcome = worker.play(job(held.plan, 0)).outcome
        assert outcome.row["outcome"] != "error", outcome.row["error"]
        first = int((tmp_path / "child").read_text())
        assert alive(first)
        os.kill(only_child(), signal.SIGKILL)
        worker.play(job(held.plan, 1))
        worker.play(job(held.plan, 2))
        until(lambda: not alive(first), "the child of the killed process is gone")
        second = int((tmp_path / "child").read_text())
        assert second != first
        assert alive(second)
    until(lambda: not alive(second), "the child of the last process is gone")


def test_what_a_killed_process_had_on_the_disk_goes(
    prepared: PreparedBatch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Temporary files of processes that could not tidy up: a long batch does not fill the disk."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with Worker(prepared) as worker:
        worker.play(job(prepared.plan, 0))
        (folder,) = tmp_path.glob("cavsumo-worker-*")
        (folder / "left").write_text("what a killed process left", encoding="utf-8")
        os.kill(only_child(), signal.SIGKILL)
        for run in (1, 2):  # the kill may cost the first of them
            worker.play(job(prepared.plan, run))
        assert not folder.exists()
        (folder,) = tmp_path.glob("cavsumo-worker-*")
        (folder / "left").write_text("what is left at the end", encoding="utf-8")
    assert list(tmp_path.iterdir()) == []


# Not the same files any more ----------------------------------------------------------------------


@pytest.fixture
def copied(prepared: PreparedBatch, tmp_path: Path) -> PreparedBatch:
    """The batch on a network file of its own."""
    net = tmp_path / "town.net.xml"
    shutil.copy(prepared.plan.scenario.net, net)
    chosen = {"net": net, "routes": "none", "end": 3.0, "agents": ["random"], "testers": 1}
    return prepare(plan_from({**chosen, "runs": 3, "trace": "none"}, "test"))


def vanish(net: Path) -> None:
    """The file is removed."""
    net.unlink()


def change(net: Path) -> None:
    """The file is edited."""
    net.write_text(net.read_text(encoding="utf-8") + "<!-- edited -->\n", encoding="utf-8")


@pytest.mark.parametrize("happens", [vanish, change])
def test_a_network_that_changes_in_mid_batch_ends_the_batch(
    copied: PreparedBatch, happens: Callable[[Path], None]
) -> None:
    """A process that cannot be replaced is no error row after another until morning."""
    net = copied.plan.scenario.net
    with Worker(copied) as worker:
        worker.play(job(copied.plan, 0))
        happens(net)
        os.kill(only_child(), signal.SIGKILL)

        def play_on() -> None:
            for run in (1, 2):  # the kill may cost the first of them
                worker.play(job(copied.plan, run))

        with pytest.raises(BatchError, match="no process to simulate in") as caught:
            play_on()
        assert net.name in str(caught.value)


def test_a_process_that_sees_other_files_says_which(copied: PreparedBatch) -> None:
    """On a machine with another network of the same name nothing is played."""
    net = copied.plan.scenario.net
    change(net)
    with pytest.raises(InputError) as caught, Worker(copied):
        pytest.fail("it started")
    assert f"{net} is " in str(caught.value)
    assert "expected " + copied.checksums[str(net)] in str(caught.value)


def test_a_process_with_another_version_says_which(prepared: PreparedBatch) -> None:
    """On a machine with another SUMO nothing is played."""
    other = dataclasses.replace(prepared, versions={**prepared.versions, "libsumo": "1.0.0"})
    with pytest.raises(InputError, match=r"libsumo is .* expected 1\.0\.0"), Worker(other):
        pytest.fail("it started")


def test_a_folder_that_is_gone_is_one_sentence(prepared: PreparedBatch, tmp_path: Path) -> None:
    """The working folder of the batch is not there on this machine: named."""
    folder = str(tmp_path / "elsewhere")
    other = dataclasses.replace(prepared, folder=folder)
    with pytest.raises(InputError, match="elsewhere"), Worker(other):
        pytest.fail("it started")


# Idling -------------------------------------------------------------------------------------------

LOG = 2  # the descriptor to which SUMO would print


def test_a_process_with_nothing_to_do_says_goodbye(
    prepared: PreparedBatch, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It goes by itself after a while, so that dask workers and open sessions hold no SUMO."""
    monkeypatch.setattr(worker_process, "IDLE_S", 0.2)
    ours, theirs = Pipe()
    serving = threading.Thread(target=worker_process._serve, args=(theirs, Task(prepared), LOG))
    serving.start()
    try:
        assert ours.poll(PATIENCE_S)
        assert ours.recv() == Reply("ready")
        assert ours.poll(PATIENCE_S)
        assert ours.recv() == Reply("goodbye")
    finally:
        ours.close()
        serving.join(PATIENCE_S)
    assert not serving.is_alive()


def test_a_refusal_of_the_system_is_in_words(
    prepared: PreparedBatch, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file and the reason, without a number."""

    def full(_: PreparedBatch) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "types.add.xml")

    monkeypatch.setattr(PreparedBatch, "check_here", full)
    ours, theirs = Pipe()
    worker_process._serve(theirs, Task(prepared), LOG)
    assert ours.recv() == Reply("refused", "'types.add.xml': No space left on device")


# Makes every new process idle for a short time only; Python runs it before anything else.
IMPATIENT = """
import sys
from pathlib import Path

name = "cavsumo.batch.worker_process"
if name in sys.orig_argv:
    import cavsumo
    source = (Path(cavsumo.__file__).parent / "batch" / "worker_process.py").read_text()
    assert "IDLE_S = 60.0" in source
    sys.argv = sys.orig_argv[sys.orig_argv.index(name):]
    exec(source.replace("IDLE_S = 60.0", "IDLE_S = 0.2"), {"__name__": "__main__"})
    sys.exit()
"""


def test_a_process_that_said_goodbye_is_replaced_without_loss(
    prepared: PreparedBatch,
    quiet: list[dict[str, Any]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """After a pause longer than it idles the next episode is played as if there had been none."""
    (tmp_path / "sitecustomize.py").write_text(IMPATIENT, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    with Worker(prepared) as worker:
        for run in range(3):
            pid = only_child() if run else None
            until(lambda p=pid: p is None or not alive(p), "it went by itself")
            outcome = worker.play(job(prepared.plan, run)).outcome
            assert lasting(outcome) == quiet[run]
