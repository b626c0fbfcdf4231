"""Geometry of exports: bodies that come and go, bounds of lanelets, roads that join."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from itertools import pairwise

import pytest

from cavsumo.interop.lanelets import beside
from cavsumo.interop.opendrive import mend
from cavsumo.interop.plan_view import End, ends, set_lengths
from cavsumo.interop.tracks import TrackPoint, driven, set_off, stays
from cavsumo.results.traces import Trace

BODIES = [
    {"box": ["car", 4.5, 1.75, 3.0], "ids": ["ego", "late", "twice"]},
    {"box": ["pedestrian", 0.66, 0.88, 0.33], "ids": ["tester0"]},
]


def _frame(step: int, *there: str) -> dict[str, object]:
    """A frame in which everybody drives to the east, and the heading jumps by a turn."""
    state = [float(step), 0.0, 1.0, math.pi - 0.1 if step % 2 else -math.pi + 0.1]
    background = {name: state for name in there}
    testers = {"tester0": state}
    return {"time_s": step / 10, "ego": state, "testers": testers, "background": background}


def test_bodies_come_and_go() -> None:
    """Tracks without holes, headings without jumps."""
    frames = [_frame(0, "twice"), _frame(1, "late"), _frame(2, "late", "twice"), _frame(3, "late")]
    found = {body.name: body for body in stays(Trace({"bodies": BODIES}, frames))}
    assert list(found) == ["ego", "tester0", "twice", "late"]
    assert [body.part for body in found.values()] == ["ego", "tester", *["background"] * 2]
    assert [(b.late, b.early) for b in found.values()] == [
        (False, False), (False, False), (False, True), (True, False),
    ]  # fmt: skip
    assert [[one.time for one in way] for way in found["twice"].tracks] == [[0.0], [0.2]]
    headings = [one.heading for one in found["ego"].tracks[0]]
    assert max(abs(b - a) for a, b in pairwise(headings)) < 0.21


def test_a_body_sets_off_where_it_last_stood() -> None:
    """The moment, and how far it has come."""
    ways = [(0.0, 1.0), (0.1, 0.0), (0.1, 0.0), (0.2, 1.0)]
    track = [TrackPoint(i / 10, x, 0.0, 0.0, v) for i, (x, v) in enumerate(ways)]
    assert set_off(track) == 2
    assert set_off(track[:1]) is None
    assert driven(track) == pytest.approx([0.0, 0.1, 0.1, 0.2])


def test_bounds_of_a_bend_meet_as_parallels_do() -> None:
    """A right angle to the left: the inner bound turns at (4, 1), the outer one at (6, -1)."""
    line = [(0.0, 0.0), (5.0, 0.0), (5.0, 5.0)]
    assert beside(line, 1.0) == [pytest.approx(p) for p in [(0.0, 1.0), (4.0, 1.0), (4.0, 5.0)]]
    assert beside(line, -1.0) == [pytest.approx(p) for p in [(0.0, -1.0), (6.0, -1.0), (6.0, 5.0)]]


ROAD = """<road id="{id}" length="{length}" junction="{junction}"><link>{link}</link>
<planView><geometry s="0" x="{x}" y="{y}" hdg="{hdg}" length="{length}"><line/></geometry>
</planView><lanes><laneSection s="0"><{side}>{lanes}</{side}><center><lane id="0"/></center>
</laneSection></lanes>
<objects><object id="o" s="{length}"/></objects></road>"""
LANE = (
    """<lane id="-{id}" type="{type}"><link>{link}</link><width sOffset="0" a="{width}"/></lane>"""
)


def _lanes(*widths: float, links: str = "") -> str:
    """A pavement and lanes to the right of it."""
    kinds = ["sidewalk", *["driving"] * len(widths)]
    return "".join(
        LANE.format(id=i + 1, type=kinds[i], width=width, link=links.format(id=i + 1))
        for i, width in enumerate(widths)
    )


def _document() -> ET.Element:
    """Two roads at a right angle, and a road through the junction that misses both.

    As netconvert writes them for traffic that keeps left.
    """
    both = '<predecessor id="-{id}"/><successor id="-{id}"/>'
    through = (
        '<predecessor elementType="road" elementId="1" contactPoint="end"/>'
        '<successor elementType="road" elementId="2" contactPoint="start"/>'
    )
    one = ROAD.format(id=1, length=10, junction=-1, link="", x=0, y=0, hdg=0, side="right",
                      lanes=_lanes(2, 3.2))  # fmt: skip
    two = ROAD.format(id=2, length=10, junction=-1, link="", x=20, y=10, hdg=math.pi / 2,
                      side="right", lanes=_lanes(3, 4.0))  # fmt: skip
    three = ROAD.format(id=3, length=15, junction=7, link=through, x=10.3, y=0.2, hdg=0.1,
                        side="left", lanes=_lanes(2, 3.2, links=both))  # fmt: skip
    return ET.fromstring(f'<OpenDRIVE><header revMinor="4"/>{one}{two}{three}</OpenDRIVE>')


def test_roads_through_junctions_join_their_lanes() -> None:
    """The lane for vehicles begins and ends where the joined ones do, as wide as they are."""
    root = _document()
    mend(root)
    road = root.findall("road")[2]
    start, stop = ends(road)
    assert start == pytest.approx(End(10.0, 0.0, 0.0), abs=1e-6)
    assert stop == pytest.approx(End(20.0, 10.0, math.pi / 2), abs=1e-6)
    right = road.find("lanes/laneSection/right")
    assert right is not None
    assert road.find("lanes/laneSection/left") is None
    length = float(str(road.get("length")))
    for lane, before, after in zip(right, (2.0, 3.2), (3.0, 4.0), strict=True):
        width = lane.find("width")
        assert width is not None
        a, b, c, d = (float(str(width.get(letter))) for letter in "abcd")
        assert a == before
        assert a + b * length + c * length**2 + d * length**3 == pytest.approx(after)


def test_curves_have_their_own_length() -> None:
    """A straight cubic of 8 m that says 10 m; what stands at its end still does."""
    road = ET.fromstring(
        ROAD.format(id=1, length=10, junction=-1, link="", x=0, y=0, hdg=0, side="right", lanes="")
    )
    line = next(road.iter("geometry"))
    line[:] = [ET.fromstring('<paramPoly3 bU="2" cU="3" dU="3" pRange="normalized"/>')]
    set_lengths(road)
    assert float(str(road.get("length"))) == pytest.approx(8.0)
    assert float(str(next(road.iter("object")).get("s"))) == pytest.approx(8.0)
