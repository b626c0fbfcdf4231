"""Kept tests in coordinates relative to the ego's path, and the counts of a transfer."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import pytest
from inline import cavsumo as command

from cavsumo.errors import InputError
from cavsumo.kept.transfer import TransferParts, label, number_of, place_of
from cavsumo.kept.transfer_form import WalkedTrack
from cavsumo.kept.transferred import transferred
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.study import Part
from cavsumo.report.transfers import transfer_table
from cavsumo.results.columns import COLUMNS

DT = 0.1
STRIP, REACH = 1.2, 2.7  # m


def track(
    walks: list[tuple[float, float, float]],
    ego_v: list[float],
    start: tuple[float, float] = (50.0, 6.0),
    turned: float = 0.0,
) -> WalkedTrack:
    """A pedestrian from the left of an ego that drives to the east from the origin.

    Args:
        walks: legs: seconds, speed [m/s], heading [rad].
        ego_v: the ego's speed in each timestep [m/s].
        turned: the whole plane is turned by that angle [rad].
    """
    (x, y), poses = start, []
    for seconds, v, o in walks:
        for _ in range(round(seconds / DT)):
            poses.append((x, y, v, o))
            x, y = x + v * DT * math.cos(o), y + v * DT * math.sin(o)
    egos, along = [], 0.0
    for v in ego_v[: len(poses)]:
        egos.append((along, 0.0, v, 0.0))
        along += v * DT
    c, s = math.cos(turned), math.sin(turned)

    def moved(pose: tuple[float, ...]) -> tuple[float, ...]:
        px, py, v, o = pose
        return px * c - py * s, px * s + py * c, v, o + turned

    path = Polyline([(0.0, 0.0), (200.0 * c, 200.0 * s)])
    return WalkedTrack(list(map(moved, poses)), list(map(moved, egos)), path, STRIP, REACH, DT)


ACROSS = -math.pi / 2
CRUISE = [8.0] * 200


@pytest.mark.parametrize("turned", [0.0, 1.0, -2.5])
def test_a_straight_walk_is_found_again(turned: float) -> None:
    """Its speed, its heading, and the zone in which it enters the strip, on any road."""
    walk = track([(2.0, 0.0, ACROSS), (5.0, 1.4, ACROSS + 0.3)], CRUISE, turned=turned)
    programme = walk.programme("t")
    assert programme.speed == pytest.approx(1.4)
    assert programme.heading == pytest.approx(0.3)
    assert not programme.stops
    enters = 2.0 + (6.0 - STRIP) / (1.4 * math.cos(0.3))
    assert walk.enters * DT == pytest.approx(enters, abs=DT)
    meets = 50.0 + (6.0 - STRIP) * math.tan(0.3)
    gap = meets - REACH - 8.0 * walk.enters * DT
    assert programme.cue == pytest.approx((gap - 8.0**2 / (2 * 9.0)) / (0.675 * 8.0), abs=0.05)


def test_the_zone_is_that_before_the_ego_brakes_for_the_body() -> None:
    """So a braking ego does not move the trigger."""
    walks = [(2.0, 0.0, ACROSS), (5.0, 1.4, ACROSS)]
    braking = [8.0] * 40 + [max(0.0, 8.0 - 0.4 * i) for i in range(160)]
    assert track(walks, braking).programme("t").cue == pytest.approx(
        track(walks, CRUISE).programme("t").cue, abs=0.05
    )


def test_a_body_that_waits_before_the_strip_goes_on_by_the_ego() -> None:
    """Its pause becomes a zone, and its last leg has a speed of its own."""
    walks = [(1.0, 0.0, ACROSS), (3.0, 1.0, ACROSS), (2.0, 0.0, ACROSS), (3.0, 1.4, ACROSS)]
    programme = track(walks, [6.0] * 200).programme("t")
    assert programme.speed == pytest.approx(1.0)
    assert programme.speed_2 == pytest.approx(1.4)
    assert programme.depth == pytest.approx(STRIP - 3.0, abs=0.11)
    assert isinstance(programme.resume, float)
    assert programme.pause == 0.0


def test_a_body_that_stops_in_the_strip_pauses() -> None:
    """For as long as it did."""
    walks = [(1.0, 0.0, ACROSS), (4.0, 1.4, ACROSS), (1.5, 0.0, ACROSS), (1.0, 1.4, ACROSS)]
    programme = track(walks, CRUISE).programme("t")
    assert programme.pause == pytest.approx(1.5, abs=0.11)
    assert programme.resume is None
    assert programme.depth == pytest.approx(STRIP - (6.0 - 5.6), abs=0.15)


def test_what_has_no_relative_form_is_refused() -> None:
    """A body that begins in the ego's way, and an ego that stands."""
    with pytest.raises(InputError, match="begins in the ego's way"):
        track([(3.0, 1.0, ACROSS)], CRUISE, start=(50.0, 1.0)).programme("t")
    with pytest.raises(InputError, match="the ego stands"):
        track([(1.0, 0.0, ACROSS), (5.0, 1.4, ACROSS)], [0.1] * 200).programme("t")


def test_episodes_and_places_are_counted(tmp_path: Path) -> None:
    """Preventable failures again, in episodes and at places, with exact intervals."""
    rows = [
        (label(0, 0, "zone"), "violated", "1"),
        (label(0, 0, "phase"), "violated", "1"),
        (label(0, 1, "zone"), "held", ""),
        (label(0, 1, "phase"), "violated", "0"),
        (label(1, 0, "zone"), "error", ""),
        (label(1, 0, "phase"), "unfair", ""),
    ]
    file = tmp_path / "out-a.csv"
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, list(COLUMNS), lineterminator="\n")
        writer.writeheader()
        for run, (agent, outcome, avoidable) in enumerate(rows):
            given = {"run": run, "agent": agent, "outcome": outcome, "avoidable": avoidable}
            writer.writerow(given)
    parts = TransferParts(("x", "y"), ("a", "b"), (Part("a", {}),), {})
    found = {(one.test, one.net): one for one in transferred(parts, [file])}
    x, y, both = found["x", "a"], found["y", "a"], found["all", "all"]
    assert (x.places, x.episodes, x.failures, x.again.count, x.again_at.count) == (2, 4, 3, 2, 1)
    assert x.again.low == pytest.approx(0.0676, abs=1e-4)  # Clopper and Pearson for 2 of 4
    assert x.again.high == pytest.approx(0.9324, abs=1e-4)
    assert (y.places, y.episodes, y.errors, y.again_at.total) == (1, 1, 1, 1)
    assert (both.places, both.episodes, both.again.count) == (3, 5, 2)
    assert found["x", "b"].again.value is None
    assert transfer_table([x, found["x", "b"]]).splitlines() == [
        "test  network  places  fails at         [95 %]  episodes  fail   again         [95 %]",
        "x     a             2         1  [ 1.3,  98.7]         4     3  50.0 %  [ 6.8,  93.2]",
        "x     b             0         0                        0     0",
    ]


def test_labels_tell_tests_and_places() -> None:
    """In any form."""
    assert (number_of(label(11, 3, "zone")), place_of(label(11, 3, "zone"))) == (11, "t12-p4")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["no.cavtest", "--net", "crossing"], "no such file: 'no.cavtest'"),
        (["results.csv", "--net", "crossing"], "expected a kept test (.cavtest), or a row as"),
        (["a.csv:1", "--net", "crosing"], "unknown network 'crosing'; did you mean 'crossing'?"),
        (["a.csv:1", "--net", "crossing", "--ego", "nobody"], "unknown ego 'nobody'"),
        (["a.csv:1", "--net", "crossing", "--places", "0"], "--places: expected 1 to 1000, got 0"),
        (["a.csv:1", "--net", "crossing", "--ego-param", "a=1"], "--ego-param: needs --ego"),
    ],
    ids=["file", "form", "net", "ego", "places", "param"],
)
def test_what_is_wrong_is_said_before_anything_is_played(
    tmp_path: Path, words: list[str], said: str
) -> None:
    """One sentence, exit status 2, nothing written."""
    done = command(tmp_path, "transfer", *words)
    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())
