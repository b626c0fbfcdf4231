"""The grade of an episode, the ego's spare time, and what a human driver was short of."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from cavsumo.assertions.judgement import HELD, NOT_TRIGGERED, UNFAIR, VIOLATED, Judgement
from cavsumo.egos.reference.human import FULL_MPS2
from cavsumo.model.bodies import CAR, PEDESTRIAN
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot
from cavsumo.results.grade import INVALID_GRADE, grade
from cavsumo.simulation.avoidability import Avoidability
from cavsumo.simulation.foresight import human_short


def _episode(
    judgement: Judgement, outcome: str = "", short: float | None = None, seen: Any = ()
) -> Any:
    """An episode with some snapshots; without any nobody was near."""
    verdict = outcome or judgement.verdict
    return SimpleNamespace(judgement=judgement, outcome=verdict, short=short, seen=seen)


def test_grades_order_episodes() -> None:
    """From invalid over nobody met, unfair, held and unpreventable to a hard impact."""
    hit = Judgement("collision", VIOLATED, "tester0", impact_speed=3.0, robustness=-3.0)
    late, held = (Judgement("reaction-zone", said, "tester0") for said in (UNFAIR, HELD))
    cases = [
        (_episode(hit, "invalid"), None),
        (_episode(Judgement("", NOT_TRIGGERED)), None),
        (_episode(late, short=1.4), None),
        (_episode(late, short=0.2), None),
        (_episode(held), None),
        (_episode(hit), Avoidability(False, perceived=5.0)),
        (_episode(hit), Avoidability(False, last_chance=4.0, perceived=5.0)),
        (_episode(hit), Avoidability(False, last_chance=4.8, perceived=5.0)),
        (_episode(hit), Avoidability(True, last_chance=5.0, perceived=4.0)),
        (_episode(dataclasses.replace(hit, impact_speed=8.0)), Avoidability(True)),
    ]
    grades = [grade(*case) for case in cases]
    assert grades == sorted(grades)
    assert len(set(grades)) == len(grades)
    assert grades[0] == INVALID_GRADE
    assert grades[-2:] == [3.0, 8.0]
    assert sum(g >= 0.0 for g in grades) == 2


def test_the_spare_time_of_an_ego(
    straight_scene: Callable[..., Scene], scene_snapshot: Callable[..., Snapshot]
) -> None:
    """At 8 m/s it stops within 3.56 m, and the box of a pedestrian counts, not its centre."""
    scene, none = straight_scene(), Judgement("", NOT_TRIGGERED)
    kind, front = PEDESTRIAN, scene.ego.kind.length / 2

    def spare(x: float, y: float, heading: float = 0.0, v: float = 8.0) -> float:
        seen = [scene_snapshot(scene, (10.0, v), [(x, y, 0.0, heading)])]
        share = -3.0 - grade(_episode(none, seen=seen), None)
        return share / (1.0 - share)

    way = 8.0**2 / 18.0
    ahead = 10.0 + front + way + kind.length / 2
    assert spare(ahead + 4.0, -1.825) == pytest.approx(4.0 / 8.0)
    assert spare(ahead - 1.0, -1.825) == 0.0
    beside = -1.825 - scene.ego.kind.width / 2 - kind.width / 2
    assert spare(ahead - 1.0, beside - 0.7) == pytest.approx(0.7 / kind.v_max)
    assert spare(ahead + 1.6, beside - 0.7) == pytest.approx(0.7 / kind.v_max)
    assert spare(10.0 - front - 1.0, -1.825) == pytest.approx(10.0)  # it has been passed
    assert spare(ahead - 1.0, -1.825, v=0.0) == pytest.approx(10.0)  # the ego stands


def test_a_human_is_short_of_the_time_since_the_tester_could_be_seen_to_come(
    straight_scene: Callable[..., Scene], scene_snapshot: Callable[..., Snapshot]
) -> None:
    """It walks into the way at 1.4 m/s for so long; a human needs 1.45 s and v / (2 a) at 8 m/s."""
    scene, needed = straight_scene(), 1.45 + 8.0 / (2.0 * FULL_MPS2)

    def short(steps: int) -> float | None:
        """The ego's front comes to the tester's side after so many timesteps on the road."""
        history = []
        for step in range(steps + 1):
            left = (steps - step) * scene.dt
            x = 60.0 - PEDESTRIAN.width / 2 - scene.ego.kind.length / 2 - 8.0 * left
            tester = (60.0, -1.825 - 1.2 - 1.4 * left, 1.4, math.pi / 2)
            history.append(scene_snapshot(scene, (x, 8.0), [tester], step=step))
        said = Judgement("reaction-zone", UNFAIR, "tester0")
        return human_short(scene, history, said)

    assert short(3) == pytest.approx(needed - 0.3, abs=0.05)
    assert short(8) == pytest.approx(needed - 0.4, abs=0.11)  # before that it was off the road
    said = Judgement("give-way", HELD, "car1")
    assert human_short(scene, [scene_snapshot(scene)], said) is None


def test_the_spare_time_that_a_vehicle_leaves(
    straight_scene: Callable[..., Scene], scene_snapshot: Callable[..., Snapshot]
) -> None:
    """It counts where it will be, as it lies, and comes aside no faster than tyres hold."""
    scene, none = straight_scene(kind=CAR), Judgement("", NOT_TRIGGERED)
    half, front = CAR.length / 2, scene.ego.kind.length / 2
    lane, v = -1.825, 8.0
    way = v * v / 18.0

    def spare(x: float, y: float, speed: float, heading: float) -> float:
        seen = [scene_snapshot(scene, (10.0, v), [(x, y, speed, heading)])]
        share = -3.0 - grade(_episode(none, seen=seen), None)
        return share / (1.0 - share)

    ahead = 10.0 + front + way + half
    assert spare(ahead + 4.0, lane, 0.0, 0.0) == pytest.approx(4.0 / v)
    assert spare(ahead + 4.0, lane, 6.0, 0.0) == pytest.approx((4.0 + 6.0**2 / 18.0) / v)
    assert spare(ahead + 8.0, lane, 3.0, math.pi) == pytest.approx((8.0 - 3.0 * v / 9.0) / v)
    beside = lane + scene.ego.kind.width / 2 + CAR.width / 2 + 1.6
    assert spare(ahead, beside, 0.0, math.pi) == pytest.approx(math.sqrt(2.0 * 1.6 / 5.0))
    crossing = lane + scene.ego.kind.width / 2 + half + 2.0  # 2 m away, at 4 m/s
    assert spare(ahead, crossing, 4.0, -math.pi / 2) == pytest.approx((6.0 - 4.0) / 5.0)
    # Askew, one corner 0.1 m in the strip: that corner counts, not the bumper beside the strip.
    root = math.sqrt(0.5)
    askew = lane + scene.ego.kind.width / 2 + root * (half + CAR.width / 2) - 0.1
    corner = root * (half - CAR.width / 2) - 0.1
    turned = spare(10.0 + front + way + 3.0 - corner, askew, 0.0, math.radians(135.0))
    assert turned == pytest.approx(3.0 / v)
