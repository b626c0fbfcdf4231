"""The script of a scenario: the ego's approach, the testers, and the storyboard."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from pydantic import ValidationError

from cavsumo.agents.rehearsal import nominal_contact
from cavsumo.errors import AgentError, InputError, UnknownName
from cavsumo.model.documents import first_problem
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.model.scenario.storyboard import EGO, HURRY, StoryEvent
from cavsumo.openscenario.actions import Actions, LeadingGap
from cavsumo.openscenario.board import elements_of, events_in, story_events
from cavsumo.openscenario.conditions import Conditions
from cavsumo.openscenario.ground import Ground
from cavsumo.openscenario.nodes import XmlNode
from cavsumo.openscenario.placing import Beginning, Beginnings

REHEARSED_S = 60.0
TOLERANCE_MPS = 0.3


def script_of(
    name: str, ego: str, step: float, beginnings: Beginnings, board: XmlNode, ground: Ground
) -> ScriptedTest:
    """The script of a scenario; raises InputError in one sentence.

    Args:
        name: of the test.
        ego: the name of the entity under test.
        step: length of a timestep [s].
        beginnings: of the entities.
        board: the element Storyboard, with the parameters of the scenario.
        ground: on which it is played.
    """
    read = _BoardReader(ego, step, beginnings, board, ground)
    names = [one for one in beginnings.entities if one != ego]
    actions, events = read.story(names)
    if actions.deleted:  # without them, bodies have other numbers
        names = [one for one in names if one not in actions.deleted]
        actions, events = read.story(names)
    if not names:
        raise board.refused("expected somebody besides the ego in the scenario")
    speeds = [a.to_mps for event in events for a in event.actions if a.to_mps is not None]
    fastest = max(speeds, default=0.0)
    everybody = {one: beginnings.of(board, one) for one in (ego, *names)}
    content: dict[str, Any] = {
        "name": name,
        "ego": _approach(everybody[ego], ground),
        "testers": [_programme(everybody[one], actions, ground, fastest) for one in names],
        "board": {
            "events": [event.model_dump() for event in events],
            "axles_m": {actions.ids[k]: one.entity.ahead for k, one in everybody.items()},
            "paces": actions.paces,
            "variables": dict(read.variables),
            "stops": read.stops(actions.ids),
        },
    }
    try:
        gone = nominal_contact(ScriptedTest.model_validate(content), REHEARSED_S)
        content["ego"]["meets_m"] = content["ego"]["start_m"] + gone
        return ScriptedTest.model_validate(content)
    except ValidationError as error:
        raise InputError(f"{board.xml.file!r}: {first_problem(error)}") from error
    except AgentError as error:
        raise InputError(f"{board.xml.file!r}: {error}") from error


class _BoardReader:
    """Reads the storyboard for some of the entities."""

    def __init__(
        self, ego: str, step: float, beginnings: Beginnings, board: XmlNode, ground: Ground
    ) -> None:
        self._ego, self._step, self._beginnings = ego, step, beginnings
        self._board, self._ground = board, ground
        self._events = list(events_in(board, beginnings.places))
        self.variables = beginnings.variables

    def story(self, names: list[str]) -> tuple[Actions, list[StoryEvent]]:
        """The events that may happen, and the reader of their actions."""
        ids = {self._ego: EGO} | {name: f"tester{i}" for i, name in enumerate(names)}
        move = self._ground.move
        actions = Actions(self._beginnings, self._ego, ids, move, self._step, self.variables)
        return actions, story_events(self._events, self._conditions(ids), actions)

    def stops(self, ids: Mapping[str, str]) -> Any:
        """The trigger that ends the episode."""
        stop = self._board.maybe("StopTrigger")
        return (self._conditions(ids).trigger(stop) if stop else None) or ()

    def _conditions(self, ids: Mapping[str, str]) -> Conditions:
        """The reader of conditions."""
        names, places = elements_of(self._events), self._beginnings.places
        found = Conditions(places, _body(ids), names, self.variables, self._ground.move)
        entities = ((name, self._beginnings.of(self._board, name)) for name in ids)
        found.backwards = {ids[name] for name, one in entities if one.backwards}
        return found


def _body(ids: Mapping[str, str]) -> Callable[[XmlNode, str], str]:
    """The function that gives the id of an entity's body."""

    def body(node: XmlNode, name: str) -> str:
        if name not in ids:
            place = f"{node.xml.file!r}: line {node.xml.line}: <{node.tag}>"
            raise UnknownName("entity", name, ids, place)
        return ids[name]

    return body


def _approach(ego: Beginning, ground: Ground) -> dict[str, Any]:
    """The ego's approach; its reference point follows the way."""
    if ego.course.times:
        raise ego.course.node.refused("the vehicle under test decides itself when it is where")
    return {
        "speed_mps": ego.speed,
        "start_m": ego.entity.front,
        "axle_m": ego.entity.front,
        "way": _way(ego, ground, 0.0),
        "length_m": ego.entity.length,
        "width_m": ego.entity.width,
        "tolerance_mps": min(TOLERANCE_MPS, ego.speed / 2),
    }


def _programme(one: Beginning, actions: Actions, ground: Ground, fastest: float) -> dict[str, Any]:
    """A tester at the beginning."""
    entity = one.entity
    found: dict[str, Any] = {
        "kind": entity.kind,
        "length_m": entity.length,
        "width_m": entity.width,
    }
    if one.course.times:
        track = actions.track_of(one.course, one)
        return found | {"track": _waited(track, one.track_from or 0.0)}
    if not one.course.straight and abs(entity.ahead) > 1e-6:
        raise one.course.node.refused(
            f"{entity.name}: ways with bends are understood for the ego, and for bodies whose "
            "reference point is the middle of their box"
        )
    top = HURRY * max(fastest, one.speed)
    way, speed, gap = _way(one, ground, entity.ahead), one.speed, actions.gaps.get(entity.name)
    if gap is not None:
        other = _behind(gap, actions)
        way = _led(way, gap, entity.length, other, ground)
        speed = other.speed if gap.kept else speed
    return found | {"way": way, "speed_mps": speed, "top_mps": top}


def _waited(track: dict[str, Any], begins: float) -> dict[str, Any]:
    """A track that begins later, at its first place until then, or that has begun before."""
    steps = round(begins / track["every_s"])
    places = track["points_m"]
    if steps >= 0:
        return {**track, "points_m": [places[0]] * steps + places}
    return {**track, "points_m": places[min(-steps, len(places) - 2) :]}


def _way(one: Beginning, ground: Ground, ahead: float) -> dict[str, Any]:
    """The way of a point so far before the reference point, from the beginning on."""
    x, y, o = ground.move(one.course.begin)
    return {
        "x_m": x + ahead * math.cos(o),
        "y_m": y + ahead * math.sin(o),
        "heading_rad": o,
        "legs": [
            {"length_m": leg.length, "curvature": leg.first, "to_curvature": leg.last}
            for leg in one.course.legs
            if leg.length > 0.0
        ],
    }


def _behind(gap: LeadingGap, actions: Actions) -> Beginning:
    """The beginning of the entity behind a gap."""
    if gap.after not in actions.ids or gap.after in actions.gaps:
        raise gap.node.refused(f"{gap.after} has no place of its own")
    other = actions.beginnings.of(gap.node, gap.after)
    if gap.kept and (other.course.times or not other.course.straight):
        raise gap.node.refused(f"continuous: expected false, {gap.after} does not go straight")
    return other


def _led(
    way: dict[str, Any], gap: LeadingGap, length: float, other: Beginning, ground: Ground
) -> dict[str, Any]:
    """A way that begins with a gap before another entity."""
    x, y, o = ground.move(other.course.begin)
    if math.cos(way["heading_rad"] - o) < 0.999:
        raise gap.node.refused(f"is understood for entities that go the way of {gap.after}")
    along = (way["x_m"] - x) * math.cos(o) + (way["y_m"] - y) * math.sin(o)
    by = other.entity.front + gap.metres + length / 2 - along
    return {**way, "x_m": way["x_m"] + by * math.cos(o), "y_m": way["y_m"] + by * math.sin(o)}
