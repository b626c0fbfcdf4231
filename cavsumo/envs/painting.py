"""A snapshot as a picture from above, with Pillow: the place, the ego's zones, everybody.

The picture follows the ego. It is drawn twice as large and then reduced, for smooth edges.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.ops import substring

from cavsumo.agents.triggers import MAX_DECEL, REACTION_TIME
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.errors import InputError
from cavsumo.model.bodies import WALKING
from cavsumo.model.geometry import Box, corners
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.model.stopping_zones import zone_polygons
from cavsumo.network.drawing.place import COLOURS, GROUND, DrawnPlace, site_drawn

try:
    from PIL import Image, ImageDraw, ImageFont
except ModuleNotFoundError as error:
    raise InputError("render_mode rgb_array needs Pillow: pip install 'cavsumo[render]'") from error

WIDTH, HEIGHT = 720, 540  # px
SCALE = 11.0  # px/m
FINER = 2  # drawn so many times larger
AHEAD_M = 16.0  # the middle of the picture is so far ahead of the ego
LINES_M = {"borders": 0.14, "solid": 0.12, "dashed": 0.12, "route": 0.2}  # widths
DASHES_M = {"borders": 0.4, "dashed": 3.0, "route": 2.0}  # lengths of a dash, and of a gap
HEAD_M = 0.3  # radius of who walks, seen from above

EGO, TESTER, CAR, PERSON = "#1f5fa8", "#d6402b", "#f0f0ec", "#6a51a3"
BRAKING, REACTION = (214, 64, 43, 150), (245, 179, 1, 150)
LIGHTS = {"r": "#d7191c", "u": "#d7191c", "y": "#f5b301", "g": "#1a9641"}
UNLIT = "#f4f4f0"
TEXT, OUTLINE = "#222222", "#303030"

Points = Sequence[tuple[float, float]]


class Painter:
    """Paints the snapshots of a scenario."""

    def __init__(self, prepared: PreparedBatch) -> None:
        self._place = _dashed(site_drawn(prepared.site))
        self._font = ImageFont.load_default(15 * FINER)
        params = prepared.plan.scenario.assertion_params
        self._decel = float(params.get("max_decel", MAX_DECEL))
        self._reaction = float(params.get("reaction_time", REACTION_TIME))

    def paint(self, snapshot: Snapshot) -> NDArray[np.uint8]:
        """The picture, uint8 of shape (HEIGHT, WIDTH, 3)."""
        canvas = _Canvas(_middle(snapshot.ego))
        self._ground(canvas, snapshot)
        self._zones(canvas, snapshot)
        for body in snapshot.background:
            _draw(canvas, body, PERSON if body.body.kind.name in WALKING else CAR)
        for body in snapshot.testers:
            _draw(canvas, body, TESTER)
        _draw(canvas, snapshot.ego, EGO)
        self._words(canvas, snapshot)
        return canvas.pixels()

    def _ground(self, canvas: _Canvas, snapshot: Snapshot) -> None:
        """The place, and what the traffic lights on the ego's route show."""
        seen = self._place.within(canvas.window)
        for role, colour in COLOURS.items():
            for ring in seen.areas.get(role, ()):
                canvas.area(ring, colour)
            for points in seen.lines.get(role, ()):
                canvas.line(points, colour, LINES_M[role])
        for stop, letter in zip(self._place.stops, snapshot.lights, strict=False):
            canvas.line(stop.coords, LIGHTS.get(letter.lower(), UNLIT), 0.5)

    def _zones(self, canvas: _Canvas, snapshot: Snapshot) -> None:
        """The braking and the reaction zone of the reaction-zone assertion."""
        ego = snapshot.ego
        zones = zone_polygons(
            ego.box,
            ego.v,
            max_decel=self._decel,
            reaction_time=self._reaction,
            wheelbase=ego.body.kind.wheelbase,
            steering=snapshot.ego_steering,
        )
        for outline, colour in ((zones.braking, BRAKING), (zones.reaction, REACTION)):
            canvas.tint(outline, colour)

    def _words(self, canvas: _Canvas, snapshot: Snapshot) -> None:
        """Time and speed."""
        canvas.text(f"{snapshot.time:.1f} s   ego {snapshot.ego.v:.1f} m/s", self._font)


class _Canvas:
    """An image in metres around a point, x to the right and y up."""

    def __init__(self, middle: tuple[float, float]) -> None:
        self._scale = SCALE * FINER
        half_w, half_h = WIDTH / SCALE / 2, HEIGHT / SCALE / 2
        self._west, self._north = middle[0] - half_w, middle[1] + half_h
        self.window = (self._west, middle[1] - half_h, middle[0] + half_w, self._north)
        self._image = Image.new("RGB", (WIDTH * FINER, HEIGHT * FINER), GROUND)
        self._pen = ImageDraw.Draw(self._image, "RGBA")

    def area(self, points: Points, colour: str) -> None:
        """Fill one polygon."""
        self._pen.polygon(self._pixels(points), fill=colour)

    def line(self, points: Iterable[Sequence[float]], colour: str, width: float) -> None:
        """Draw one polyline of a width [m]."""
        self._pen.line(self._pixels(points), fill=colour, width=max(1, round(width * self._scale)))

    def tint(self, points: Points, colour: tuple[int, int, int, int]) -> None:
        """Fill one polygon with a colour that lets what is below through."""
        if len(points) > 2:
            self._pen.polygon(self._pixels(points), fill=colour)

    def body(self, points: Points, colour: str) -> None:
        """Fill one polygon with an outline."""
        self._pen.polygon(self._pixels(points), fill=colour, outline=OUTLINE, width=FINER)

    def dot(self, x: float, y: float, radius: float, colour: str) -> None:
        """Fill a circle with an outline."""
        ((px, py),) = self._pixels([(x, y)])
        self._pen.circle((px, py), radius * self._scale, colour, OUTLINE, FINER)

    def text(self, words: str, font: Any) -> None:
        """Write into the upper left corner."""
        left, top, right, bottom = self._pen.textbbox((24, 20), words, font=font)
        self._pen.rounded_rectangle(
            (left - 12, top - 9, right + 12, bottom + 9), 8, fill=(255, 255, 255, 215)
        )
        self._pen.text((24, 20), words, fill=TEXT, font=font)

    def pixels(self) -> NDArray[np.uint8]:
        """The finished picture."""
        return np.array(self._image.reduce(FINER), dtype=np.uint8)

    def _pixels(self, points: Iterable[Sequence[float]]) -> list[tuple[float, float]]:
        scale, west, north = self._scale, self._west, self._north
        return [((p[0] - west) * scale, (north - p[1]) * scale) for p in points]


def _middle(ego: BodyState) -> tuple[float, float]:
    """The middle of the picture: ahead of the ego."""
    return ego.x + AHEAD_M * math.cos(ego.o), ego.y + AHEAD_M * math.sin(ego.o)


def _draw(canvas: _Canvas, state: BodyState, colour: str) -> None:
    """A body's box, for vehicles with a windscreen; who walks has a nose."""
    canvas.body(corners(state.box), colour)
    kind, ahead = state.body.kind, (math.cos(state.o), math.sin(state.o))
    if kind.name in WALKING:
        tip = (state.x + 0.8 * ahead[0], state.y + 0.8 * ahead[1])
        canvas.line([(state.x, state.y), tip], OUTLINE, 0.12)
        canvas.dot(state.x, state.y, HEAD_M, colour)
    else:
        along = kind.length * 0.18
        glass = (state.x + along * ahead[0], state.y + along * ahead[1])
        pane = Box(*glass, state.o, kind.length * 0.14, kind.width * 0.8)
        canvas.tint(corners(pane), (30, 40, 55, 200))


def _dashed(place: DrawnPlace) -> DrawnPlace:
    """The place with its broken lines in dashes, which lie still while the picture moves."""
    lines = {
        role: [_dashes(line, DASHES_M[role]) for line in found] if role in DASHES_M else found
        for role, found in place.lines.items()
    }
    return dataclasses.replace(place, lines=lines)


def _dashes(line: shapely.LineString, length: float) -> shapely.Geometry:
    """A line as dashes with gaps of the same length [m]."""
    starts = np.arange(0.0, line.length, 2 * length).tolist()
    return shapely.MultiLineString([substring(line, s, s + length) for s in starts])
