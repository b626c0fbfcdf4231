"""A trace and its network into one page: data for the player, and the facts beside it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from cavsumo.assertions import ASSERTIONS
from cavsumo.batch.replay import Record
from cavsumo.model.geometry import Box
from cavsumo.model.stopping_zones import Zones, zone_polygons
from cavsumo.network.drawing.place import View, site_drawn
from cavsumo.network.site import Site
from cavsumo.report.pages.replay.curves import moment
from cavsumo.report.pages.replay.facts import facts, headline, marks, verdict
from cavsumo.report.pages.replay.packing import ANGLE, MILLI, NOTHING, columns, packed, shapes
from cavsumo.report.pages.replay.scenery import scenery
from cavsumo.report.pages.shell import render, write
from cavsumo.results.traces import Shape, Trace, states

FILES = Path(__file__).parent
ZONES = "reaction-zone"  # the assertion whose zones are drawn, with its parameters
MARGIN_M = 25.0  # of network around everybody
POSE = (MILLI, MILLI, MILLI, ANGLE)


def write_page(record: Record, trace: Trace, site: Site, file: Path) -> None:
    """Write an episode as one page; raises InputError when the file cannot be written."""
    write(page(record, trace, site), file)


def page(record: Record, trace: Trace, site: Site) -> str:
    """The page of an episode."""
    return render(
        FILES,
        "player",
        title=headline(record),
        outcome=record.row["outcome"],
        verdict=verdict(record.row),
        facts=facts(record, trace),
        command=record.command,
        episode=episode(record, trace, site),
    )


def episode(record: Record, trace: Trace, site: Site) -> dict[str, Any]:
    """The data of an episode, packed for the player."""
    met, frames = trace.shapes(), trace.frames
    curves = [moment(frame, met, site.roads) for frame in frames]
    zones = list(_zones(record, frames, met["ego"]))
    return {
        "dt": record.plan.scenario.step_length,
        "count": len(frames),
        "bodies": list(_tracks(frames, met)),
        "lights": packed(ord(letter) for frame in frames for letter in frame.get("lights", "")),
        "zones": {name: shapes(getattr(zone, name) for zone in zones) for name in Zones._fields},
        "speed": packed(round(c.speed * MILLI) for c in curves),
        "gap": packed(_or_nothing(c.gap) for c in curves),
        "ttc": packed(_or_nothing(c.ttc) for c in curves),
        "marks": marks(record.row),
        "tester": record.row["tester"],
        "scene": scenery(site_drawn(site), _extent(frames, site)),
    }


def _or_nothing(value: float | None) -> int:
    """A value in thousandths; where there is none, or it is beyond all graphs, a sign for that."""
    return NOTHING if value is None or value > 1e5 else round(value * MILLI)


def _tracks(
    frames: Sequence[Mapping[str, Any]], met: Mapping[str, Shape]
) -> Iterator[dict[str, Any]]:
    """Everybody's way, the ego first; who leaves and comes back has two."""
    open_: dict[str, tuple[str, int, list[list[float]]]] = {}
    done: list[tuple[str, str, int, list[list[float]]]] = []
    for i, frame in enumerate(frames):
        here = {name: (part, state) for part, name, state in states(frame)}
        for name in [name for name in open_ if name not in here]:
            done.append((name, *open_.pop(name)))
        for name, (part, state) in here.items():
            open_.setdefault(name, (part, i, []))[2].append(state)
    done += [(name, *track) for name, track in open_.items()]
    order = {"ego": 0, "tester": 1, "background": 2}
    for name, part, first, way in sorted(done, key=lambda t: (order[t[1]], t[2], t[0])):
        kind, length, width, _ = met[name]
        yield {
            "id": name,
            "part": part,
            "kind": kind,
            "size": [round(length, 3), round(width, 3)],
            "first": first,
            "way": columns(way, POSE),
        }


def _zones(record: Record, frames: Sequence[Mapping[str, Any]], shape: Shape) -> Iterator[Zones]:
    """The stopping zones at each timestep, as drawn by ``geometry``."""
    scenario = record.plan.scenario
    params = scenario.assertion_params if ZONES in scenario.assertions else {}
    assertion: Any = ASSERTIONS.make(ZONES, params)
    for frame in frames:
        x, y, v, o = frame["ego"]
        yield zone_polygons(
            Box(x, y, o, shape.length, shape.width),
            v,
            max_decel=assertion.max_decel,
            reaction_time=assertion.reaction_time,
            wheelbase=shape.wheelbase,
            steering=frame["steering"],
        )


def _extent(frames: Sequence[Mapping[str, Any]], site: Site) -> View:
    """What holds everybody at all times, and the ego's route [m]."""
    points = list(site.route.path.points)
    points += [(s[0], s[1]) for frame in frames for _, _, s in states(frame)]
    west, east = min(p[0] for p in points), max(p[0] for p in points)
    south, north = min(p[1] for p in points), max(p[1] for p in points)
    return west - MARGIN_M, south - MARGIN_M, east + MARGIN_M, north + MARGIN_M
