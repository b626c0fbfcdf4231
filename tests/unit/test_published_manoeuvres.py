"""Published scenarios whose bodies leave their way, keep a gap, or meet an ego that reverses."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from published_tracks import SCENARIOS, states

from cavsumo.agents.rehearsal import STEP_S
from cavsumo.errors import InputError
from cavsumo.model.scenario.storyboard import StoryAction
from cavsumo.openscenario.reading import ReadScenario, ScenarioSource, read_scenario

OVERTAKER, REVERSING = SCENARIOS / "overtaker.xosc", SCENARIOS / "reversing.xosc"
AXLE_M, FRONT_M = 1.349, 1.349 + 4.358 / 2  # of the car's reference point


def changed(tmp_path: Path, file: Path, *changes: tuple[str, str]) -> ReadScenario:
    """A scenario with other words in it."""
    text = file.read_text(encoding="utf-8").replace('path="catalogs"', f'path="{tmp_path}"')
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "bodies.xosc").write_bytes((SCENARIOS / "catalogs" / "bodies.xosc").read_bytes())
    made = tmp_path / "changed" / file.name
    made.parent.mkdir(exist_ok=True)
    made.write_text(text, encoding="utf-8")
    return read_scenario(ScenarioSource(made, {}, tmp_path))


def test_a_body_leaves_its_way_where_it_is() -> None:
    """After braking from 15 to 10 m/s in 2 s its axle goes along two arcs of 20 m, to the left."""
    track = states(read_scenario(ScenarioSource(OVERTAKER, {})))
    assert track[-1][0] == pytest.approx(9.0 - STEP_S, abs=STEP_S)
    along = {round(time, 6): bodies["tester0"] for time, bodies in track}
    begin, middle, end = along[2.02], along[4.02], along[6.02]  # its event begins after a timestep
    assert math.dist(along[0.02][1:3], begin[1:3]) == pytest.approx(25.0, abs=1e-6)
    assert math.remainder(middle.o - begin.o, math.tau) == pytest.approx(0.008 * 20, abs=1e-6)
    assert math.remainder(end.o - begin.o, math.tau) == pytest.approx(0.0, abs=1e-6)
    # Its axle: two mirrored arcs of radius R = 125 m and angle a go aside by 2 R (1 - cos a).
    (x0, y0), (x1, y1) = (
        (one.x - AXLE_M * math.cos(one.o), one.y - AXLE_M * math.sin(one.o)) for one in (begin, end)
    )
    ahead = (x1 - x0) * math.cos(begin.o) + (y1 - y0) * math.sin(begin.o)
    left = (y1 - y0) * math.cos(begin.o) - (x1 - x0) * math.sin(begin.o)
    assert ahead == pytest.approx(250 * math.sin(0.16), abs=1e-6)
    assert left == pytest.approx(250 * (1 - math.cos(0.16)), abs=1e-6)
    assert end.v == 10.0


def test_a_body_keeps_its_gap_until_it_changes_its_speed() -> None:
    """Between the boxes, while the one behind brakes; the event after the lane change ends that."""
    for time, bodies in states(read_scenario(ScenarioSource(OVERTAKER, {}))):
        behind, leader = bodies["tester0"], bodies["tester1"]
        if time <= 2.0:
            apart = math.dist(behind[1:3], leader[1:3]) - (4.358 + 4.4) / 2
            assert apart == pytest.approx(19.4, abs=1e-6)
        assert leader.v == (behind.v if time < 6.02 - 1e-6 else 12.0)


def test_an_ego_that_drives_backwards_is_met_at_its_rear() -> None:
    """The walker is behind it, and in the middle of its rear as that has come there."""
    made = read_scenario(ScenarioSource(REVERSING, {}))
    assert any("Ego drives backwards" in note for note in made.notes)
    rear_m = 4.358 / 2 - AXLE_M
    assert made.settings["script"]["ego"]["speed_mps"] == 2.0
    assert made.settings["script"]["ego"]["axle_m"] == pytest.approx(rear_m)
    track = states(made)
    seen = {round(time, 6): bodies for time, bodies in track}
    ego, walker = seen[0.0]["ego"], seen[0.0]["tester0"]
    ahead = (walker.x - ego.x) * math.cos(ego.o) + (walker.y - ego.y) * math.sin(ego.o)
    left = (walker.y - ego.y) * math.cos(ego.o) - (walker.x - ego.x) * math.sin(ego.o)
    assert (ahead, left) == pytest.approx((20 + AXLE_M, 4.0))
    meets = round((20 - rear_m) / 2 / STEP_S) * STEP_S
    ego, walker = (seen[round(meets, 6)][name] for name in ("ego", "tester0"))
    assert walker.y - ego.y == pytest.approx(0.0, abs=0.02)
    assert abs(walker.x - ego.x) == pytest.approx(4.358 / 2, abs=0.04)
    assert walker.v == 1.0
    assert track[-1][0] == pytest.approx(12.0, abs=STEP_S)  # its speed is below -1.9 m/s all along


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        (OVERTAKER, 'entityRef="Overtaker" distance', 'entityRef="Ego" distance',
         "continuous: expected false, nobody adapts to the vehicle under test"),
        (OVERTAKER, 'displacement="leading', 'displacement="trailing',
         "is understood for entities that lead another one"),
        (OVERTAKER, 'freespace="true"', 'freespace="false"',
         "is understood with freespace true and a distance"),
        (OVERTAKER, 'storyboardElementType="maneuver"', 'storyboardElementType="action"',
         "unknown storyboardElementType 'action'; did you mean 'act'?"),
        (OVERTAKER, "TrajectoryAction>\n", 'TrajectoryAction initialDistanceOffset="1">\n',
         "a trajectory in an event needs times, or begins where its entity is"),
        (REVERSING, "SpeedCondition rule", 'RelativeSpeedCondition entityRef="Walker" rule',
         "is not understood of an entity that drives backwards"),
        (REVERSING, 'x="0" y="0"', 'x="100" y="0"', "are the same place"),
    ],
)  # fmt: skip
def test_what_is_not_understood_of_that_is_named(
    tmp_path: Path, file: Path, old: str, new: str, said: str
) -> None:
    """With file and line."""
    with pytest.raises(InputError) as caught:
        changed(tmp_path, file, (old, new))
    assert "line" in str(caught.value)
    assert said in str(caught.value)


def test_an_ego_that_drives_backwards_needs_a_trajectory(tmp_path: Path) -> None:
    """Along a lane it would have to know which way its rear is."""
    place = '<TeleportAction><Position><WorldPosition x="100" y="0"/></Position></TeleportAction>'
    text = REVERSING.read_text(encoding="utf-8")
    old = text[text.index("<RoutingAction>") : text.index("</RoutingAction>") + 16]
    with pytest.raises(InputError, match="Ego drives backwards, which is understood along a traj"):
        changed(tmp_path, REVERSING, (old, place))


def test_a_body_hurries_at_the_least_rate() -> None:
    """It covers the distance in the time, and another profile of two rates needs a larger one."""
    action = StoryAction(body="tester0", to_mps=10, ego_at_m=0, own_at_m=150, steady_m=50)
    motion = action.hurried(0.0, 0.0, 15.0)
    assert motion is not None
    assert motion.at(15.0)[0] == pytest.approx(150.0)
    assert motion.at(10.0) == pytest.approx((100.0, 10.0))
    (gains, _), (loses, _) = motion.phases
    assert gains == pytest.approx(-loses)
    equal_times = ((4 * 100 / 10 - 10) / 2) / 5  # to 15 m/s in 5 s, and back to 10 m/s in 5 s
    assert gains < equal_times
    assert action.hurried(0.0, 0.0, 11.0) is None  # more than twice its final speed
