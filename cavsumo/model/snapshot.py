"""The state of the simulation at one timestep: immutable, complete, cheap to make.

Background bodies are plain tuples as read by the world, and become records only on request, because
most agents never need them.
"""

from __future__ import annotations

from typing import NamedTuple

from cavsumo.model.bodies import Body
from cavsumo.model.geometry import Box

AROUND_M = 2.5  # the background so near the ego or a tester, box to box, is in every snapshot


class BodyState(NamedTuple):
    """A body and its state (seed, appendix): position of the box's centre, speed, orientation."""

    body: Body
    x: float  # m
    y: float  # m
    v: float  # m/s
    o: float  # rad, anticlockwise from east, in (-pi, pi]

    @property
    def id(self) -> str:
        """The body's id."""
        return self.body.id

    @property
    def box(self) -> Box:
        """The body's oriented box."""
        kind = self.body.kind
        return Box(self.x, self.y, self.o, kind.length, kind.width)


RawState = tuple[Body, float, float, float, float]


class Snapshot(NamedTuple):
    """The state s of the simulation.

    Attributes:
        step: number of timesteps since the ego entered the network.
        time: simulation time since then [s].
        ego: the vehicle under test.
        ego_steering: its steering angle in the last timestep [rad]; for an ego that SUMO moves,
            the angle that its turn implies (seed, eq. 22).
        testers: the tester's bodies, in the order of the scenario.
        raw_background: all other bodies, as plain tuples in the field order of BodyState. If no
            ego, agent or assertion of the episode ``sees_background`` and the episode is not
            recorded, bodies farther than AROUND_M from the ego and all testers are left out
            (``background``).
        lights: state of each of ``Scene.lights`` for the ego, as SUMO's letter (G and g are green,
            y is yellow, r is red).
        unseen: ids of the ego and of testers that a tester agent does not see through its sensor
            (``sensors``); they have the state in which it last saw them. None without such a
            sensor.
        crossing_lights: state of each of ``Scene.crossings`` for pedestrians, empty for a crossing
            without lights. Sensors leave it out.
    """

    step: int
    time: float
    ego: BodyState
    ego_steering: float
    testers: tuple[BodyState, ...]
    raw_background: tuple[RawState, ...] = ()
    lights: tuple[str, ...] = ()
    unseen: frozenset[str] | None = None
    crossing_lights: tuple[str, ...] = ()

    @property
    def sees_ego(self) -> bool:
        """Whether the ego is seen where it is."""
        return not self.unseen or self.ego.body.id not in self.unseen

    @property
    def background(self) -> tuple[BodyState, ...]:
        """The bodies of ``raw_background``, as records (made anew at each call)."""
        return tuple(BodyState(*raw) for raw in self.raw_background)
