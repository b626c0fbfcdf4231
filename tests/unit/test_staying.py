"""Testers whose actions lead anywhere stay on the pavements until they step out."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
import shapely

from cavsumo.agents import AGENTS
from cavsumo.egos.base import EGO_KIND
from cavsumo.model.bodies import PEDESTRIAN, Body
from cavsumo.model.kinematics import step_floats
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.drawing.surfaces import lanes_by_kind, walking_areas
from cavsumo.network.reader import read_network
from cavsumo.network.site import Site

DT, OFF_M = 0.1, 0.5
Staged = Callable[..., tuple[BatchPlan, Site]]


def walked(site: Site, agent: str, seed: int) -> Iterator[BodyState]:
    """One body after another until it is on a carriageway, a minute long; the ego stands."""
    rng = np.random.default_rng(seed)
    driver = Body("ego", EGO_KIND)
    bodies = tuple(Body(f"tester{i}", PEDESTRIAN) for i in range(3))
    starts = site.draw([PEDESTRIAN] * 3, EGO_KIND, None, rng)
    scene = site.scene(DT, driver, bodies, starts, seed)
    acting = AGENTS.make(agent, {})
    acting.reset(scene, [0, 1, 2], rng)
    states = [
        BodyState(body, s.x, s.y, PEDESTRIAN.v_max, s.o)
        for body, s in zip(bodies, starts, strict=True)
    ]
    ego = BodyState(driver, *site.route.path.at(0.0)[:2], 0.0, site.route.path.at(0.0)[2])
    limits = PEDESTRIAN.wheelbase, PEDESTRIAN.v_min, PEDESTRIAN.v_max, DT
    out = [False] * 3
    for step in range(600):
        out = [o or site.roads.contains(s.x, s.y) for o, s in zip(out, states, strict=True)]
        yield from (s for o, s in zip(out, states, strict=True) if not o)
        snapshot = Snapshot(step, step * DT, ego, 0.0, tuple(states))
        joint = acting.choose_action(snapshot)
        states = [
            BodyState(s.body, *step_floats(*s[1:], *action, *limits))
            for s, action in zip(states, joint, strict=True)
        ]


def off(site: Site, agent: str) -> float:
    """The share of states that are farther than half a metre from all that one can walk on."""
    network = read_network(site.net)
    insides = [e for kind in ("internal", "crossing") for e in network.inside(kind)]
    lanes = [
        shapely.LineString(lane.getShape()).buffer(lane.getWidth() / 2, cap_style="flat")
        for edge in insides
        for lane in edge.getLanes()
    ]
    surfaces = [s for kind in lanes_by_kind(network).values() for s in kind]
    areas = shapely.make_valid([*lanes, *surfaces, *walking_areas(network)])
    ground = shapely.union_all(areas)
    states = [state for seed in range(4) for state in walked(site, agent, seed)]
    far = shapely.distance(ground, shapely.points([(s.x, s.y) for s in states])) > OFF_M
    return float(far.mean())


@pytest.mark.parametrize("agent", ["random", "q-learning", "proximity"])
@pytest.mark.parametrize("name", ["junction", "pedestrians"])
def test_nobody_strays(staged: Staged, name: str, agent: str) -> None:
    """Before it is on a carriageway every body is on something that people walk on."""
    assert off(staged(name)[1], agent) == 0.0


def test_jaywalkers_may_go_anywhere(staged: Staged) -> None:
    """It is asked for."""
    assert off(staged("junction", jaywalk=True)[1], "random") > 0.05
