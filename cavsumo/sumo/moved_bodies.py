"""The ego and the testers as bodies in SUMO: inserted once, then told where they are.

SUMO's own states of moved bodies are never read back: their true states are in Python.
"""

from __future__ import annotations

from collections.abc import Sequence

import libsumo
import shapely

from cavsumo.egos.base import Ego
from cavsumo.model.bodies import PEDESTRIAN
from cavsumo.model.carriageway import Start
from cavsumo.model.departures import Entry
from cavsumo.model.geometry import Box, gap
from cavsumo.model.scenario import Scenario
from cavsumo.model.snapshot import BodyState
from cavsumo.network.site import Site
from cavsumo.sumo.calls import direct
from cavsumo.sumo.poses import from_sumo, front
from cavsumo.sumo.vehicle_types import type_of

EGO = "ego"
KEEP_EXACT = 2  # moveToXY: exactly there, on the network or off it
KEEP_EXACT_ANY_LANE = 6  # the same for persons, on lanes for cars too
# moveToXY looks for lanes within this distance only; SUMO's default of 100 m costs ten times as
# much per call for a body off the road, and no lane is wider than twice this.
MATCH_M = 5.0
ROOM_M = 2.0  # traffic nearer to a tester vehicle than this at the start is removed
UNSAFE = 0  # setSpeedMode: none of SUMO's checks changes the commanded speed


class MovedBodies:
    """The moved bodies of one episode."""

    def __init__(self, scenario: Scenario, site: Site, ego: Ego) -> None:
        self._scenario, self._site, self._ego = scenario, site, ego
        self._persons = scenario.embodiment == "person"
        # Of each body the state that SUMO was told, and the arguments with which it was.
        self._told: dict[str, tuple[BodyState, tuple[float, float, float]]] = {}
        self._move = direct(libsumo.vehicle, "moveToXY")
        self._set_speed = direct(libsumo.vehicle, "setSpeed")

    def insert(
        self, states: Sequence[BodyState], starts: Sequence[Start], entry: Entry | None = None
    ) -> None:
        """Add the ego and the testers, each at its place before the first timestep.

        ``entry``: where the ego enters, if not at the beginning of its route.
        """
        route = self._site.route
        # That of a script enters standing, which SUMO always allows, and then has its speed.
        speed = self._ego.depart_speed if self._scenario.script is None else 0.0
        speed = speed if entry is None else entry.speed
        libsumo.vehicle.add(
            EGO,
            "cavsumo_ego",
            typeID="cavsumo_ego",
            departLane=str(route.lane if entry is None else entry.lane),
            departPos=f"{route.depart_m if entry is None else entry.along}",
            departSpeed="max" if speed is None else f"{speed}",
            arrivalPos=f"{route.arrive_m}",
        )
        for state, start in zip(states, starts, strict=True):
            if self._is_person(state):
                edges = start.walk or route.edges
                libsumo.person.add(state.id, edges[0], 0.0, typeID="cavsumo_person")
                libsumo.person.appendWalkingStage(state.id, list(edges), 0.0)
            else:
                name = type_of(self._scenario, state.body)
                libsumo.vehicle.add(state.id, _route_of(start), typeID=name)
        self.place(states)

    def entered(self, states: Sequence[BodyState]) -> None:
        """Let SUMO keep the testers' speeds from now on, which it now has as vehicles."""
        for state in states:
            if not self._is_person(state):
                libsumo.vehicle.setSpeedMode(state.id, UNSAFE)

    def place(self, states: Sequence[BodyState]) -> None:
        """Send SUMO the bodies' positions; in every timestep, or it moves them itself.

        Raises SimulationError for a state that is not finite.
        """
        if self._persons:
            self._place_any(states)
            return
        move, told = self._move, self._told
        for state in states:
            name, v = state[0].id, state[3]
            before, pose = told.get(name) or (None, None)
            # A body that stands keeps its very record, and SUMO the speed that it was told.
            if before is not state or pose is None:
                pose = front(state)
                told[name] = state, pose
            x, y, angle = pose
            move(name, "", -1, x, y, angle, KEEP_EXACT, MATCH_M)
            # Followers would else see a speed that SUMO infers, wrong by up to 6 m/s.
            if before is None or before[3] != v:
                self._set_speed(name, v)

    def _place_any(self, states: Sequence[BodyState]) -> None:
        """``place`` where some bodies are persons."""
        for state in states:
            x, y, angle = front(state)
            if self._is_person(state):
                on_crossing = shapely.contains_xy(self._site.crossings, x, y)
                keep = KEEP_EXACT if on_crossing else KEEP_EXACT_ANY_LANE
                libsumo.person.moveToXY(state.id, "", x, y, angle, keep, MATCH_M)
            else:
                self._move(state.id, "", -1, x, y, angle, KEEP_EXACT, MATCH_M)
                self._set_speed(state.id, state.v)

    def _is_person(self, state: BodyState) -> bool:
        """Whether a body is a person in SUMO; only pedestrians can be."""
        return self._persons and state.body.kind.name == PEDESTRIAN.name


def make_room(
    names: Sequence[str], states: Sequence[BodyState], starts: Sequence[Start]
) -> Sequence[str]:
    """Remove traffic that SUMO inserted at the place of a tester vehicle; the names that are left.

    Departures of the first timestep are inserted before the testers.
    """
    boxes = [s.box for s, start in zip(states, starts, strict=True) if start.approach]
    mine = {EGO, *(s.id for s in states)}
    if not boxes:
        return names
    for name in names:
        length, width = libsumo.vehicle.getLength(name), libsumo.vehicle.getWidth(name)
        x, y = libsumo.vehicle.getPosition(name)
        pose = from_sumo(x, y, libsumo.vehicle.getAngle(name), length)
        if name not in mine and min(gap(Box(*pose, length, width), b) for b in boxes) < ROOM_M:
            libsumo.vehicle.remove(name)
    found: Sequence[str] = libsumo.vehicle.getIDList()
    return found


def _route_of(start: Start) -> str:
    """The id of SUMO's route for a tester: its way, by which SUMO's drivers anticipate it."""
    if start.approach is None:
        return "cavsumo_tester"
    name = " ".join(("cavsumo", *start.approach.edges))
    if name not in libsumo.route.getIDList():  # a shared simulation has it already
        libsumo.route.add(name, list(start.approach.edges))
    return name
