"""Batches in processes that may die: what a death costs, and that everything can be repeated."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from inline import played_here

from cavsumo.batch.dispatch import run_batch
from cavsumo.batch.executors import local_executor
from cavsumo.batch.jobs import job
from cavsumo.batch.messages import Answer
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.batch.worker import Worker
from cavsumo.errors import InputError
from cavsumo.model.seeds import episode_seed
from cavsumo.results.rows import Outcome
from cavsumo.results.traces import trace_of

SetUp = Callable[..., PreparedBatch]
Row = dict[str, Any]

# Fails in the episode whose first tester starts at x = doom: kills its process, hangs, or raises.
MISHAP = """
import os, signal, time
from cavsumo.egos import Acceleration

class Mishap:
    depart_speed = 6.0

    def __init__(self, how="none", doom=1e9):
        self.how, self.doom = how, doom

    def reset(self, scene):
        self.doomed = bool(scene.starts) and scene.starts[0].x == self.doom

    def act(self, snapshot):
        if self.doomed and snapshot.step == 5:
            if self.how == "crash":
                os.kill(os.getpid(), signal.SIGSEGV)
            if self.how == "hang":
                time.sleep(3600)
            if self.how == "raise":
                raise RuntimeError("lost the map")
        return Acceleration(0.0)
"""
DOOMED = 2  # the episode that fails


def answers(prepared: PreparedBatch, jobs: int = 1) -> list[Answer]:
    """The outcomes of a batch in processes of its own, with what the agents know after each."""
    with local_executor(jobs) as executor:
        return list(run_batch(prepared, executor, prepared.plan.todo()))


def answers_here(prepared: PreparedBatch, jobs: int = 1) -> list[Answer]:
    """The same in this process."""
    with played_here():
        return answers(prepared, jobs)


def played(prepared: PreparedBatch) -> list[Outcome]:
    """The outcomes of a batch."""
    return [answer.outcome for answer in answers(prepared)]


def frames(outcome: Outcome) -> list[Any]:
    """The frames of an episode's trace."""
    trace = trace_of(outcome)
    return list(trace.frames) if trace else []


def starts(outcome: Outcome) -> dict[str, Any]:
    """The first frame, without what the agents do in it."""
    return {key: value for key, value in frames(outcome)[0].items() if key != "actions"}


def lasting(outcome: Outcome) -> Row:
    """A row without the real time it took."""
    return {key: value for key, value in outcome.row.items() if key != "wall_s"}


@dataclass(frozen=True)
class Trial:
    """Plays the batch in which the doomed episode fails in some way, and the quiet one."""

    set_up: SetUp
    quiet: list[Row]
    doom: float

    def rows(self, how: str) -> list[Row]:
        """The rows of the batch in which it fails."""
        return [lasting(o) for o in played(self.set_up(how=how, doom=self.doom))]


@pytest.fixture(scope="module")
def trial(set_up: SetUp, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Trial]:
    """The undisturbed batch, played once, and how to disturb it."""
    folder = tmp_path_factory.mktemp("controllers")
    (folder / "mishap_controller.py").write_text(MISHAP, encoding="utf-8")

    def doomed(agent: str = "random", **params: Any) -> PreparedBatch:
        return set_up(
            ego="mishap_controller:Mishap",
            ego_params=params,
            agents=[agent],
            runs=5,
            testers=2,
            trace="all",
            deadline_s=2.0,
        )

    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        outcomes = [answer.outcome for answer in answers_here(doomed())]
        start = frames(outcomes[DOOMED])[0]["testers"]["tester0"][0]
        yield Trial(doomed, [lasting(o) for o in outcomes], start)


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("crash", "the simulation process died of SIGSEGV"),
        ("hang", "no answer within 2 s, killed"),
        ("raise", "ego mishap_controller:Mishap at 0.50 s: act raised RuntimeError: lost the map"),
    ],
)
def test_an_episode_that_fails_costs_its_row_and_no_other(
    trial: Trial, how: str, words: str
) -> None:
    """A crash, an endless loop, an exception: an error with its reason; the rest is as ever."""
    rows = trial.rows(how)
    assert rows[DOOMED]["outcome"] == "error"
    assert words in rows[DOOMED]["error"]
    identity = ("run", "agent", "ego", "testers", "seed")
    assert [rows[DOOMED][k] for k in identity] == [trial.quiet[DOOMED][k] for k in identity]
    assert rows[:DOOMED] + rows[DOOMED + 1 :] == trial.quiet[:DOOMED] + trial.quiet[DOOMED + 1 :]


def test_what_sumo_refuses_comes_out_before_the_first_episode(
    set_up: SetUp, tmp_path: Path
) -> None:
    """A route file with an unknown edge: no worker, one message, in SUMO's own words."""
    file = tmp_path / "bad.rou.xml"
    file.write_text('<routes><trip id="a" depart="0" from="nowhere" to="westbound"/></routes>')
    prepared = set_up(routes=file)
    with pytest.raises(InputError, match="'nowhere'"), Worker(prepared):
        pytest.fail("the worker started")


# Repeating

PAIR = {"routes": "auto", "agents": ["random", "timing"], "trace": "all"}


@pytest.fixture(scope="module")
def recorded(set_up: SetUp) -> list[Outcome]:
    """Two episodes each of two agents on a real junction, with traffic and the default ego."""
    return [a.outcome for a in answers_here(set_up("crossing", runs=2, **PAIR))]


def test_the_same_plan_twice_gives_the_same_rows_and_frames(
    set_up: SetUp, recorded: list[Outcome]
) -> None:
    """In another process, with other hash seeds and addresses: only the real time differs."""
    again = played(set_up("crossing", runs=2, **PAIR))
    assert [lasting(o) for o in again] == [lasting(o) for o in recorded]
    assert repr([frames(o) for o in again]) == repr([frames(o) for o in recorded])
    assert all(o.row["steps"] > 0 and frames(o)[-1]["background"] for o in recorded)


def test_an_episode_is_the_same_in_any_batch_and_order(
    set_up: SetUp, recorded: list[Outcome]
) -> None:
    """Run i stays what it is when more runs are asked for, and whatever was played before it."""
    prepared = set_up("crossing", runs=5, **PAIR)
    with played_here(), Worker(prepared) as worker:
        for run in (3, 0, 2, 1):
            outcome = worker.play(job(prepared.plan, run)).outcome
            assert lasting(outcome) == lasting(recorded[run])
            assert repr(frames(outcome)) == repr(frames(recorded[run]))


def test_agents_compared_meet_the_same_starts(recorded: list[Outcome]) -> None:
    """Episode by episode all agents get the same seed, and so the same testers and traffic."""
    assert [o.row["agent"] for o in recorded] == ["random", "timing"] * 2
    for a, b in (recorded[:2], recorded[2:]):
        assert a.row["seed"] == b.row["seed"]
        assert starts(a) == starts(b)
        assert repr(frames(a)[-1]) != repr(frames(b)[-1])
    assert recorded[0].row["seed"] == episode_seed(1, 0)
    assert starts(recorded[0]) != starts(recorded[2])


# Learning

SCHOOL = {"runs": 3, "testers": 2, "trace": "none", "end": 15.0}


@pytest.fixture(scope="module")
def learned(set_up: SetUp) -> list[Any]:
    """What two Q-learning testers know after each of three episodes in one process."""
    return [answer.memory for answer in answers_here(set_up(agents=["q-learning"], **SCHOOL))]


def test_learning_goes_on_in_the_next_process(set_up: SetUp, learned: list[Any]) -> None:
    """The weights are equal, whether one process played all episodes or another took over."""
    prepared = set_up(agents=["q-learning"], **SCHOOL)
    with Worker(prepared) as worker:
        answer = worker.play(job(prepared.plan, 2, learned[1]))
    outcome, memory = answer.outcome, answer.memory
    assert memory is not None
    assert outcome.row["outcome"] != "error"
    assert memory == learned[2]
    assert [m["episodes"] for m in memory] == [3, 3]
    assert learned[0] != learned[1] != learned[2]
    assert any(memory[0]["weights"].values())


def test_a_death_loses_one_episode_and_not_the_training(trial: Trial) -> None:
    """The process dies in the third episode: the fourth goes on from what the second taught."""
    prepared = trial.set_up("q-learning", how="crash", doom=trial.doom)
    memories = [answer.memory for answer in answers(prepared)]
    assert [memory[0]["episodes"] for memory in memories] == [1, 2, 2, 3, 4]
    assert memories[DOOMED] == memories[DOOMED - 1]
    assert memories[DOOMED + 1] != memories[DOOMED]


def test_a_learner_learns_from_its_own_episodes_only(set_up: SetUp, learned: list[Any]) -> None:
    """Beside another agent it knows as much after each of its episodes as it does alone."""
    prepared = set_up(agents=["random", "q-learning"], **SCHOOL)
    memories = [answer.memory for answer in answers_here(prepared, jobs=2)]
    assert memories[1::2] == learned
    assert memories[0::2] == [None, None, None]
