"""The used parts of a SUMO network file: elements, their attributes, and the values of these."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

FARTHEST = 1e8  # coordinates, lengths and times beyond it are damage [m, s]
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d{1,3})?", re.ASCII)
_WHOLE = re.compile(r"[-+]?\d{1,9}", re.ASCII)
# What nearly all numbers and shapes are like; others are looked at part by part.
_PLAIN = r"[-+]?\d{1,8}+(?:\.\d*+)?"
_PLAIN_NUMBER = re.compile(_PLAIN, re.ASCII)
_PLAIN_POINT = rf"{_PLAIN},{_PLAIN}(?:,{_PLAIN})?"
_PLAIN_SHAPE = re.compile(rf"{_PLAIN_POINT}(?: {_PLAIN_POINT})*+", re.ASCII)
_PLAIN_LINE = re.compile(rf"{_PLAIN_POINT}(?: {_PLAIN_POINT})++", re.ASCII)

INSIDE = ("internal", "crossing", "walkingarea")  # functions of the edges inside junctions
LEFT_OUT = ("connector",)  # of those that sumolib does not read
FUNCTIONS = ("", *INSIDE, *LEFT_OUT)


class Sort(NamedTuple):
    """A kind of attribute: whether a text is one, and what is expected, in words."""

    fits: Callable[[str], bool]
    words: str


def _is_number(text: str) -> bool:
    if _PLAIN_NUMBER.fullmatch(text):
        return True
    found = _NUMBER.fullmatch(text.strip())
    return found is not None and abs(float(text)) <= FARTHEST


def _is_shape(text: str) -> bool:
    if _PLAIN_SHAPE.fullmatch(text):
        return True
    points = [point.split(",") for point in text.split()]
    return all(len(point) in (2, 3) and all(map(_is_number, point)) for point in points)


def _is_line(text: str) -> bool:
    return _PLAIN_LINE.fullmatch(text) is not None or (len(text.split()) > 1 and _is_shape(text))


def _numbers(count: int) -> Sort:
    def fits(text: str) -> bool:
        parts = text.split(",")
        return len(parts) == count and all(map(_is_number, parts))

    return Sort(fits, f"{count} numbers with commas between")


NAME = Sort(lambda text: bool(text.strip()), "a name")
TEXT = Sort(lambda text: True, "a text")
NUMBER = Sort(_is_number, "a number")
SIZE = Sort(lambda text: _is_number(text) and float(text) >= 0.0, "a number of at least 0")
WHOLE = Sort(lambda text: _WHOLE.fullmatch(text.strip()) is not None, "a whole number")
INDEX = Sort(lambda text: WHOLE.fits(text) and int(text) >= 0, "a whole number of at least 0")
SHAPE = Sort(_is_shape, "points x,y with blanks between")
LINE = Sort(_is_line, "two points x,y or more, with blanks between")
FUNCTION = Sort(lambda text: text in FUNCTIONS, "one of " + ", ".join(filter(None, FUNCTIONS)))
BITS = Sort(lambda text: re.fullmatch("[01]+", text) is not None, "zeros and ones")
STEPS = Sort(lambda text: all(map(WHOLE.fits, text.split())), "whole numbers")
VERSION = Sort(
    lambda text: re.fullmatch(r"\d{1,4}(\.\d{1,4})+", text, re.ASCII) is not None,
    "a version such as 1.20",
)

Attributes = Mapping[str, Sort]
# What is used of each element: attributes that it must have, and those that it may.
ELEMENTS: Mapping[str, tuple[Attributes, Attributes]] = {
    "net": ({"version": VERSION}, {}),
    "location": (
        {
            "netOffset": _numbers(2),
            "convBoundary": _numbers(4),
            "origBoundary": _numbers(4),
            "projParameter": TEXT,
        },
        {},
    ),
    "type": ({"id": NAME}, {}),
    "edge": ({"id": NAME}, {"function": FUNCTION, "priority": WHOLE, "shape": SHAPE}),
    "lane": (
        {"speed": SIZE, "length": SIZE, "shape": LINE},
        {"width": NUMBER},
    ),
    "neigh": ({"lane": NAME}, {}),
    "junction": (
        {"id": NAME, "type": NAME, "x": NUMBER, "y": NUMBER, "incLanes": TEXT, "intLanes": TEXT},
        {"z": NUMBER, "shape": SHAPE},
    ),
    "request": ({"index": INDEX, "foes": BITS, "response": BITS}, {}),
    "connection": (
        {"from": NAME, "to": NAME, "fromLane": INDEX, "toLane": INDEX, "dir": TEXT, "state": TEXT},
        {"linkIndex": WHOLE, "linkIndex2": WHOLE},
    ),
    "tlLogic": ({"id": NAME, "programID": TEXT, "offset": NUMBER, "type": TEXT}, {}),
    "phase": (
        {"state": NAME, "duration": SIZE},
        {"minDur": SIZE, "maxDur": SIZE, "next": STEPS},
    ),
    "roundabout": ({"nodes": TEXT, "edges": TEXT}, {}),
    "param": ({"key": TEXT, "value": TEXT}, {}),
}
# Where elements that mean nothing elsewhere must stand.
PARENTS = {"lane": "edge", "request": "junction", "phase": "tlLogic", "neigh": "lane"}
