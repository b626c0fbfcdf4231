"""The one boundary to SUMO; nothing else imports libsumo.

SUMO receives the positions of the bodies and moves the background traffic (and the ego, unless a
controller drives it). Its states of moved bodies are never read back: their true states are in
Python.

Each process has one simulation, as libsumo requires.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any

import libsumo
import shapely

from cavsumo.egos.base import Command, Ego
from cavsumo.errors import SimulationError, SimulationTaken
from cavsumo.model.bodies import Body
from cavsumo.model.carriageway import Start
from cavsumo.model.departures import Demand
from cavsumo.model.scenario import Scenario
from cavsumo.model.snapshot import BodyState, RawState, Snapshot
from cavsumo.network.site import Site
from cavsumo.sumo.background import Background, Roaming, roaming
from cavsumo.sumo.calls import direct
from cavsumo.sumo.connection import Simulations
from cavsumo.sumo.departure_notes import DepartureNotes
from cavsumo.sumo.ego_in_sumo import EgoInSumo
from cavsumo.sumo.guided import GuidedEgo
from cavsumo.sumo.light_letters import LightLetters
from cavsumo.sumo.moved_bodies import EGO, MovedBodies, make_room
from cavsumo.sumo.reseeding import reseed

ENTRY_S = 30.0  # longest wait of the ego for room to enter the network
PROMPT_S = 1.0  # after a longer wait of the ego the traffic light is set once more
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
        self.simulations = Simulations(libsumo, scenario, site, ego, folder)
        self._roaming: Roaming | None = None
        self.begun = 0
        self._calls: list[tuple[str, tuple[Any, ...]]] = []  # what ``again`` does again
        self._mark = object()  # stands for this world in _PLAYING without keeping it alive
        shapely.prepare(site.crossings)
        self._lights = LightLetters(site)
        self._vehicle_ids = direct(libsumo.vehicle, "getIDList")
        self._person_ids = direct(libsumo.person, "getIDList")
        self._events = tuple(
            direct(libsumo.simulation, name)
            for name in (
                "getCollisions",
                "getStartingTeleportIDList",
                "getEmergencyStoppingVehiclesIDList",
            )
        )

    def __enter__(self) -> World:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the simulation; harmless if there is none, or if another world has it."""
        if _PLAYING[0] in (None, self._mark):
            libsumo.close()
            _PLAYING[0] = None
        self._folder.cleanup()

    def reset(
        self,
        seed: int,
        states: Sequence[BodyState],
        starts: Sequence[Start],
        *,
        everything: bool = True,
        demand: Demand | None = None,
        note: bool = False,
    ) -> Snapshot:
        """Begin an episode and wait until the ego is on the road; the testers stand at their
        starts.

        Args:
            everything: show the whole background in every snapshot; else only those who may touch
                the ego or a tester, which is all that contacts need.
            demand: departures that were noted in another episode, in place of the scenario's own
                demand.
            note: note who departs (``departures``).

        Raises SimulationError with SUMO's message if SUMO refuses, or if the ego finds no room to
        enter.
        """
        self.begun += 1
        how = everything, demand, note
        self._calls = [("_begin", (seed, tuple(states), tuple(starts), *how))]
        return self._begin(seed, states, starts, *how)

    def _begin(
        self,
        seed: int,
        states: Sequence[BodyState],
        starts: Sequence[Start],
        everything: bool,
        demand: Demand | None,
        note: bool,
    ) -> Snapshot:
        """Begin an episode, see ``reset``."""
        self.collisions: set[tuple[str, str]] = set()
        self.teleports = self.emergency_stops = 0
        script = self.scenario.script
        guided = None if script is None else GuidedEgo(libsumo, script, self.ego_body)
        self._moved = MovedBodies(self.scenario, self.site, self.ego)
        self._ego = EgoInSumo(self.ego_body, self._moved, self.dt, guided)
        self._step = 0
        self._vehicles: tuple[str, ...] = ()
        self._departures: DepartureNotes | None = None
        if _PLAYING[0] is not self._mark:
            self.simulations.lose()
        _PLAYING[0] = self._mark
        with self._listening():
            self.simulations.begin(seed, demand)
            if note:
                self._departures = self._notes(demand, states)
            self._moved.insert(states, starts, None if demand is None else demand.ego)
            self._enter(states, guided)
            self._vehicles = tuple(make_room(self._vehicles, states, starts))
        self._states = tuple(states)
        self._everything = everything
        self._background = self._lookout(everything)
        return self._snapshot()

    def stand_by(self) -> None:
        """Start SUMO for the next episode before its seed is known; see ``connection``."""
        _PLAYING[0] = self._mark
        with self._listening():
            self.simulations.stand_by()

    @property
    def lanes(self) -> int:
        """How many lanes the network has in SUMO, junctions included."""
        return int(libsumo.lane.getIDCount())

    @property
    def told(self) -> int:
        """How many calls have led here from the beginning of the episode."""
        return len(self._calls)

    def again(self, told: int) -> Snapshot | None:
        """Bring a new simulation to an earlier moment of the episode, by telling it the same.

        Args:
            told: how many calls had led there (``told``).

        Returns the last snapshot of then, with the same bits if SUMO does the same again.
        """
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
            self._background = self._lookout(True)
        return self._snapshot()

    def everybody(self) -> tuple[RawState, ...]:
        """All bodies but the ego and the testers, at any distance."""
        watchers = (self._ego.state, *self._states)
        background = Background(libsumo.vehicle, libsumo.person, None, self.dt, watchers)
        return background.read(self._vehicles, self._person_ids(), watchers)

    def shift(self, states: tuple[BodyState, ...]) -> Snapshot:
        """The first snapshot once more, with the testers elsewhere; before any timestep."""
        self._calls.append(("_shift", (states,)))
        return self._shift(states)

    def _shift(self, states: tuple[BodyState, ...]) -> Snapshot:
        """The first snapshot with the testers elsewhere."""
        self._states = states
        return self._snapshot()

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
            self._moved.place(states)
            self._ego.command(command)
            self._advance()
            self._collect_events()
            ego = self._ego.follow(self._vehicles)
        except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
            raise SimulationError(f"SUMO: {error}") from error
        self._step += 1
        if ego is None:
            return None
        self._states = states
        return self._snapshot()

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
        stderr = os.dup(2)
        with TemporaryFile() as heard:
            os.dup2(heard.fileno(), 2)
            try:
                yield
            except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
                heard.seek(0)
                words = heard.read().decode(errors="replace") or str(error)
                lines = [" ".join(line.split()) for line in words.splitlines()]
                said = [line for line in lines if line and not line.startswith("Quitting")]
                raise SimulationError("SUMO: " + " ".join(dict.fromkeys(said[:4]))) from error
            finally:
                os.dup2(stderr, 2)
                os.close(stderr)

    def _enter(self, states: Sequence[BodyState], guided: GuidedEgo | None) -> None:
        """Step until the ego has entered; the testers wait meanwhile."""
        for waited in range(max(2, round(ENTRY_S / self.dt))):
            self._advance()
            ego = self._ego.found(self._vehicles)
            if ego is not None:
                if waited * self.dt > PROMPT_S:
                    self.simulations.set_light()  # the light went on while the ego waited
                self._moved.entered(states)
                self._ego.state = ego if guided is None else self._approach(guided, states)
                return
            self._moved.place(states)
        raise SimulationError(
            f"the ego found no room to enter edge {self.site.route.edges[0]!r} in {ENTRY_S:g} s"
        )

    def _approach(self, ego: GuidedEgo, states: Sequence[BodyState]) -> BodyState:
        """Give the ego of a script its speed."""
        ego.enter()
        self._moved.place(states)
        self._advance()
        return ego.begin()

    # Reading from SUMO

    def _notes(self, demand: Demand | None, states: Sequence[BodyState]) -> DepartureNotes | None:
        """Where to note who departs; None when departures do not tell all of the demand."""
        types = self.simulations.types_told if demand is None else demand.types
        mine = frozenset((EGO, *(state.id for state in states)))
        if types is None:
            return None
        return DepartureNotes(libsumo, types, mine, self.dt, demand.ego if demand else None)

    @property
    def departures(self) -> Demand | None:
        """Departures so far in this episode; None if not noted, or if they would not tell all."""
        return None if self._departures is None else self._departures.demand()

    def _advance(self) -> None:
        """One timestep of SUMO; those who depart in it are noted."""
        self.simulations.advance()
        if self._departures is not None:
            self._departures.add()
        self._vehicles = self._vehicle_ids()

    def _snapshot(self) -> Snapshot:
        """The state at this moment, with SUMO's background."""
        ego, states, step = self._ego.state, self._states, self._step
        raw = self._background.read(self._vehicles, self._person_ids(), (ego, *states))
        lights, crossings = self._lights.read()
        time, steering = round(step * self.dt, 6), self._ego.steering
        return Snapshot(step, time, ego, steering, states, raw, lights, None, crossings)

    def _lookout(self, everything: bool) -> Background:
        """The background of this episode; the network is measured at the first use."""
        if not everything and self._roaming is None:
            self._roaming = roaming(libsumo.lane)
        free = None if everything else self._roaming
        watchers = (self._ego.state, *self._states)
        return Background(libsumo.vehicle, libsumo.person, free, self.dt, watchers)

    def _collect_events(self) -> None:
        """SUMO's own reports, kept beside ours and never merged."""
        collisions, teleports, stops = self._events
        for collision in collisions():
            a, b = sorted((collision.collider, collision.victim))
            self.collisions.add((a, b))
        self.teleports += len(teleports())
        self.emergency_stops += len(stops())
