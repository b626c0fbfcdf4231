"""Tester vehicles against real SUMO: they meet the ego, drive lawfully, and are repeatable."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import prepare
from cavsumo.batch.worker import Worker
from cavsumo.errors import InputError
from cavsumo.model.scenario import plan_from
from cavsumo.results.rows import Outcome
from cavsumo.results.traces import trace_of

SetUp = Callable[..., Any]
PROGRAMMED = ["timing", "proximity", "programmed-random", "election"]


def outcomes(prepared: Any, times: int = 1) -> list[Outcome]:
    """What the episodes of a batch leave, in one process; several times over if wanted."""
    with Worker(prepared) as worker:
        todo = [run for _ in range(times) for run in prepared.plan.todo()]
        return [worker.play(job(prepared.plan, run)).outcome for run in todo]


def rows(prepared: Any, times: int = 1) -> list[dict[str, Any]]:
    """The rows of a batch."""
    return [outcome.row for outcome in outcomes(prepared, times)]


@pytest.mark.parametrize("name", ["crossing", "junction"])
def test_programmed_vehicles_meet_the_ego(set_up: SetUp, name: str) -> None:
    """With traffic, most episodes bring one within 10 m; nothing fails, nobody is teleported."""
    found = rows(set_up(name, kind="car", agents=PROGRAMMED, runs=2, routes="auto", trace="none"))
    assert len(found) == 8
    assert all(row["outcome"] != "error" for row in found), found
    assert sum(row["min_gap_m"] < 10.0 for row in found) >= 6
    assert sum(row["teleports"] for row in found) == 0


def test_timing_finds_tests(set_up: SetUp) -> None:
    """At the crossing, of 20 episodes some are tests, and some of them fail SUMO's driver."""
    found = rows(set_up("crossing", kind="car", runs=20, trace="none"))
    outcomes = [row["outcome"] for row in found]
    assert outcomes.count("held") + outcomes.count("violated") >= 4
    assert outcomes.count("unfair") <= 8


@pytest.mark.parametrize("kind", ["car", "bus", "bicycle"])
def test_the_same_seed_gives_the_same_rows(set_up: SetUp, kind: str) -> None:
    """Every kind, byte for byte but for the time that it took."""
    prepared = set_up("crossing", kind=kind, agents=["timing", "random"], runs=1)
    both = rows(prepared, times=2)
    first, second = both[:2], both[2:]
    for row in (*first, *second):
        row.pop("wall_s")
    assert first == second
    assert all(row["outcome"] != "error" for row in first)


@pytest.mark.parametrize("types", [("crossing",), ("merging",)])
def test_an_untriggered_vehicle_waits_for_good(set_up: SetUp, types: tuple[str, ...]) -> None:
    """It comes to its line and stands there while the ego passes: no test, no contact."""
    prepared = set_up(
        "crossing",
        kind="car",
        approaches=types,
        agents=["proximity"],
        params={"distance_m": 0.0},
        runs=3,
        testers=1,
        trace="all",
    )
    for outcome in outcomes(prepared):
        trace = trace_of(outcome)
        assert trace is not None
        (tester,) = trace.frames[-1]["testers"].values()
        assert tester[2] < 0.5
        assert outcome.row["outcome"] == "not_triggered"
        assert outcome.row["contacts"] == 0


def test_a_leader_that_brakes_stops_the_ego(set_up: SetUp) -> None:
    """On the straight road there is nothing but to drive ahead and brake; SUMO's driver copes."""
    found = rows(set_up(kind="car", testers=1, runs=4, params={"manoeuvre": "brake"}))
    assert all(row["min_gap_m"] < 10.0 for row in found)
    assert all(row["max_decel_mps2"] > 2.0 for row in found)
    assert sum(row["contacts"] for row in found) == 0


@pytest.mark.parametrize("types", [("following",), ("merging",)])
def test_at_the_end_of_its_way_a_vehicle_comes_to_rest(
    set_up: SetUp, types: tuple[str, ...]
) -> None:
    """Ahead of the ego it stops on the road; who crossed its way stops behind the road's end."""
    prepared = set_up(
        "pedestrians" if "following" in types else "crossing",
        kind="car",
        approaches=types,
        testers=1,
        runs=1,
        agents=["programmed-random"],
        params={"rate_per_s": 0.0 if "following" in types else 5.0},
        ego="constant",
        ego_params={"speed": 0.0},
        trace="all",
    )
    trace = trace_of(outcomes(prepared)[0])
    assert trace is not None
    (tester,) = trace.frames[-1]["testers"].values()
    assert tester[2] < 0.1
    inside = tester[0] + 2.25 <= 99.0
    assert inside or "merging" in types


def test_a_manoeuvre_that_is_impossible_here_is_refused(set_up: SetUp) -> None:
    """Nobody can cut in where there is one lane."""
    with pytest.raises(InputError, match="no adjacent way for a car"):
        set_up("crossing", kind="car", params={"manoeuvre": "cut-in"})


def test_learners_of_walking_are_given_no_vehicle(networks: dict[str, Path]) -> None:
    """And walkers no approach: one sentence each."""
    plan = {"net": networks["crossing"]}
    with pytest.raises(InputError, match="agent q-learning can only walk"):
        prepare(plan_from(plan | {"kind": "car", "agents": ["q-learning"]}, "test"))
    with pytest.raises(InputError, match="only vehicles have approaches"):
        prepare(plan_from(plan | {"approaches": ["crossing"]}, "test"))
