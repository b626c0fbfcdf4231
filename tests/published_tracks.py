"""Published scenarios of tests/data beside the reference tracks of Euro NCAP's cases."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from cavsumo.agents.rehearsal import STEP_S, view_of
from cavsumo.agents.storyboard import StoryRun
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.model.snapshot import BodyState
from cavsumo.openscenario.reading import ReadScenario

DATA = Path(__file__).parent / "data"
SCENARIOS = DATA / "scenarios"
WALKER, AHEAD, BICYCLIST = "walker-across.xosc", "ahead.xosc", "bicyclist-across.xosc"
TURN = "turn-across.xosc"
# The scenario that plays a test of the protocol, and its values of the parameters.
PLAYED: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "CPNA": (WALKER, {}),
    "CPFA": (WALKER, {"side": "-1", "walker_kmh": "8", "start_m": "6", "run_m": "1.5"}),
    "CPNCO": (
        WALKER,
        {
            "walker_length": "0.711",
            "walker_width": "0.298",
            "reference_m": "0.396",
            "parked": "true",
        },
    ),
    "CPLA": (AHEAD, {}),
    "CBLA": (
        AHEAD,
        {"who": "bicyclist", "target_kmh": "15", "run_m": "3.5", "steady_m": "28"},
    ),
    "CBNA": (BICYCLIST, {}),
    "CBNAO": (BICYCLIST, {"bicycle_kmh": "10", "steady_m": "4.5", "offset_m": "0"}),
}
MIDDLE_X = 261.5  # of the junction, in the reference tracks
State = Sequence[float]  # x, y [m], heading [rad], speed [m/s]


class Reference(NamedTuple):
    """A case of the reference tracks.

    Attributes:
        id: of the case.
        test: of the protocol.
        file, values: the scenario that plays it.
        rows: time to contact [s], and the states of the ego and of its target.
    """

    id: str
    test: str
    file: Path
    values: dict[str, str]
    rows: list[tuple[float, State, State]]


def references() -> Iterator[Reference]:
    """The cases that the scenarios of tests/data play."""
    content = json.loads((DATA / "ncap_vru_standard.json").read_text(encoding="utf-8"))
    for case in content["cases"]:
        given = case["parameters"]
        test = given["Scenario_ID"]
        if test in PLAYED:
            file, values = PLAYED[test]
            own = {
                "ego_kmh": f"{float(given['Ego_speed_kph']):g}",
                "impact_percent": given["ImpactLocation"],
            }
            ego, target = (body["t_x_y_heading_speed"] for body in case["bodies"][:2])
            rows = [(a[0], a[1:], b[1:]) for a, b in zip(ego, target, strict=True)]
            yield Reference(case["id"], test, SCENARIOS / file, {**values, **own}, rows)


def turns() -> Iterator[Reference]:
    """The cases of an ego that turns across the way of an oncoming car."""
    content = json.loads((DATA / "ncap_car_standard.json").read_text(encoding="utf-8"))
    names = {"Ego_speed_kph": "ego_kmh", "Target_final_speed_kph": "target_kmh"}
    names |= {"Trajectory_R2": "radius_m", "Trajectory_alpha": "alpha_deg"}
    names |= {"Trajectory_beta": "beta_deg"}
    for case in content["cases"]:
        given = case["parameters"]
        if given["Scenario_ID"] == "CCFtap":
            values = {own: given[name] for name, own in names.items()}
            ego, target = (body["t_x_y_heading_speed"] for body in case["bodies"][:2])
            rows = [
                (a[0], [a[1] - MIDDLE_X, *a[2:]], [b[1] - MIDDLE_X, *b[2:]])
                for a, b in zip(ego, target, strict=True)
            ]
            yield Reference(case["id"], "CCFtap", SCENARIOS / TURN, values, rows)


def seen_from(ego: State, target: State) -> tuple[float, float]:
    """Where a body is, from the ego's middle: ahead and to the left [m]."""
    dx, dy = target[0] - ego[0], target[1] - ego[1]
    c, s = math.cos(ego[2]), math.sin(ego[2])
    return dx * c + dy * s, dy * c - dx * s


def differences(
    rows: Sequence[tuple[float, State, State]], played: Sequence[tuple[float, State, State]]
) -> tuple[float, float]:
    """The largest differences of the target's place [m] and speed [m/s], seen from the ego.

    Both egos drive at the same speed, so the times are aligned by where the ego is at the last
    place before the contact. A speed of 0 between moving rows is a slip of the player that made
    the tracks, and is left out.
    """
    last = max(row for row in rows if row[0] <= -0.1)
    ahead = seen_from(*last[1:])[0]
    shift = _when(played, ahead) - last[0]
    place = speed = 0.0
    for before, row, after in zip(rows, rows[1:], rows[2:], strict=False):
        time, ego, target = row
        if time > -0.1 or not played[0][0] <= time + shift <= played[-1][0]:
            continue
        ours = _at(played, time + shift)
        place = max(place, math.dist(seen_from(ego, target), seen_from(*ours)))
        moved = math.dist(before[2][:2], after[2][:2]) / (after[0] - before[0])
        if target[3] > 0.0 or moved < 0.1:
            speed = max(speed, abs(target[3] - ours[1][3]))
    return place, speed


def _when(played: Sequence[tuple[float, State, State]], ahead: float) -> float:
    """When the target is so far ahead of the ego."""
    for (t0, *a), (t1, *b) in pairwise(played):
        x0, x1 = seen_from(*a)[0], seen_from(*b)[0]
        if x1 <= ahead <= x0:
            return t0 + (t1 - t0) * (x0 - ahead) / (x0 - x1)
    raise AssertionError(f"the target is never {ahead} m ahead")


def _at(played: Sequence[tuple[float, State, State]], time: float) -> tuple[State, State]:
    """Both states at a time, between two timesteps."""
    step = played[1][0] - played[0][0]
    i = min(len(played) - 2, max(0, int((time - played[0][0]) / step)))
    share = (time - played[i][0]) / step
    mixed = [
        [x + share * (y - x) for x, y in zip(a, b, strict=True)]
        for a, b in zip(played[i][1:], played[i + 1][1:], strict=True)
    ]
    return mixed[0], mixed[1]


def along_its_way(
    rows: Sequence[tuple[float, State, State]], played: Sequence[tuple[float, State, State]]
) -> tuple[float, float, float]:
    """How much earlier or later the target is at its places, its speed there, and the ego's place.

    The largest differences [s], [m/s] and [m]; times are counted from the last place.
    """
    moved = [(time, target[0], target[3]) for time, _, target in played]
    shift = _passed(moved, rows[-1][2][0])[0] - rows[-1][0]
    late = speed = place = 0.0
    for time, ego, target in rows:
        when, v = _passed(moved, target[0])
        late, speed = max(late, abs(when - shift - time)), max(speed, abs(v - target[3]))
        place = max(place, math.dist(ego[:2], _at(played, time + shift)[0][:2]))
    return late, speed, place


def _passed(moved: Sequence[tuple[float, float, float]], x: float) -> tuple[float, float]:
    """When a body that goes to the west is at a place [s], and its speed there [m/s]."""
    for (t0, x0, v0), (t1, x1, v1) in pairwise(moved):
        if x1 <= x < x0:
            share = (x0 - x) / (x0 - x1)
            return t0 + share * (t1 - t0), v0 + share * (v1 - v0)
    raise AssertionError(f"the target is never at {x} m")


def states(made: ReadScenario, until: float = 20.0) -> list[tuple[float, dict[str, BodyState]]]:
    """All bodies at all timesteps, with an ego that keeps its speed."""
    script = ScriptedTest.model_validate(made.settings["script"])
    story, found = StoryRun(script, STEP_S), []
    for step in range(round(until / STEP_S)):
        view = view_of(script, story, step * STEP_S)
        story.advance(view)
        found.append((view.time, dict(view.states)))
        if story.stopped:
            break
    return found
