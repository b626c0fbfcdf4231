"""The one boundary to SUMO; nothing else imports libsumo.

SUMO receives the positions of the bodies and moves the background traffic (and the ego, unless a
controller drives it). Its states of moved bodies are never read back: their true states are in
Python.

Each process has one simulation, as libsumo requires.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import libsumo
import shapely

from cavsumo.egos.base import Acceleration, Command, Drive, Ego
from cavsumo.errors import EgoError, NoSuchAction, SimulationError, SimulationTaken
from cavsumo.model.bodies import PEDESTRIAN, Body
from cavsumo.model.carriageway import Start
from cavsumo.model.departures import Demand
from cavsumo.model.geometry import Box, gap
from cavsumo.model.kinematics import steering_for_turn, step_floats, wrap
from cavsumo.model.scenario import Scenario, Simulation
from cavsumo.model.snapshot import BodyState, RawState, Snapshot
from cavsumo.network.site import Site
from cavsumo.sumo.background import Background, Roaming, roaming
from cavsumo.sumo.connection import Simulations
from cavsumo.sumo.demand import DepartureNotes
from cavsumo.sumo.guided import GuidedEgo
from cavsumo.sumo.poses import from_sumo, front
from cavsumo.sumo.reseeding import reseed
from cavsumo.sumo.vehicle_types import type_of

EGO = "ego"
ENTRY_S = 30.0  # longest wait of the ego for room to enter the network
PROMPT_S = 1.0  # after a longer wait of the ego the traffic light is set once more
KEEP_EXACT = 2  # moveToXY: exactly there, on the network or off it
KEEP_EXACT_ANY_LANE = 6  # the same for persons, on lanes for cars too
# moveToXY looks for lanes within this distance only; SUMO's default of 100 m costs ten times as
# much per call for a body off the road, and no lane is wider than twice this.
MATCH_M = 5.0
ROOM_M = 2.0  # traffic nearer to a tester vehicle than this at the start is removed
UNSAFE = 0  # setSpeedMode: none of SUMO's checks changes the commanded speed
# The world that has the one simulation of this process: the one that last began an episode.
_PLAYING: list[object] = [None]


class World:
    """One SUMO simulation at a time; a context manager.

    A world that begins an episode takes the simulation from any other world in this process.

    Attributes:
        simulations: starts and advances SUMO.
        collisions: pairs that SUMO itself reported as colliding in this episode.
        begun: how many episodes have begun here.
        teleports, emergency_stops: how many SUMO reported in this episode.
    """

    def __init__(self, scenario: Scenario, site: Site, ego: Ego) -> None:
        self.scenario, self.site, self.ego = scenario, site, ego
        self.dt = scenario.step_length
        self.ego_body = Body(EGO, ego.kind)
        self._persons = scenario.embodiment == "person"
        self._folder = TemporaryDirectory(prefix="cavsumo-")
        folder = Path(self._folder.name)
        self._heard = (folder / "stderr.log").open("ab")
        self.simulations = Simulations(libsumo, scenario, site, ego, folder)
        self._roaming: Roaming | None = None
        self.begun = 0
        self._calls: list[tuple[str, tuple[Any, ...]]] = []  # what ``again`` does again
        self._mark = object()  # stands for this world in _PLAYING without keeping it alive
        shapely.prepare(site.crossings)
        self._walks = [crossing.light for crossing in site.marked]
        # Each light is asked once a timestep, however many of its links matter.
        self._lights = {light.id for light in site.lights} | {w[0] for w in self._walks if w}

    def __enter__(self) -> World:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the simulation; harmless if there is none, or if another world has it."""
        if _PLAYING[0] in (None, self._mark):
            libsumo.close()
            _PLAYING[0] = None
        self._heard.close()
        self._folder.cleanup()

    def reset(
        self,
        seed: int,
        states: Sequence[BodyState],
        starts: Sequence[Start],
        *,
        everything: bool = True,
        simulation: Simulation = "own",
        demand: Demand | None = None,
        note: bool = False,
    ) -> Snapshot:
        """Begin an episode and wait until the ego is on the road; the testers stand at their
        starts.

        Args:
            simulation: "own" starts SUMO afresh, for the same bits after any history; "new"
                starts one that serves several episodes, of which the later ones say "same".
            everything: show the whole background in every snapshot; else only those who may touch
                the ego or a tester, which is all that contacts need.
            demand: departures that were noted in another episode, in place of the scenario's own
                demand; only in an own simulation.
            note: note who departs (``departures``).

        Raises SimulationError with SUMO's message if SUMO refuses, or if the ego finds no room to
        enter.
        """
        self.begun += 1
        how = everything, simulation, demand, note
        self._calls = [("_begin", (seed, tuple(states), tuple(starts), *how))]
        return self._begin(seed, states, starts, *how)

    def _begin(
        self,
        seed: int,
        states: Sequence[BodyState],
        starts: Sequence[Start],
        everything: bool,
        simulation: Simulation,
        demand: Demand | None,
        note: bool,
    ) -> Snapshot:
        """Begin an episode, see ``reset``."""
        self.collisions: set[tuple[str, str]] = set()
        self.teleports = self.emergency_stops = 0
        self._driven: BodyState | None = None
        self._told: dict[str, tuple[BodyState, tuple[float, float, float]]] = {}
        self._step, self._steering = 0, 0.0
        self._commanded = False
        self._vehicles: tuple[str, ...] = ()
        self._departures: DepartureNotes | None = None
        script = self.scenario.script
        self._guided = None if script is None else GuidedEgo(libsumo, script, self.ego_body)
        if simulation == "same":
            self._check_own()
        _PLAYING[0] = self._mark
        with self._listening():
            self.simulations.begin(seed, simulation, demand)
            if note:
                self._departures = self._notes(demand, states)
            self._insert(states, starts)
            ego = self._enter(states)
            self._make_room(states, starts)
        self._ego, self._states = ego, tuple(states)
        self._everything = everything
        self._background = self._lookout(everything, (ego, *states))
        return self._snapshot(ego, tuple(states))

    @property
    def told(self) -> int:
        """How many calls have led here from the beginning of the episode."""
        return len(self._calls)

    @property
    def repeatable(self) -> bool:
        """Whether the simulation belongs to this episode alone, so that its past is known."""
        (_, (*_, simulation, _, _)), *_ = self._calls
        return bool(simulation == "own")

    def again(self, told: int) -> Snapshot | None:
        """Bring a new simulation to an earlier moment of the episode, by telling it the same.

        Args:
            told: how many calls had led there (``told``).

        Returns the last snapshot of then, with the same bits if SUMO does the same again.
        """
        assert self.repeatable
        self._calls = self._calls[:told]
        snapshot: Snapshot | None = None
        for name, arguments in tuple(self._calls):
            snapshot = getattr(self, name)(*arguments)
        return snapshot

    def reseed(self, seed: int) -> None:
        """Let SUMO draw other random numbers from now on, those of a start with that seed.

        Raises SimulationError if this build of libsumo cannot.
        """
        reseed(libsumo, seed)

    def show_everybody(self) -> Snapshot:
        """This moment with the whole background, which is shown from now on."""
        if not self._everything:
            self._everything = True
            self._background = self._lookout(True, (self._ego, *self._states))
        return self._snapshot(self._ego, self._states)

    def everybody(self) -> tuple[RawState, ...]:
        """All bodies but the ego and the testers, at any distance."""
        watchers = (self._ego, *self._states)
        background = Background(libsumo.vehicle, libsumo.person, None, self.dt, watchers)
        return background.read(self._vehicles, libsumo.person.getIDList(), watchers)

    def shift(self, states: tuple[BodyState, ...]) -> Snapshot:
        """The first snapshot once more, with the testers elsewhere; before any timestep."""
        self._calls.append(("_shift", (states,)))
        return self._shift(states)

    def _shift(self, states: tuple[BodyState, ...]) -> Snapshot:
        """The first snapshot with the testers elsewhere."""
        self._states = states
        return self._snapshot(self._ego, states)

    def step(self, states: tuple[BodyState, ...], command: Command) -> Snapshot | None:
        """Advance one timestep; None when the ego has left the network.

        Args:
            states: the testers' states at its end.
            command: the ego's command during it.

        Raises SimulationTaken when another world has begun an episode meanwhile.
        """
        self._calls.append(("_go_on", (states, command)))
        return self._go_on(states, command)

    def _go_on(self, states: tuple[BodyState, ...], command: Command) -> Snapshot | None:
        """Advance one timestep, see ``step``."""
        if _PLAYING[0] is not self._mark:
            self._check_own()
        try:
            self._place(states)
            self._command_ego(command)
            self._advance()
            self._collect_events()
            ego = self._read_ego() if self._driven is None else self._driven
        except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
            raise SimulationError(f"SUMO: {error}") from error
        self._step += 1
        if ego is None:
            return None
        if self._driven is None:
            self._steering = self._implied_steering(ego)
        self._ego, self._states = ego, states
        return self._snapshot(ego, states)

    def _check_own(self) -> None:
        """Refuse to continue in a simulation that another world has taken or closed."""
        if _PLAYING[0] is not self._mark:
            raise SimulationTaken(
                "this process has one simulation, and another world took or closed it; begin a new "
                "episode here, or play each world in a process of its own"
            )

    @contextmanager
    def _listening(self) -> Iterator[None]:
        """Turn SUMO's refusals into SimulationError with the message that it prints on stderr."""
        with suppress(OSError):  # in a fork it leads nowhere
            self._heard.truncate(0)
        stderr = os.dup(2)
        os.dup2(self._heard.fileno(), 2)
        try:
            yield
        except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
            words = Path(self._heard.name).read_text(errors="replace") or str(error)
            lines = [" ".join(line.split()) for line in words.splitlines()]
            said = [line for line in lines if line and not line.startswith("Quitting")]
            raise SimulationError("SUMO: " + " ".join(dict.fromkeys(said[:4]))) from error
        finally:
            os.dup2(stderr, 2)
            os.close(stderr)

    # Bodies in SUMO

    def _insert(self, states: Sequence[BodyState], starts: Sequence[Start]) -> None:
        """Add the ego and the testers, each at its place before the first timestep."""
        route = self.site.route
        # That of a script enters standing, which SUMO always allows, and then has its speed.
        speed = self.ego.depart_speed if self._guided is None else 0.0
        libsumo.vehicle.add(
            EGO,
            "cavsumo_ego",
            typeID="cavsumo_ego",
            departLane=str(route.lane),
            departPos=f"{route.depart_m}",
            departSpeed="max" if speed is None else f"{speed}",
            arrivalPos=f"{route.arrive_m}",
        )
        for state, start in zip(states, starts, strict=True):
            if self._is_person(state):
                edges = start.walk or route.edges
                libsumo.person.add(state.id, edges[0], 0.0, typeID="cavsumo_person")
                libsumo.person.appendWalkingStage(state.id, list(edges), 0.0)
            else:
                libsumo.vehicle.add(
                    state.id, _route_of(start), typeID=type_of(self.scenario, state.body)
                )
        self._place(states)

    def _enter(self, states: Sequence[BodyState]) -> BodyState:
        """Step until the ego has entered; the testers wait meanwhile."""
        for waited in range(max(2, round(ENTRY_S / self.dt))):
            self._advance()
            ego = self._read_ego()
            if ego is not None:
                if waited * self.dt > PROMPT_S:
                    self.simulations.set_light()  # the light went on while the ego waited
                for state in states:
                    if not self._is_person(state):
                        libsumo.vehicle.setSpeedMode(state.id, UNSAFE)
                return ego if self._guided is None else self._approach(self._guided, states)
            self._place(states)
        raise SimulationError(
            f"the ego found no room to enter edge {self.site.route.edges[0]!r} in {ENTRY_S:g} s"
        )

    def _approach(self, ego: GuidedEgo, states: Sequence[BodyState]) -> BodyState:
        """Give the ego of a script its speed."""
        ego.enter()
        self._place(states)
        self._advance()
        return ego.begin()

    def _make_room(self, states: Sequence[BodyState], starts: Sequence[Start]) -> None:
        """Remove traffic that SUMO inserted at the place of a tester vehicle.

        Departures of the first timestep are inserted before the testers.
        """
        boxes = [s.box for s, start in zip(states, starts, strict=True) if start.approach]
        mine = {EGO, *(s.id for s in states)}
        if not boxes:
            return
        for name in self._vehicles:
            length, width = libsumo.vehicle.getLength(name), libsumo.vehicle.getWidth(name)
            x, y = libsumo.vehicle.getPosition(name)
            pose = from_sumo(x, y, libsumo.vehicle.getAngle(name), length)
            if name not in mine and min(gap(Box(*pose, length, width), b) for b in boxes) < ROOM_M:
                libsumo.vehicle.remove(name)
        self._vehicles = libsumo.vehicle.getIDList()

    def _is_person(self, state: BodyState) -> bool:
        """Whether a body is a person in SUMO; only pedestrians can be."""
        return self._persons and state.body.kind.name == PEDESTRIAN.name

    def _place(self, states: Sequence[BodyState]) -> None:
        """Send SUMO the testers' positions; in every timestep, or it moves them itself."""
        move, told = libsumo.vehicle.moveToXY, self._told
        for state in states:
            name = state.body.id
            known = told.get(name)
            # A body that stands keeps its very record, and SUMO the speed that it was told.
            fresh = known is None or known[0] is not state
            if known is None or fresh:
                known = told[name] = state, front(state)
            x, y, angle = known[1]
            if self._persons and self._is_person(state):
                on_crossing = shapely.contains_xy(self.site.crossings, x, y)
                keep = KEEP_EXACT if on_crossing else KEEP_EXACT_ANY_LANE
                libsumo.person.moveToXY(name, "", x, y, angle, keep, MATCH_M)
                continue
            move(name, "", -1, x, y, angle, KEEP_EXACT, MATCH_M)
            if fresh:  # followers would else see a speed that SUMO infers, wrong by up to 6 m/s
                libsumo.vehicle.setSpeed(name, state.v)

    def _command_ego(self, command: Command) -> None:
        """Pass on the ego's command; None leaves the ego to SUMO."""
        if command is None:
            if self._guided is not None:
                self._guided.release()
            return
        if not self._commanded:  # its first command may come late, when another driver takes over
            self._commanded = True
            libsumo.vehicle.setSpeedMode(EGO, UNSAFE)
        ego, kind = self._ego, self.ego_body.kind
        if isinstance(command, Acceleration):
            if self._driven is not None:
                raise EgoError("an ego that steers itself cannot be handed to one that does not")
            v = min(kind.v_max, max(kind.v_min, ego.v + command.value * self.dt))
            libsumo.vehicle.setSpeed(EGO, v)
        elif isinstance(command, Drive):
            state = step_floats(*ego[1:], *command, kind.wheelbase, kind.v_min, kind.v_max, self.dt)
            self._driven = BodyState(self.ego_body, *state)
            self._steering = command.steering
            self._place([self._driven])

    # Reading from SUMO

    def _notes(self, demand: Demand | None, states: Sequence[BodyState]) -> DepartureNotes | None:
        """Where to note who departs; None when departures do not tell all of the demand."""
        types = self.simulations.types_told if demand is None else demand.types
        mine = frozenset((EGO, *(state.id for state in states)))
        return None if types is None else DepartureNotes(types, mine)

    @property
    def departures(self) -> Demand | None:
        """Departures so far in this episode; None if not noted, or if they would not tell all."""
        return None if self._departures is None else self._departures.demand()

    def _advance(self) -> None:
        """One timestep of SUMO; those who depart in it are noted."""
        notes = self._departures
        now = libsumo.simulation.getTime() if notes is not None else 0.0
        self.simulations.advance()
        if notes is not None:
            notes.add(libsumo, now)

    def _read_ego(self) -> BodyState | None:
        """The ego as SUMO moves it; None before it entered and after it left."""
        vehicle = libsumo.vehicle
        self._vehicles = vehicle.getIDList()
        if EGO not in self._vehicles:
            return None
        if self._guided is not None:
            return self._guided.state()
        x, y = vehicle.getPosition(EGO)
        x, y, o = from_sumo(x, y, vehicle.getAngle(EGO), self.ego_body.kind.length)
        return BodyState(self.ego_body, x, y, vehicle.getSpeed(EGO), o)

    def _implied_steering(self, ego: BodyState) -> float:
        """The steering angle that the ego's last turn implies (seed, eq. 22), within its limits.

        SUMO turns a vehicle as its lane bends, also more sharply than its axles could.
        """
        kind, before = ego.body.kind, self._ego
        if ego.o == before.o:
            return 0.0
        turn = wrap(ego.o - before.o)
        try:
            steering = steering_for_turn(ego.v, turn, kind.wheelbase, self.dt) if turn else 0.0
        except NoSuchAction:
            return math.copysign(kind.steering_max, turn) if ego.v > 0 else 0.0
        return min(kind.steering_max, max(-kind.steering_max, steering))

    def _snapshot(self, ego: BodyState, states: tuple[BodyState, ...]) -> Snapshot:
        """The state at this moment, with SUMO's background."""
        if self._driven is not None:
            self._vehicles = libsumo.vehicle.getIDList()
        persons = libsumo.person.getIDList()
        raw = self._background.read(self._vehicles, persons, (ego, *states))
        time = round(self._step * self.dt, 6)
        shown = {name: libsumo.trafficlight.getRedYellowGreenState(name) for name in self._lights}
        lights = tuple([shown[light.id][light.link] for light in self.site.lights])
        crossings = tuple([shown[walk[0]][walk[1]] if walk else "" for walk in self._walks])
        return Snapshot(
            self._step, time, ego, self._steering, states, raw, lights, crossing_lights=crossings
        )

    def _lookout(self, everything: bool, watchers: Sequence[BodyState]) -> Background:
        """The background of this episode; the network is measured at the first use."""
        if not everything and self._roaming is None:
            self._roaming = roaming(libsumo.lane)
        free = None if everything else self._roaming
        return Background(libsumo.vehicle, libsumo.person, free, self.dt, watchers)

    def _collect_events(self) -> None:
        """SUMO's own reports, kept beside ours and never merged."""
        simulation = libsumo.simulation
        for collision in simulation.getCollisions():
            a, b = sorted((collision.collider, collision.victim))
            self.collisions.add((a, b))
        self.teleports += len(simulation.getStartingTeleportIDList())
        self.emergency_stops += len(simulation.getEmergencyStoppingVehiclesIDList())


def _route_of(start: Start) -> str:
    """The id of SUMO's route for a tester: its way, by which SUMO's drivers anticipate it."""
    if start.approach is None:
        return "cavsumo_tester"
    name = " ".join(("cavsumo", *start.approach.edges))
    if name not in libsumo.route.getIDList():  # a shared simulation has it already
        libsumo.route.add(name, list(start.approach.edges))
    return name
