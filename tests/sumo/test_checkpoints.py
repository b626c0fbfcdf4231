"""Failures judged from forks: the verdicts of reruns from the start, and nothing is left."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.egos.external.ego import ExternalEgo
from cavsumo.egos.reference import REFERENCES
from cavsumo.model import forks
from cavsumo.results.rows import Outcome
from cavsumo.simulation import avoidability, checkpoints
from cavsumo.simulation.avoidability import AvoidabilityCheck, preventable
from cavsumo.simulation.loop import play

SetUp = Callable[..., PreparedBatch]
Patch = pytest.MonkeyPatch
CONSTANT: dict[str, Any] = {"ego": "constant", "ego_params": {"speed": 7.0}, "reference": "ideal"}
# Egos with and without traffic, through which the constant one drives; testers of both kinds.
BATCHES: dict[str, dict[str, Any]] = {
    "pedestrians": CONSTANT | {"agents": ["timing"], "testers": 3},
    "junction": CONSTANT | {"agents": ["timing"], "testers": 3, "routes": "auto"},
    "crossing": {
        "agents": ["timing"],
        "kind": "car",
        "assertions": ["ttc"],
        "routes": "auto",
        "reference": "human",
        "end": 15.0,
    },
}


def with_forks(patch: Patch, *, at_start: bool) -> None:
    """Failures are judged by forks, wherever that pays."""
    for module in (avoidability, checkpoints):
        patch.setattr(module, "can_fork", lambda: True)
        patch.setattr(module, "cost_of_fork", lambda: 0.0)
    patch.setattr(checkpoints, "QUICK_S", 0.0)
    patch.setattr(avoidability, "SLOW_S", 0.0)
    if not at_start:
        patch.setattr(checkpoints, "cost_of_fork", lambda: math.inf)


def outcomes(runner: EpisodeRunner, runs: int) -> tuple[list[Outcome], list[int]]:
    """The rows of episodes but for the time they took, and how many simulations each asked for."""
    found, begun = [], []
    for run in range(runs):
        beats: list[None] = []
        outcome = runner.play(job(runner.plan, run), lambda beats=beats: beats.append(None)).outcome
        del outcome.row["wall_s"]
        found.append(outcome)
        begun.append(len(beats))
    return found, begun


@pytest.mark.parametrize("name", BATCHES)
def test_verdicts_are_those_of_reruns_from_the_start(
    set_up: SetUp, name: str, monkeypatch: Patch
) -> None:
    """Bit for bit: whether, until when, which note; by forks of a rerun, and of the episode."""
    runs = 2 if name == "crossing" else 4  # there the first two have both verdicts, and take long
    with EpisodeRunner(set_up(name, **BATCHES[name])) as runner:
        monkeypatch.setattr(avoidability, "can_fork", lambda: False)
        monkeypatch.setattr(checkpoints, "can_fork", lambda: False)
        replayed, _ = outcomes(runner, runs)
        with_forks(monkeypatch, at_start=False)
        forked, _ = outcomes(runner, runs)
        with_forks(monkeypatch, at_start=True)
        kept, asked = outcomes(runner, runs)
    assert any(outcome.row["avoidable"] is not None for outcome in replayed)
    assert forked == replayed
    assert kept == replayed
    assert set(asked) <= {0, 1}, "with a checkpoint no simulation is begun again"


def test_whether_it_is_preventable_takes_one_rerun(set_up: SetUp, monkeypatch: Patch) -> None:
    """The same answer as the whole judgement, for a driver who is in time and one who is not."""
    with EpisodeRunner(set_up("pedestrians", **BATCHES["pedestrians"])) as runner:
        answers = set()
        for run in range(4):
            own = job(runner.plan, run)
            agents, beats = runner.agents_of(own), list[None]()
            episode = play(runner.setup, agents, own.seed, keep=True)
            check = AvoidabilityCheck(
                runner.setup, agents, own.seed, False, episode, lambda b=beats: b.append(None)
            )
            for name in ("ideal", "human"):
                reference = REFERENCES.make(name, {})
                del beats[:]
                short = preventable(check, reference)
                assert len(beats) <= 1
                assert short == check.judged(reference).avoidable
                answers.add(short)
    assert answers == {True, False}


def test_forks_that_fail_are_replaced_by_reruns(set_up: SetUp, monkeypatch: Patch) -> None:
    """A fork that dies costs time and no verdict."""
    with EpisodeRunner(set_up("pedestrians", **BATCHES["pedestrians"])) as runner:
        monkeypatch.setattr(avoidability, "can_fork", lambda: False)
        monkeypatch.setattr(checkpoints, "can_fork", lambda: False)
        replayed, _ = outcomes(runner, 2)
        with_forks(monkeypatch, at_start=True)
        monkeypatch.setattr(forks, "outcome", lambda work: os._exit(3))
        assert outcomes(runner, 2)[0] == replayed


def test_checkpoints_leave_nothing(set_up: SetUp, monkeypatch: Patch) -> None:
    """Neither processes nor descriptors, with failures, without, and with errors."""
    with EpisodeRunner(set_up("crossing", agents=["timing"], testers=1)) as runner:
        outcomes(runner, 1)
        here = Path("/proc/self")

        def resources() -> tuple[str, int]:
            children = (here / "task" / str(os.getpid()) / "children").read_text()
            return children, len(list((here / "fd").iterdir()))

        before = resources()
        with_forks(monkeypatch, at_start=True)
        outcomes(runner, 3)
        monkeypatch.setattr("cavsumo.simulation.loop.EpisodeLoop.step", lambda _: 1 / 0)
        (failed,), _ = outcomes(runner, 1)
        assert failed.row["outcome"] == "error"
        assert resources() == before


def test_an_ego_outside_is_judged_by_reruns_alone(set_up: SetUp, monkeypatch: Patch) -> None:
    """Its conversation is one, and a fork would speak in it too."""
    with_forks(monkeypatch, at_start=True)

    def no(*_: object, **__: object) -> None:
        raise AssertionError("forked")

    monkeypatch.setattr(forks.os, "fork", no)
    with EpisodeRunner(set_up("pedestrians", **BATCHES["pedestrians"])) as runner:
        monkeypatch.setattr(type(runner.setup.ego), "outside", ExternalEgo.outside)
        found, asked = outcomes(runner, 2)
    assert max(asked) >= 2
    assert all(outcome.row["avoidable"] is not None for outcome in found)
