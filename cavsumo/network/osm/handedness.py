"""The side of the road on which traffic keeps, by an extract's tags and place, and its certainty.

The areas are rough outlines of our own making, drawn around the countries that keep left. Along
their land borders they are off by tens of kilometres; over the sea they are wide.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from cavsumo.network.osm.extract import Box

Place = tuple[float, float]  # longitude, latitude [degrees]

# ISO 3166-1 codes of the countries and territories where traffic keeps left; UK is a common slip.
LEFT_CODES = frozenset(
    """
    AG AI AU BB BD BM BN BS BT BW CC CK CX CY DM FJ FK GB GD GG GS GY HK ID IE IM IN IO JE JM JP KE
    KI KN KY LC LK LS MO MS MT MU MV MW MY MZ NA NF NP NR NU NZ PG PK PN SB SC SG SH SR SZ TC TH TK
    TL TO TT TV TZ UG UK VC VG VI WS ZA ZM ZW
    """.split()
)

BOTH_SIDES = ("CN", "US")  # parts of these keep left: Hong Kong, Macau, the Virgin Islands

# Outlines as longitude,latitude in degrees; two points are opposite corners of a box.
LEFT_AREAS = {
    "Great Britain or Ireland": "-11,51 -6.5,49.7 -2.6,49.9 0.5,50.5 1.5,51 2,51.5 2,53"
    " -0.3,61 -11,58",
    "the Channel Islands": "-2.75,49.1 -1.95,49.8",
    "Malta": "14.1,35.7 14.6,36.1",
    "Cyprus": "32.2,34.5 34.7,35.75",
    "South Asia": "61.5,24 61.5,29.5 66.3,29.9 70,33.5 71.5,36.5 74.5,37 78,35.5 79,31.5 81.5,30.3"
    " 86,28 92,27.8 97,28.3 95,26.5 93.3,24 92.3,20.6 90,20 81.5,14 83.5,6 80,4.5 75,7 70.5,19"
    " 66,22.5",
    "the Andaman and Nicobar Islands": "92,6.5 94.2,13.8",
    "Lakshadweep": "71.5,8 74.2,12.5",
    "the Maldives": "72.5,-1 74,7.3",
    "Thailand, Malaysia or Singapore": "97.4,18.5 100.1,20.4 101.2,17.6 102.5,17.9 104.7,17.4"
    " 105.6,15.3 105,14.3 102.4,13.6 102.9,11.7 104.4,1.1 103.4,1.1 99.5,3 97,6 97.3,9 98.65,10"
    " 99.2,11.8 98.2,15",
    "Sumatra": "95,-7 105,6",
    "Borneo": "108.5,-4.5 119.3,-4.5 119.3,5.4 117.9,6 117,7.4 108.5,7.4",
    "Indonesia or Timor-Leste": "104,-11.5 141,4.5",
    "Papua New Guinea": "140.8,-12 157,-0.5",
    "the Solomon Islands": "155,-12.5 170.5,-5",
    "Australia": "112.9,-44 154,-9.9",
    "New Zealand": "166,-48 179.5,-34",
    "Fiji": "176.8,-20 180,-12",
    "Tonga": "-176.3,-22.5 -173.7,-15.4",
    "Samoa": "-172.9,-14.2 -171.3,-13.3",
    "Kiribati": "172.8,-3 177,3.5",
    "the Cook Islands": "-166,-22 -157,-8.5",
    "Japan": "122.8,24 131,29 128.5,32.5 129.1,34.8 132,36 136,38 139,42.5 141,45.7 146,44.5"
    " 142.5,38.5 141.5,34.5 132,30 131.5,26 126,23.5",
    "Hong Kong": "113.83,22.15 113.83,22.42 114,22.5 114.45,22.55 114.45,22.15",
    "Macau": "113.52,22.1 113.6,22.215",
    "Kenya, Uganda or Tanzania": "29.6,-1.3 29.6,0.8 31,3.6 34,4.2 35.9,5 41.9,4 41.5,-1.7 42,-2.5"
    " 41,-5 41.5,-10.5 34.6,-11.6 32.7,-9.2 30.8,-8.3 29.4,-6 29.6,-4.4 30.8,-3.3 30.8,-1.1",
    "Southern Africa": "11.7,-17.2 21.4,-17.9 22,-13 24,-12.9 24,-10.9 27,-11.8 29.8,-13.3"
    " 29.4,-12.3 28.4,-9.2 30.8,-8.3 33,-9.4 34.6,-11.6 41.3,-10.5 41.5,-15 37,-24 36,-28 31,-34.5"
    " 22,-36.5 17,-36 13,-27",
    "Mauritius": "57.2,-20.6 63.6,-19.5",
    "the Seychelles": "46,-10.5 56.5,-3.5",
    "the Falkland Islands": "-61.5,-52.6 -57.5,-50.9",
    "Guyana or Suriname": "-61.4,5.9 -60,8.6 -57,6.3 -54,6.1 -54,3.5 -54.6,2.2 -58,1.2 -60,4.5",
    "Jamaica": "-78.5,17.6 -76.1,18.6",
    "the Bahamas": "-79.4,27.3 -79.4,23.2 -77.8,23.2 -76.4,22 -74,22 -74,27.3",
    "the Cayman Islands": "-81.5,19.2 -79.7,19.8",
    "the Turks and Caicos Islands": "-72.5,21.1 -71,22",
    "the Virgin Islands": "-65.1,17.6 -64.2,18.8",
    "the Leeward Islands": "-62.9,16.6 -61.6,17.8",
    "Dominica": "-61.5,15.2 -61.2,15.65",
    "the Windward Islands": "-61.9,11.9 -59.4,14.15",
    "Trinidad and Tobago": "-61.9,10 -60.4,11.4",
    "Bermuda": "-64.9,32.2 -64.6,32.4",
    "the Bonin Islands": "141,24 143,28",
    "Lord Howe Island": "158.8,-31.8 159.4,-31.3",
    "Norfolk Island": "167.7,-29.3 168.2,-28.8",
    "the Chatham Islands": "-177.2,-44.6 -175.6,-43.4",
    "Nauru": "166.6,-0.8 167.2,-0.2",
    "Tuvalu": "175.8,-11 180,-5.4",
    "Niue": "-170.2,-19.3 -169.5,-18.7",
    "Tokelau": "-172.8,-9.6 -170.9,-8.3",
    "Kiritimati": "-158,1.4 -156.8,2.4",
    "the Pitcairn Islands": "-131,-25.5 -124,-23.5",
    "the Cocos Islands": "96.5,-12.5 97.2,-11.6",
    "the British Indian Ocean Territory": "71,-8 73,-5",
    "Saint Helena": "-6.2,-16.4 -5.3,-15.5",
    "Ascension": "-14.8,-8.3 -14,-7.6",
    "Tristan da Cunha": "-13,-37.6 -11.8,-36.8",
}
# How far inside an outline it can be relied on [km]; everywhere inside of those around islands.
RELIED_ON_KM = {
    "South Asia": 60.0,
    "Thailand, Malaysia or Singapore": 60.0,
    "Kenya, Uganda or Tanzania": 60.0,
    "Southern Africa": 60.0,
    "Guyana or Suriname": 60.0,
    "Japan": 15.0,  # the Kuril Islands
    "Hong Kong": 5.0,
    "Macau": 2.0,
}
OUTSIDE_KM = 60.0  # how far from all outlines traffic keeps right for certain
DEGREE_KM = 111.2


class Side(NamedTuple):
    """The side on which traffic keeps in the area of an extract.

    Attributes:
        left: it keeps left.
        why: the reason, as the first half of a sentence.
        certain: whether tags and place leave no doubt.
    """

    left: bool
    why: str
    certain: bool

    @property
    def words(self) -> str:
        """The reason and the side, as one sentence."""
        return f"{self.why}, where traffic keeps {'left' if self.left else 'right'}"


def side(hints: Mapping[tuple[str, str], int], bounds: Box) -> Side:
    """The side on which traffic keeps, by an extract's tags or else by its place.

    Args:
        hints: tags of the extract that tell country or side, and how often.
        bounds: west, south, east, north of the extract [degrees].
    """
    tagged, placed = _by_tags(hints), _by_place(bounds)
    if tagged is None:
        return placed
    if placed.certain:
        return tagged._replace(certain=tagged.left == placed.left)
    return tagged


def warning(found: Side, left_hand: bool) -> str | None:
    """The warning if the chosen side of the road is perhaps not that of the extract."""
    if found.left == left_hand:
        return None
    how = "with" if found.left else "without"
    return f"{found.words}: should this be imported {how} --left-hand?"


def _by_tags(hints: Mapping[tuple[str, str], int]) -> Side | None:
    """The side by most tags, driving_side before countries; certain if no tag contradicts."""
    sides, countries = Counter[str](), Counter[str]()
    for (key, value), count in hints.items():
        if key == "driving_side" and value in ("left", "right"):
            sides[value] += count
        elif key != "driving_side" and len(value) == 2 and value.upper() not in BOTH_SIDES:
            countries[value.upper()] += count
    if sides:
        word = max(sorted(sides), key=sides.__getitem__)
        return Side(word == "left", f"the extract is tagged driving_side={word}", len(sides) == 1)
    if countries:
        code = max(sorted(countries), key=countries.__getitem__)
        agreed = len({code in LEFT_CODES for code in countries}) == 1
        return Side(code in LEFT_CODES, f"by its tags the extract lies in {code}", agreed)
    return None


def _by_place(bounds: Box) -> Side:
    """The side by the outlines around the middle of the extract.

    It is certain if all of the extract is well inside one outline, or far from all."""
    west, south, east, north = bounds
    centre = (west + east) / 2, (south + north) / 2
    reach = _distance_km(centre, (east, north))
    inside: list[tuple[bool, str]] = []  # whether that is certain, and the area
    near = False
    for name, outline in _outlines().items():
        distance = min(_from_edge_km(centre, a, b) for a, b in pairwise([*outline, outline[0]]))
        if _within(outline, *centre):
            inside.append((distance >= reach + RELIED_ON_KM.get(name, 0.0), name))
        near = near or distance < reach + OUTSIDE_KM
    if inside:
        certain, name = max(inside, key=lambda found: found[0])
        return Side(True, f"by its coordinates the extract lies in {name} (roughly)", certain)
    return Side(False, "by its coordinates the extract lies in a country (roughly)", not near)


def _outlines() -> dict[str, list[Place]]:
    """The corners of each area."""
    found = {}
    for name, outline in LEFT_AREAS.items():
        points = [(float(a), float(b)) for a, b in (p.split(",") for p in outline.split())]
        if len(points) == 2:
            (x0, y0), (x1, y1) = points
            points = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        found[name] = points
    return found


def _distance_km(a: Place, b: Place) -> float:
    """The distance of two places near each other [km], on a plane that touches the earth at a."""
    east = math.remainder(b[0] - a[0], 360.0) * math.cos(math.radians(a[1]))
    return DEGREE_KM * math.hypot(east, b[1] - a[1])


def _from_edge_km(place: Place, a: Place, b: Place) -> float:
    """The distance of a place from an edge of an outline [km], on the same plane."""
    wide = math.cos(math.radians(place[1]))
    ax, ay, bx, by = (a[0] - place[0]) * wide, a[1] - place[1], (b[0] - a[0]) * wide, b[1] - a[1]
    length = bx * bx + by * by
    along = min(1.0, max(0.0, -(ax * bx + ay * by) / length)) if length else 0.0
    return DEGREE_KM * math.hypot(ax + along * bx, ay + along * by)


def _within(points: Sequence[Place], x: float, y: float) -> bool:
    """Whether a ray from a point to the east leaves a polygon: the point lies in it."""
    inside = False
    for (x0, y0), (x1, y1) in zip(points, [*points[1:], points[0]], strict=True):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            inside = not inside
    return inside
