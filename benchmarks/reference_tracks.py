"""The cases of euroncap-2026 beside reference tracks: where the target is, seen from the ego.

    python benchmarks/reference_tracks.py [-j N]

The tracks (tests/data/ncap_*.json) are the published OpenSCENARIO files, played by esmini with an
ego that keeps its speed. Both are compared where the boxes are 20, 10, 5 and 2 m apart and at
contact, by interpolation between their timesteps; a track begins four seconds before contact.
``impact``: how far the target's reference point is from the nominal one at contact.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import cavsumo
from cavsumo.model.geometry import Box, gap
from cavsumo.results.traces import read_trace
from cavsumo.suites.files import read_suite, suite_file
from cavsumo.suites.records import SuiteBody

SUITE = read_suite(suite_file("euroncap-2026"))
DATA = Path(__file__).resolve().parents[1] / "tests" / "data"
FILES = ("ncap_vru_standard.json", "ncap_car_standard.json")
GAPS_M = (20.0, 10.0, 5.0, 2.0, 0.0)
Row = tuple[float, float, float, float, float]  # t, x, y, heading, speed
# Parameters of the published files that make the names of cases, by test; all others: the first.
NAMES = {
    "CCFtap": ("Ego_speed_kph", "Target_final_speed_kph"),
    "CCFhos": ("Ego_speed_kph", "Target_init_speed_kph", "ImpactLocation"),
}


class Track(NamedTuple):
    """The ego and its target: boxes, and their states at the same times."""

    ego: tuple[float, float]
    target: tuple[float, float]
    states: Sequence[tuple[Row, Row]]


class Seen(NamedTuple):
    """The target from the middle of the ego's front: place [m], speed [m/s], relative heading."""

    ahead: float
    left: float
    speed: float
    turn: float


def reference_tracks() -> dict[str, Track]:
    """The reference tracks by the names of their cases."""
    found = {}
    for file in FILES:
        for case in json.loads((DATA / file).read_text(encoding="utf-8"))["cases"]:
            ego, target, *_ = case["bodies"]
            states = [body["t_x_y_heading_speed"] for body in (ego, target)]
            boxes = [(body["length_m"], body["width_m"]) for body in (ego, target)]
            found[name_of(case["parameters"])] = Track(*boxes, list(zip(*states, strict=True)))
    return found


def name_of(parameters: Mapping[str, str]) -> str:
    """The name of a case of the published files, as the suite calls it."""
    test = parameters["Scenario_ID"]
    keys = NAMES.get(test, ("Ego_speed_kph", "ImpactLocation"))
    return "/".join((test, *(f"{float(parameters[key]):g}" for key in keys)))


def played_track(file: Path) -> Track:
    """The track in a trace of cavsumo."""
    trace = read_trace(file)
    shapes = trace.shapes()
    boxes = [(shapes[name].length, shapes[name].width) for name in ("ego", "tester0")]
    states = [
        (row(frame["time_s"], frame["ego"]), row(frame["time_s"], frame["testers"]["tester0"]))
        for frame in trace.frames
    ]
    return Track(*boxes, states)


def row(time: float, state: Sequence[float]) -> Row:
    """A state of a trace as one of a track."""
    x, y, v, o = state
    return time, x, y, o, v


def seen_at(track: Track) -> dict[float, Seen]:
    """The target at each gap that the track reaches, the last time that it does."""
    apart = [signed_gap(track, pair) for pair in track.states]
    found = {}
    for wanted in GAPS_M:
        for i in range(len(apart) - 1, 0, -1):
            if apart[i] <= wanted < apart[i - 1]:
                share = (apart[i - 1] - wanted) / (apart[i - 1] - apart[i])
                before, after = (seen(track, track.states[k]) for k in (i - 1, i))
                mixed = (a + share * (b - a) for a, b in zip(before, after, strict=True))
                found[wanted] = Seen(*mixed)
                break
    return found


def signed_gap(track: Track, pair: tuple[Row, Row]) -> float:
    """The gap between the boxes [m]; negative where they overlap: how deep, along the ego."""
    (ego, target), boxes = pair, (track.ego, track.target)
    shapes = [Box(*state[1:4], *box) for state, box in zip((ego, target), boxes, strict=True)]
    apart = gap(*shapes)
    if apart > 0.0:
        return apart
    turn, (length, width) = target[3] - ego[3], track.target
    reach = (length * abs(math.cos(turn)) + width * abs(math.sin(turn))) / 2
    return min(0.0, seen(track, pair).ahead - reach)


def seen(track: Track, pair: tuple[Row, Row]) -> Seen:
    """The target in one pair of states."""
    (_, x, y, o, _), (_, tx, ty, heading, speed) = pair
    dx, dy = tx - x, ty - y
    ahead = dx * math.cos(o) + dy * math.sin(o) - track.ego[0] / 2
    return Seen(ahead, dy * math.cos(o) - dx * math.sin(o), speed, heading - o)


def compared(name: str, played: Track, reference: Track) -> Iterator[tuple[float, float, float]]:
    """For each gap that both reach: the distance of the two places [m], and of the speeds."""
    ours, theirs = seen_at(played), seen_at(reference)
    assert 0.0 in ours, f"{name}: no contact was played"
    for wanted in GAPS_M:
        if wanted in ours and wanted in theirs:
            a, b = ours[wanted], theirs[wanted]
            yield wanted, math.dist(a[:2], b[:2]), abs(a.speed - b.speed)


def off_nominal(percent: float, body: SuiteBody, track: Track) -> float:
    """How far the target's reference point is from the nominal one on the ego's front [m]."""
    contact = seen_at(track)[0.0]
    front = body.length_m / 2 if body.front_m is None else body.front_m
    left = contact.left + (body.length_m / 2 - front) * math.sin(contact.turn)
    return abs(left - (percent / 100.0 - 0.5) * track.ego[1])


def main() -> None:
    """Play all cases and print the largest differences of each test."""
    parser = argparse.ArgumentParser()
    parser.add_argument("-j", "--jobs", type=int, default=1)
    parser.add_argument("--only", action="append")
    options = parser.parse_args()
    references = reference_tracks()
    chosen = options.only or sorted({name.split("/")[0] for name in references})
    with TemporaryDirectory() as folder:
        results = cavsumo.suite(
            "euroncap-2026",
            ego="constant",
            only=chosen,
            trace="all",
            jobs=options.jobs,
            output=Path(folder) / "tracks.csv",
            progress=False,
        )
        print(table(results, references))


def table(results: cavsumo.Results, references: Mapping[str, Track]) -> str:
    """A line a test: cases, and the largest differences."""
    bodies = {test.name: SUITE.bodies[test.testers[0]["body"]] for test in SUITE.tests}
    worst: dict[str, list[tuple[float, ...]]] = defaultdict(list)
    for row in results.cases.assign(trace=results.rows["trace"].tolist()).to_dict("records"):
        case, test = row["case"], row["test"]
        if case in references:
            track = played_track(results.file.parent / row["trace"])
            found = list(compared(case, track, references[case]))
            place, speed = (max(column) for column in zip(*(f[1:] for f in found), strict=True))
            percent = row.get("impact_percent", math.nan)
            off = 0.0 if math.isnan(percent) else off_nominal(percent, bodies[test], track)
            worst[test].append((place, speed, off))
    lines = [f"{'test':8}{'cases':>6}{'place [m]':>11}{'speed [m/s]':>13}{'impact [m]':>12}"]
    everything = list(itertools.chain.from_iterable(worst.values()))
    for test, found in (*worst.items(), ("all", everything)):
        place, speed, off = (max(column) for column in zip(*found, strict=True))
        lines.append(f"{test:8}{len(found):6}{place:11.4f}{speed:13.4f}{off:12.4f}")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
