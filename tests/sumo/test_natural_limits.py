"""Natural limits of searched tests (docs/search.md): what bodies do at random points."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import groupby, pairwise

import numpy as np
import pytest

from cavsumo.agents.driving import HASTE_MPS2
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.model.kinematics import wrap
from cavsumo.model.snapshot import BodyState
from cavsumo.simulation.loop import EpisodeLoop, played_on
from cavsumo.simulation.setup import make_setup

Tracks = list[list[BodyState]]
POINTS = 12
ROUNDING = 1e-6


@pytest.fixture(scope="module")
def tracks(set_up: Callable[..., PreparedBatch]) -> Callable[[str], Tracks]:
    """Call with a kind of body: its states in every timestep, at random points."""
    played: dict[str, Tracks] = {}

    def played_by(kind: str) -> Tracks:
        if kind not in played:
            net = "pedestrians" if kind == "pedestrian" else "crossing"
            played[kind] = _played(
                set_up(net, kind=kind, agents=["search"], testers=1, ego="constant")
            )
        return played[kind]

    return played_by


def _played(prepared: PreparedBatch) -> Tracks:
    """The states of the tester at points drawn at random."""
    setup, rng = make_setup(prepared.plan.scenario, prepared.site), np.random.default_rng(7)
    found = []
    for seed in range(POINTS):
        agents = prepared.cast.agents("search")
        point = rng.random(prepared.space.dimension)
        for agent, memory in zip(agents, prepared.space.memories(point), strict=True):
            agent.remember(memory)
        episode = played_on(EpisodeLoop(setup, agents, seed, record=True))
        found.append([snapshot.testers[0] for snapshot in episode.seen])
    setup.close()
    return found


@pytest.mark.parametrize("kind", ["pedestrian", "bicycle", "car"])
def test_nobody_is_faster_than_its_kind_or_jumps(
    tracks: Callable[[str], Tracks], kind: str
) -> None:
    """The way of a timestep is that of the speed, which is between 0 and the highest one."""
    for track in tracks(kind):
        for before, after in pairwise(track):
            assert 0.0 <= after.v <= after.body.kind.v_max
            way = math.dist((before.x, before.y), (after.x, after.y))
            assert way <= before.v * 0.1 + ROUNDING


def test_pedestrians_gain_and_lose_speed_as_people_do(tracks: Callable[[str], Tracks]) -> None:
    """By 1.4 m/s in a second at most."""
    for track in tracks("pedestrian"):
        assert all(abs(b.v - a.v) <= 1.4 * 0.1 + ROUNDING for a, b in pairwise(track))


def test_pedestrians_reverse_twice_at_most(tracks: Callable[[str], Tracks]) -> None:
    """Across the road, which runs from west to east: after the first leg and after the second."""
    reversals = []
    for track in tracks("pedestrian"):
        across = [math.sin(s.o) > 0.0 for s in track if s.v > 0.1 and abs(math.sin(s.o)) > 0.2]
        reversals.append(len(list(groupby(across))) - 1)
    assert max(reversals) <= 2
    assert any(reversals)


@pytest.mark.parametrize("kind", ["bicycle", "car"])
def test_vehicles_drive_as_ordinary_drivers_do(tracks: Callable[[str], Tracks], kind: str) -> None:
    """They gain speed by 4 m/s2, brake by 9 m/s2 and turn by 5 m/s2 at most, and some do a lot."""
    gained, sideways = [], []
    for track in tracks(kind):
        for before, after in pairwise(track):
            gained.append((after.v - before.v) / 0.1)
            sideways.append(abs(wrap(after.o - before.o)) / 0.1 * before.v)
    assert -9.0 - ROUNDING <= min(gained) < -2.0
    assert 1.0 < max(gained) <= HASTE_MPS2 + ROUNDING
    assert 0.5 < max(sideways) <= 5.0 + ROUNDING


@pytest.mark.parametrize("kind", ["pedestrian", "bicycle", "car"])
def test_nobody_stands_on_the_road_for_long(tracks: Callable[[str], Tracks], kind: str) -> None:
    """Between two moves at most as long as somebody waits for the ego: 8 s, and to turn."""
    longest = 0.0
    for track in tracks(kind):
        runs = [(moves, len(list(same))) for moves, same in groupby(track, lambda s: s.v > 0.0)]
        begun = max((i for i, (_, n) in enumerate(runs[:-1])), default=0)
        pauses = [n * 0.1 for moves, n in runs[2:begun] if not moves]
        longest = max([longest, *pauses])
    assert longest <= 9.0
