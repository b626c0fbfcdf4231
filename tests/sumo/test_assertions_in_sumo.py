"""Each assertion in scripted episodes with real SUMO: not triggered, held, violated."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from staging import Stage

from cavsumo.assertions import ASSERTIONS
from cavsumo.egos.base import Drive
from cavsumo.model.carriageway import Start
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.site import Site

Staged = Callable[..., tuple[BatchPlan, Site]]
LEFT = math.pi / 2  # across the ego's way
SEEN: set[tuple[str, str]] = set()  # by the test under way
SHOWN: set[str] = set()  # assertions with a test that shows all their verdicts


def shows(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Marks a test of assertions: each must be seen held and violated, and not triggered if it can.

    A test with an argument ``name`` shows that one of them.
    """
    SHOWN.update(names)

    def marked(test: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(test)
        def complete(*args: Any, **given: Any) -> None:
            SEEN.clear()
            test(*args, **given)
            for name in [given["name"]] if "name" in given else names:
                verdicts = {"held", "violated"}
                if not ASSERTIONS.make(name, {}).unconditional:
                    verdicts.add("not_triggered")
                assert {v for n, v in SEEN if n == name} >= verdicts, name

        return complete

    return marked


@pytest.fixture(scope="module")
def straight(staged: Staged) -> Stage:
    """The straight road, 99 m long; the ego drives in its southern lane."""
    return Stage(*staged("pedestrians"))


def judged(setup: Stage, verdict: str, name: str, ego: Any, **more: Any) -> None:
    """An episode must come out so, with a robustness that agrees."""
    said, episode = setup.play(name, ego, **more)
    assert said.verdict == verdict, said
    assert episode.verdicts == {name: verdict}
    SEEN.add((name, verdict))
    if verdict == "not_triggered":
        assert said.robustness is None
    elif said.robustness is not None:
        assert (said.robustness < 0.0) == (verdict == "violated")
        assert math.isfinite(said.robustness)


def steady(snapshot: Snapshot) -> float:
    """Keeps 8 m/s, whatever happens."""
    return 8.0


def near(snapshot: Snapshot) -> float:
    """Distance from the ego's bumper to the first tester, about [m]."""
    ego, other = snapshot.ego, snapshot.testers[0]
    return math.hypot(other.x - ego.x, other.y - ego.y) - 2.6


def careful(snapshot: Snapshot) -> float:
    """Slows down early before the first tester, to stand three metres before it."""
    return max(0.0, min(8.0, 0.2 * (near(snapshot) - 3.0)))


def early(snapshot: Snapshot) -> float:
    """Brakes somewhat before the stopping distance of rule 126, 10.3 m."""
    return 0.0 if near(snapshot) < 15.0 else 8.0


def late(snapshot: Snapshot) -> float:
    """Brakes at the last moment."""
    return 0.0 if near(snapshot) < 8.0 else 8.0


def walks(snapshot: Snapshot, body: BodyState) -> tuple[float, float]:
    """A pedestrian who walks straight on."""
    return 1.4, 0.0


def drives(snapshot: Snapshot, body: BodyState) -> tuple[float, float]:
    """A car that keeps 8 m/s."""
    return 8.0, 0.0


def brakes(snapshot: Snapshot, body: BodyState) -> tuple[float, float]:
    """A car that stops after a second, with 6 m/s2."""
    return (8.0 if snapshot.time < 1.0 else max(0.0, body.v - 0.6)), 0.0


def aside(setup: Stage, along: float = 50.0) -> list[Start]:
    """Somebody who stands on the pavement and looks along it."""
    return [setup.beside(along, -4.0, 0.0)]


def in_lane(setup: Stage, along: float = 60.0) -> list[Start]:
    """Somebody who stands in the ego's lane."""
    return [setup.beside(along, 0.0, LEFT)]


def ahead(setup: Stage, along: float) -> list[Start]:
    """A car in the ego's lane that drives as fast."""
    return [setup.beside(along, 0.0, 0.0, 8.0)]


COMMON = ("stopping-distance", "ttc", "drac", "reaction-zone")


@pytest.mark.parametrize("name", COMMON)
@shows(*COMMON)
def test_bodies_in_the_way(straight: Stage, name: str) -> None:
    """Somebody on the pavement is no test; before somebody in the lane one slows down, or not."""
    judged(straight, "not_triggered", name, steady, places=aside(straight))
    driver = {"reaction-zone": late, "stopping-distance": early}.get(name, careful)
    judged(straight, "held", name, driver, places=in_lane(straight), end=20.0)
    judged(straight, "violated", name, steady, places=in_lane(straight))


@shows("collision")
def test_collision(straight: Stage) -> None:
    """Every episode is a test; a body that walks into the standing ego violates nothing."""
    judged(straight, "held", "collision", steady, places=aside(straight))
    judged(straight, "violated", "collision", steady, places=in_lane(straight))
    said, _ = straight.play("collision", steady, places=aside(straight))
    assert said.robustness == pytest.approx(4.0 - 0.9 - 0.4375, abs=0.1)


@shows("two-second-gap")
def test_two_second_gap(straight: Stage) -> None:
    """Five seconds behind a car, three seconds, one second; twice as much when wet."""
    car: dict[str, Any] = {"testers": drives, "kind": "car", "from_mps": 5.0}
    rule = "two-second-gap"
    judged(straight, "not_triggered", rule, steady, places=ahead(straight, 45.0), **car)
    judged(straight, "held", rule, steady, places=ahead(straight, 30.0), **car)
    judged(straight, "violated", rule, steady, places=ahead(straight, 30.0), wet=True, **car)
    judged(straight, "violated", rule, steady, places=ahead(straight, 12.0), **car)
    said, _ = straight.play(rule, steady, places=ahead(straight, 30.0), **car)
    assert said.robustness == pytest.approx((30.0 - 4.5) / 8.0 - 2.0, abs=0.1)


@shows("rss")
def test_rss(straight: Stage) -> None:
    """A car far ahead is safe; when one brakes the ego brakes too, or does not."""
    far = ahead(straight, 45.0)
    judged(straight, "not_triggered", "rss", steady, testers=drives, places=far, kind="car")
    car: dict[str, Any] = {"places": ahead(straight, 28.0), "kind": "car"}

    def follows(snapshot: Snapshot) -> float:
        return 0.0 if snapshot.time > 1.6 else 8.0

    rule: dict[str, Any] = {"testers": brakes, "end": 10.0} | car
    judged(straight, "held", "rss", follows, decel=5.0, **rule)
    judged(straight, "violated", "rss", follows, decel=1.0, **rule)
    said, _ = straight.play("rss", follows, decel=1.0, **rule)
    assert said.robustness == pytest.approx(-3.0, abs=0.1)  # b_min is 4 m/s2


def test_rss_leaves_who_steps_in_to_answer_for_it(straight: Stage) -> None:
    """Where the lateral distance became unsafe last, an ego in its lane did nothing wrong."""
    places = [straight.beside(28.0, -6.0, LEFT)]
    judged(straight, "held", "rss", steady, places=places, testers=walks)


@shows("pet")
def test_pet(straight: Stage) -> None:
    """A pedestrian crosses three seconds before the ego comes, or one second."""
    judged(straight, "not_triggered", "pet", steady, places=aside(straight))
    places = [straight.beside(60.0, -4.0, LEFT, 1.4)]
    judged(straight, "held", "pet", steady, places=places, testers=walks)
    places = [straight.beside(40.0, -4.0, LEFT, 1.4)]
    judged(straight, "violated", "pet", steady, places=places, testers=walks)


@shows("red-light")
def test_red_light(staged: Staged) -> None:
    """At green nothing is tested; at red the ego stops, or does not."""
    green, red = (Stage(*staged("junction", signal=colour)) for colour in ("green", "red"))
    line = red.site.lights[0].along

    def stops(snapshot: Snapshot) -> float:
        ego = snapshot.ego
        left = line - red.site.route.path.project(ego.x, ego.y).along - 2.5
        return max(0.0, min(8.0, 0.4 * (left - 1.0)))

    def until(snapshot: Snapshot) -> float:  # it has passed the light by then
        return 10.0

    judged(green, "not_triggered", "red-light", until, places=aside(green), start=10.0, end=9.0)
    judged(red, "held", "red-light", stops, places=aside(red), end=16.0)
    judged(red, "violated", "red-light", until, places=aside(red), start=10.0)


def zebra(networks: dict[str, Path], folder: Path) -> Path:
    """The crossing's network, where pedestrians have priority."""
    text = networks["crossing"].read_text(encoding="utf-8").splitlines()
    onto = re.compile('to=":[^"]*_c[0-9]+"')
    rows = [r.replace('state="m"', 'state="M"') if onto.search(r) else r for r in text]
    file = folder / "zebra.net.xml"
    file.write_text("\n".join(rows), encoding="utf-8")
    return file


@shows("give-way")
def test_give_way(staged: Staged, networks: dict[str, Path], tmp_path: Path) -> None:
    """Nobody near the crossing, somebody on it before whom the ego waits, or does not."""
    setup = Stage(*staged("crossing", net=zebra(networks, tmp_path)))
    crossing = next(c for c in setup.site.marked if c.begin > 30.0)
    assert (crossing.priority, crossing.signalled) == (True, False)
    middle = (crossing.begin + crossing.end) / 2
    far, near_kerb = setup.beside(10.0, -6.0, LEFT), setup.beside(middle, -2.2, LEFT)

    def waits(snapshot: Snapshot) -> float:
        ego = snapshot.ego
        left = crossing.begin - setup.site.route.path.project(ego.x, ego.y).along - 2.5
        return 6.0 if snapshot.time > 16.0 else max(0.0, min(8.0, 0.3 * (left - 1.0)))

    def crosses(snapshot: Snapshot, body: BodyState) -> tuple[float, float]:
        return (1.4 if snapshot.time > 8.0 else 0.0), 0.0

    rule: dict[str, Any] = {"testers": crosses}
    judged(setup, "not_triggered", "give-way", steady, places=[far], end=10.0)
    judged(setup, "held", "give-way", waits, places=[near_kerb], end=25.0, **rule)
    judged(setup, "violated", "give-way", steady, places=[near_kerb], end=15.0, **rule)
    plain = Stage(*staged("crossing"))
    assert not any(c.priority for c in plain.site.marked)
    judged(plain, "not_triggered", "give-way", steady, places=[near_kerb], end=15.0)
    judged(plain, "violated", "give-way", steady, places=[near_kerb], end=15.0, every=True)


@shows("speed-limit")
def test_speed_limit(straight: Stage) -> None:
    """Below the limit, a little above it, far above it."""
    limit = straight.site.limits[0].speed

    def speeds(factor: float) -> Callable[[Snapshot], float]:
        return lambda snapshot: factor * limit

    for factor, verdict in ((0.6, "held"), (1.05, "held"), (1.3, "violated")):
        judged(straight, verdict, "speed-limit", speeds(factor), places=aside(straight))


@shows("leaving-the-road")
def test_leaving_the_road(straight: Stage) -> None:
    """Straight on it stays on the road, steering to the side it does not."""

    def steers(snapshot: Snapshot) -> Drive:
        return Drive(0.0, -0.05 if snapshot.time > 1.0 else 0.0)

    judged(straight, "held", "leaving-the-road", steady, places=aside(straight))
    judged(straight, "violated", "leaving-the-road", steers, places=aside(straight))


@pytest.mark.parametrize("way", ["left", "right", "straight"])
def test_turning_is_not_leaving_the_road(staged: Staged, way: str) -> None:
    """An ego that SUMO steers round a corner stays within the tolerance."""
    setup = Stage(*staged("junction", ego_route=way))
    judged(setup, "held", "leaving-the-road", lambda snapshot: 5.0, places=aside(setup, 5.0))


@shows("standing")
def test_standing(straight: Stage) -> None:
    """Driving on, standing for three seconds, for ever; but somebody in the way is a reason."""

    def pauses(seconds: float) -> Callable[[Snapshot], float]:
        return lambda snapshot: 0.0 if 2.0 < snapshot.time < 2.0 + seconds else 8.0

    rule: dict[str, Any] = {"most_s": 5.0, "end": 20.0}
    judged(straight, "not_triggered", "standing", steady, places=aside(straight), **rule)
    judged(straight, "held", "standing", pauses(4.0), places=aside(straight), **rule)
    judged(straight, "violated", "standing", pauses(99.0), places=aside(straight), **rule)
    judged(straight, "held", "standing", late, places=in_lane(straight, 35.0), **rule)


def test_an_ego_that_stands_at_the_horizon_is_waited_for(straight: Stage) -> None:
    """The verdict is not open for ever: it runs on until the time is up."""

    def parks(snapshot: Snapshot) -> float:
        return 0.0 if snapshot.time > 4.0 else 8.0

    said, episode = straight.play("standing", parks, places=aside(straight), end=6.0, most_s=5.0)
    assert said.verdict == "violated"
    assert 9.0 < episode.time < 12.0


@shows("hard-braking")
def test_hard_braking(straight: Stage) -> None:
    """Gently, hard for nothing, hard for somebody; and then again, when no reason counts."""

    def stops(snapshot: Snapshot) -> float:
        return 0.0 if snapshot.time > 2.0 else 8.0

    rule: dict[str, Any] = {"end": 6.0}
    judged(straight, "held", "hard-braking", stops, places=aside(straight, 80.0), decel=3.0, **rule)
    judged(
        straight, "violated", "hard-braking", stops, places=aside(straight, 80.0), decel=6.0, **rule
    )
    judged(straight, "held", "hard-braking", late, places=in_lane(straight), **rule | {"end": 12.0})
    judged(
        straight,
        "violated",
        "hard-braking",
        late,
        places=in_lane(straight),
        at_all=True,
        **rule | {"end": 12.0},
    )


def test_no_assertion_is_left_out() -> None:
    """Every assertion has a test that shows all its verdicts."""
    assert set(ASSERTIONS.names.modules) == SHOWN
