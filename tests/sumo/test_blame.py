"""Blame: which party broke which rule first, in scripted episodes with real SUMO."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from shapely.geometry import Point
from staging import Stage

from cavsumo.assertions.blame import RULES
from cavsumo.model.carriageway import Approach, Start
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.site import Site
from cavsumo.results.columns import measured

Staged = Callable[..., tuple[BatchPlan, Site]]
LEFT = math.pi / 2  # across the ego's way


@pytest.fixture(scope="module")
def straight(staged: Staged) -> Stage:
    """The straight road, 99 m long; the ego drives in its southern lane."""
    return Stage(*staged("pedestrians"))


def at(speed: float) -> Callable[[Snapshot], float]:
    """An ego that keeps a speed, whatever happens."""
    return lambda snapshot: speed


def stands(snapshot: Snapshot, body: BodyState) -> tuple[float, float]:
    """Somebody who never moves."""
    return 0.0, 0.0


def crosses(distance: float) -> Callable[[Snapshot, BodyState], tuple[float, float]]:
    """A pedestrian who waits until the ego's bumper is that near, then walks."""

    def act(snapshot: Snapshot, body: BodyState) -> tuple[float, float]:
        left = math.hypot(body.x - snapshot.ego.x, body.y - snapshot.ego.y) - 2.5
        return (1.4 if body.v > 0.0 or left < distance else 0.0), 0.0

    return act


def to_blame(setup: Stage, ego: Callable[[Snapshot], Any], places: list[Start], **more: Any) -> str:
    """The blame of an episode in which the ego hits somebody."""
    said, episode = setup.play("collision", ego, places=places, **more)
    assert said.verdict == "violated"
    assert episode.outcome == "violated"
    return str(measured(episode)["blame"])


def test_the_ego_does_not_answer(straight: Stage) -> None:
    """Somebody stands in its way, in sight for long."""
    there = [straight.beside(70.0, 0.0, LEFT)]
    assert to_blame(straight, at(8.0), there, testers=stands) == "ego:rss-response"


def test_somebody_steps_out(straight: Stage) -> None:
    """Within the stopping distance of rule 126, 10.3 m at 8 m/s, it is the pedestrian's fault."""
    kerb = [straight.beside(40.0, -1.9, LEFT)]
    assert to_blame(straight, at(8.0), kerb, testers=crosses(11.0)) == "tester:stepped-out"


def test_nobody_broke_a_rule(straight: Stage) -> None:
    """Stepped in a little farther away; the ego braked within a second, as RSS asks, and hit."""

    def brakes(snapshot: Snapshot) -> float:
        body, ego = snapshot.testers[0], snapshot.ego
        return 0.0 if math.hypot(body.x - ego.x, body.y - ego.y) < 7.0 else 8.0

    def stops(snapshot: Snapshot, body: BodyState) -> tuple[float, float]:
        there = straight.site.route.path.project(body.x, body.y).lateral > -0.7
        return (0.0, 0.0) if there else crosses(20.5)(snapshot, body)

    kerb = [straight.beside(50.0, -1.9, LEFT)]
    assert to_blame(straight, brakes, kerb, testers=stops, decel=5.0) == ""


def test_somebody_on_the_carriageway_walks_on(straight: Stage) -> None:
    """Stepped out at some distance, but came into the ego's way within its stopping distance."""
    kerb = [straight.beside(40.0, -1.9, LEFT)]
    assert to_blame(straight, at(8.0), kerb, testers=crosses(14.5)) == "tester:stepped-in"


def test_the_earliest_wins(straight: Stage) -> None:
    """The ego drove too fast before somebody stepped out."""
    kerb = [straight.beside(60.0, -1.9, LEFT)]
    limit = straight.site.limits[0].speed
    fast = limit * 1.1 + 2.0
    blame = to_blame(straight, at(fast), kerb, testers=crosses(1.35 * fast), start=fast)
    assert blame == "ego:speed"


def test_a_red_light(staged: Staged) -> None:
    """The ego passes the line at red and hits somebody behind it."""
    setup = Stage(*staged("junction", signal="red"))
    there = setup.beside(setup.site.lights[0].along + 50.0, 0.0, LEFT)
    assert to_blame(setup, at(10.0), [there], testers=stands, start=10.0) == "ego:red-light"


@pytest.mark.parametrize(
    ("signal", "blame"), [("green", "tester:red-man"), ("red", "ego:red-light")]
)
def test_a_crossing_at_lights(staged: Staged, signal: str, blame: str) -> None:
    """Where the ego has green, who walks over the crossing has red; and the other way round."""
    setup = Stage(*staged("junction", signal=signal))
    crossing = setup.site.marked[0]
    middle = (crossing.begin + crossing.end) / 2
    places = [setup.beside(middle, -0.1 * i, LEFT) for i in range(20, 200)]
    kerb = next(p for p in places if not crossing.surface.buffer(0.1).contains(Point(p.x, p.y)))
    aside = -setup.site.route.path.project(kerb.x, kerb.y).lateral
    walks = crosses(8.0 * (aside - 1.0) / 1.4)
    assert to_blame(setup, at(8.0), [kerb], testers=walks, start=8.0) == blame


def test_a_vehicle_cuts_in(straight: Stage) -> None:
    """From the lane beside into the ego's, nearer than is safe; who has priority may."""

    def turns(snapshot: Snapshot, body: BodyState) -> tuple[float, float]:
        path, near = straight.site.route.path, body.v > 3.0
        aside = path.project(body.x, body.y).lateral
        heading = -0.4 if aside > 0.6 and near else 0.0
        wanted = math.remainder(path.at(0.0)[2] + heading - body.o, math.tau)
        return (5.0 if aside > 0.9 else 0.0), max(-0.5, min(0.5, 2.0 * wanted))

    beside = straight.beside(22.0, 3.4, 0.0, v=5.0)
    path = straight.site.route.path
    way = Approach(
        "adjacent", path, straight.site.route.edges, math.inf, 0.0, 90.0, 0.0, True, 13.0, 13.0
    )
    for kind, yields, blame in (
        ("adjacent", True, "tester:cut-in"),
        ("crossing", False, "ego:rss-response"),
    ):
        approach = dataclasses.replace(way, type=kind, yields=yields)
        start = dataclasses.replace(beside, approach=approach)
        assert to_blame(straight, at(8.0), [start], testers=turns, kind="car") == blame


def test_no_blame_without_a_violation(straight: Stage) -> None:
    """Nor of anybody whom the ego did not meet."""
    _, episode = straight.play("collision", at(8.0), places=[straight.beside(40.0, -3.0, LEFT)])
    assert (episode.outcome, episode.blame) == ("held", "")


def test_a_violation_that_names_nobody_is_judged_by_the_rules_of_the_ego(straight: Stage) -> None:
    """Nobody can have stepped out, and RSS has no body to answer to."""
    aside = [straight.beside(40.0, -3.0, LEFT)]
    said, episode = straight.play("speed-limit", at(20.0), places=aside, start=20.0)
    assert (said.verdict, said.tester, episode.blame) == ("violated", "", "ego:speed")


def test_every_rule_decides_an_episode_here() -> None:
    """Each rule stands as the expected blame of a test of this file."""
    source = Path(__file__).read_text(encoding="utf-8")
    assert [rule for rule in RULES if f'"{rule}"' not in source] == []
