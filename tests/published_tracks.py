"""Published scenarios of tests/data beside the reference tracks of Euro NCAP's cases."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

DATA = Path(__file__).parent / "data"
SCENARIOS = DATA / "scenarios"
WALKER, AHEAD, BICYCLIST = "walker-across.xosc", "ahead.xosc", "bicyclist-across.xosc"
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
}
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
