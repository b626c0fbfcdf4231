"""Searches over decisions without SUMO: their space, the tree, the archive, and the walk itself."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from cavsumo.agents import Scene
from cavsumo.agents.decisions import DECISION_S, Decision, Decisions, Situation, read, written
from cavsumo.agents.searched import SearchAgent
from cavsumo.model.bodies import PEDESTRIAN
from cavsumo.model.kinematics import step_floats
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.site import Site
from cavsumo.searchers.decision_space import DECISIONS, DecisionSpace
from cavsumo.searchers.explore import ExploreSearch
from cavsumo.searchers.protocol import PlayedPoint
from cavsumo.searchers.space import Point, space_of
from cavsumo.searchers.tree import GROWTH, WIDTH, TreeSearch

LANE, SOUTH, EGO_MPS = -1.825, -5.15, 8.0
DEEP = 4  # right decisions in sequence that make a failure


@pytest.fixture
def space(staged: Callable[..., tuple[BatchPlan, Site]]) -> DecisionSpace:
    """One pedestrian on the straight road."""
    return DecisionSpace(space_of(staged("pedestrians")[1], PEDESTRIAN, ((0,),)))


def _deep(space: DecisionSpace, point: Point) -> PlayedPoint:
    """A failure behind so many right decisions in sequence; the situation says how many there were.

    Right is to walk when the number of right ones is even, and to stand when it is odd.
    """
    situations, right = list[Situation](), 0
    for _, speed in space.rows(point)[1:]:
        situations.append((right, 0, 0))
        if (speed > 0.6) != (right % 2 == 0):
            break
        right += 1
    return PlayedPoint(right - DEEP - 0.5, right > DEEP, (), tuple(situations))


def _searched(searcher: TreeSearch | ExploreSearch, generations: int) -> list[float]:
    """The grades of the points, in the order in which they were asked for."""
    grades = []
    for _ in range(generations):
        points = searcher.ask()
        told = [_deep(searcher.space, point) for point in points]
        searcher.tell(points, told)
        grades += [one.grade for one in told]
    return grades


@pytest.mark.parametrize("sort", [TreeSearch, ExploreSearch])
def test_a_sequence_that_chance_does_not_find_is_found_step_by_step(
    space: DecisionSpace, sort: type[TreeSearch] | type[ExploreSearch]
) -> None:
    """Of as many points by chance hardly any is a failure; of the later points many are."""
    rng = np.random.default_rng(2)
    none = np.empty((0, space.width))
    blind = [_deep(space, space.completed(rng, none)).failed for _ in range(300)]
    late = _searched(sort(space, np.random.default_rng(1)), 30)[150:]
    assert np.mean([grade > 0.0 for grade in late]) > 3.0 * np.mean(blind) + 0.1


def test_a_point_that_begins_like_another_one_repeats_it(space: DecisionSpace) -> None:
    """What follows is drawn; start and decisions so far are the same for the agent."""
    rng = np.random.default_rng(4)
    first = space.completed(rng, np.empty((0, space.width)))
    second = space.completed(rng, space.rows(first)[:4])
    (one,), (other,) = space.memories(first), space.memories(second)
    assert one["starts"] == other["starts"]
    (before, after) = one["programmes"][0], other["programmes"][0]
    assert before["arrival"] == after["arrival"]
    chosen, chosen_2 = before["chosen"], after["chosen"]
    assert chosen[:3] == chosen_2[:3]
    assert chosen[3:] != chosen_2[3:]
    assert len(chosen) == DECISIONS
    assert all(v == 0.0 or 0.3 <= v <= PEDESTRIAN.v_max for _, v in chosen)


def test_the_tree_widens_with_its_visits(space: DecisionSpace) -> None:
    """Few starts are tried, each more and more often; points of one generation do not count."""
    searcher, starts = TreeSearch(space, np.random.default_rng(1)), set[tuple[float, ...]]()
    for asked in range(10, 310, 10):
        points = searcher.ask()
        starts |= {tuple(space.rows(point)[0]) for point in points}
        assert len(starts) <= WIDTH * asked**GROWTH + 10
        searcher.tell(points, [_deep(space, point) for point in points])


def test_explore_returns_to_situations_and_goes_on(space: DecisionSpace) -> None:
    """Every later point begins like one that was played before."""
    searcher, played = ExploreSearch(space, np.random.default_rng(1)), list[NDArray[np.float64]]()
    for generation in range(8):
        points = searcher.ask()
        begun = [any(np.array_equal(space.rows(p)[0], r[0]) for r in played) for p in points]
        assert generation < 2 or sum(begun) >= 5
        searcher.tell(points, [_deep(space, point) for point in points])
        played += [space.rows(point) for point in points]


def test_situations_are_read_as_they_were_written() -> None:
    """Negative ones too; an empty cell is none."""
    situations = [(15, 4, -3), (0, -1, 2)]
    assert read(written(situations)) == situations
    assert read("") == []


def test_a_walk_does_what_was_decided(straight_scene: Callable[..., Scene]) -> None:
    """It stands until the ego is as near as it says, walks, stands, walks on; 1 s each."""
    scene = straight_scene([(60.0, SOUTH, math.pi / 2)])
    arrival, v = 5.0, 1.2
    chosen = [Decision(0.0, v), Decision(0.0, 0.0), Decision(0.0, v)]
    agent = SearchAgent()
    agent.remember({"starts": [], "programmes": [Decisions(arrival, chosen)._asdict()]})
    agent.reset(scene, [0], np.random.default_rng(1))
    start, states = scene.starts[0], list[BodyState]()
    state = BodyState(scene.bodies[0], start.x, start.y, 0.0, start.o)
    for step in range(95):
        time = step * scene.dt
        ego = BodyState(scene.ego, EGO_MPS * time, LANE, EGO_MPS, 0.0)
        (action,) = agent.choose_action(Snapshot(step, time, ego, 0.0, (state,)))
        states.append(state)
        limits = PEDESTRIAN.wheelbase, PEDESTRIAN.v_min, PEDESTRIAN.v_max
        moved = step_floats(*state[1:], *action, *limits, scene.dt)
        state = BodyState(scene.bodies[0], *moved)
    begun = round((60.0 / EGO_MPS - arrival) / scene.dt)
    second = round(DECISION_S / scene.dt)
    at_kerb = states[begun].y
    assert states[begun].v == 0.0
    assert states[begun + second].v == pytest.approx(v)
    assert states[begun + 2 * second].v == 0.0
    assert states[begun + 3 * second].v == pytest.approx(v)
    assert states[begun + second].y - at_kerb == pytest.approx(v * (DECISION_S - 0.3), abs=0.25)
    assert states[-1].y > at_kerb + 2.0
    gaps = [gap for gap, _, _ in read(agent.notes())]
    assert len(gaps) == len(chosen)
    assert all(one > other for one, other in itertools.pairwise(gaps))
