"""Jobs played in forks: the same answers, a row for a crash, and nothing left behind."""

from __future__ import annotations

import dataclasses
import os
import signal
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest
from support import ROOT

from cavsumo.agents.programmed import TimingAgent
from cavsumo.batch import episode_server
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.episode_server import EpisodeServer
from cavsumo.batch.jobs import job
from cavsumo.batch.messages import Answer
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.model.fork_child import places
from cavsumo.model.offspring import children

Patch = pytest.MonkeyPatch
Serve = Callable[..., AbstractContextManager["Served"]]
HERE = os.getpid()
BLIND: dict[str, Any] = {"ego": "constant", "ego_params": {"speed": 7.0}, "testers": 2}


class Served:
    """A server, and how often it played without a fork."""

    def __init__(self, runner: EpisodeRunner, deadline: float, log: int) -> None:
        self.plan, self.here = runner.plan, 0
        self._server = EpisodeServer(runner, deadline, (2, log), frozenset(places()))
        play = runner.play

        def counted(*told: Any, **how: Any) -> Answer:
            self.here += os.getpid() == HERE
            return play(*told, **how)

        runner.play = counted  # type: ignore[method-assign]

    def answers(self, runs: int, first: int = 0) -> list[Answer]:
        """The answers of some jobs, without the real time."""
        found = []
        for run in range(first, first + runs):
            found.append(self._server.play(job(self.plan, run), lambda: None))
            found[-1].outcome.row["wall_s"] = None
        return found


@pytest.fixture
def serve(set_up: Callable[..., PreparedBatch], monkeypatch: Patch) -> Serve:
    """Call like ``set_up`` for a server of a network that counts as large."""

    @contextmanager
    def serving(
        name: str = "pedestrians", deadline: float = 60.0, large: int = 0, **settings: Any
    ) -> Iterator[Served]:
        monkeypatch.setattr(episode_server, "LARGE", large)
        idle = threading.active_count()  # those of other tests' workers hold nothing
        monkeypatch.setattr(episode_server, "can_fork", lambda: threading.active_count() == idle)
        with tempfile.TemporaryFile() as log, EpisodeRunner(set_up(name, **settings)) as runner:
            runner.try_out()
            yield Served(runner, deadline, log.fileno())

    return serving


def misbehaving(patch: Patch, deed: Callable[[], object], seed: int | None = None) -> None:
    """Have agents do something in forks, in the episode of one seed or in all."""
    choose = TimingAgent.choose_action

    def choose_action(self: TimingAgent, snapshot: Any) -> Any:
        if os.getpid() != HERE and seed in (None, self.scene.seed):
            deed()
        return choose(self, snapshot)

    patch.setattr(TimingAgent, "choose_action", choose_action)


def held() -> tuple[list[int], set[int]]:
    """The children and the open descriptors of this process."""
    return children(HERE), set(places())


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("pedestrians", BLIND),
        ("crossing", {"routes": "auto", "trace": "all"}),
        ("junction", {"traffic": "6,3", "kind": "car"}),
        ("pedestrians", {"agents": ["q-learning"], "reference": "none"}),
    ],
)
def test_answers_are_those_without_forks(
    serve: Serve, monkeypatch: Patch, name: str, settings: dict[str, Any]
) -> None:
    """Rows, traces, judgements of failures and what is learned, to the last bit."""
    with serve(name, **settings) as server:
        forked = server.answers(5)
        assert server.here == 1
    with serve(name, **settings) as server:
        monkeypatch.setattr(episode_server, "can_fork", lambda: False)
        started = server.answers(5)
        assert server.here == 5
    assert "threads" in started[1].note
    assert forked == [dataclasses.replace(answer, note="") for answer in started]
    if settings is BLIND:
        assert any(answer.outcome.row["avoidable"] is not None for answer in forked[1:])


def test_a_small_network_has_no_forks(serve: Serve) -> None:
    """A start is as quick there, and nothing is said."""
    with serve(large=10_000) as server:
        assert not any(answer.note for answer in server.answers(3))
        assert server.here == 3


def test_a_crash_costs_one_row(serve: Serve, monkeypatch: Patch) -> None:
    """The words are those of a process that died; the next job is played."""
    with serve() as server:
        server.answers(2)
        before = held()
        seed = job(server.plan, 2).seed
        misbehaving(monkeypatch, lambda: os.kill(os.getpid(), signal.SIGSEGV), seed)
        broken, good = server.answers(2, 2)
        assert broken.outcome.row["error"] == "the simulation process died of SIGSEGV"
        assert good.outcome.row["outcome"] != "error"
        assert server.here == 1
        assert held() == before


def test_a_hang_costs_one_row(serve: Serve, monkeypatch: Patch) -> None:
    """It is killed at its deadline, with what it had started."""
    with serve(deadline=2.0) as server:
        server.answers(2)
        before = held()
        seed = job(server.plan, 2).seed

        def hang() -> None:
            if os.fork() == 0:
                os.setsid()
            time.sleep(600.0)

        misbehaving(monkeypatch, hang, seed)
        broken, good = server.answers(2, 2)
        assert broken.outcome.row["error"] == "no answer within 2 s, killed"
        assert good.outcome.row["outcome"] != "error"
        assert held() == before


@pytest.mark.parametrize("end", [os.abort, lambda: os._exit(3)], ids=["abort", "exit"])
def test_what_ends_otherwise_is_played_without_a_fork(
    serve: Serve, monkeypatch: Patch, end: Callable[[], object]
) -> None:
    """SUMO aborts where an error of its own reaches nobody; without a fork it says which."""
    with serve() as server:
        expected = server.answers(4)
    with serve() as server:
        server.answers(2)
        misbehaving(monkeypatch, end, job(server.plan, 2).seed)
        assert server.answers(2, 2) == expected[2:]
        assert server.here == 2


def test_who_plays_otherwise_in_a_fork_is_played_without(serve: Serve, monkeypatch: Patch) -> None:
    """The first job is compared, and all are then played as the first was."""
    with serve() as server:
        expected = server.answers(3)
    with serve(agents=["timing"]) as server:
        misbehaving(monkeypatch, lambda: 1 / 0)
        answers = server.answers(3)
        assert [answer.outcome for answer in answers] == [a.outcome for a in expected]
        assert [answer.note for answer in answers] == ["", "run 0 is another one in a fork", ""]
        assert server.here == 3


def test_threads_and_connections_are_not_forked(serve: Serve) -> None:
    """A fork would lack the ones and must not share the others."""
    done = threading.Event()
    with serve() as server, socket.socket():
        assert [answer.note for answer in server.answers(3)] == [
            "", "agents, ego or assertions hold a connection or a file open", ""
        ]  # fmt: skip
    with serve() as server:
        server.answers(2)
        thread = threading.Thread(target=done.wait)
        thread.start()
        server.answers(1, 2)
        done.set()
        thread.join()
        server.answers(1, 3)
        assert server.here == 2


def test_an_ego_in_another_process_is_not_forked(serve: Serve) -> None:
    """It has one conversation."""
    ego = f"exec:{sys.executable} {ROOT / 'examples/egos/stop_for_pedestrians.py'}"
    with serve(ego=ego) as server:
        assert "another process" in server.answers(2)[1].note


def test_a_demand_that_must_be_there_at_the_start(serve: Serve, tmp_path: Path) -> None:
    """It is said once why every episode starts SUMO."""
    file = tmp_path / "x.rou.xml"
    file.write_text(
        '<routes><flow id="f" begin="0" end="9" probability="0.1" from="westbound" '
        'to="westbound"/></routes>'
    )
    with serve(routes=str(file)) as server:
        assert [answer.note for answer in server.answers(3)] == [
            "", "flow 'f' has random departures", ""
        ]  # fmt: skip
