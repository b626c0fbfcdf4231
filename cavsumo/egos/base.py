"""The protocol of egos: driven by SUMO, or by a controller that answers each snapshot."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, NamedTuple

from cavsumo.egos.names import EGO_NAMES
from cavsumo.model.bodies import CAR, Kind
from cavsumo.model.carriageway import Light, MarkedCrossing
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.registry import Registry
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot
from cavsumo.model.surroundings import Surroundings

# CAV-Gym's car on roads that allow more than its 9 m/s.
EGO_KIND = dataclasses.replace(CAR, v_max=55.0)


class Acceleration(NamedTuple):
    """Keep to the route and change speed; SUMO steers."""

    value: float  # m/s2


class Drive(NamedTuple):
    """Drive freely by the kinematics of the seed, like a tester's body."""

    throttle: float  # m/s2
    steering: float  # rad, positive to the left


Command = Acceleration | Drive | None


@dataclasses.dataclass(frozen=True)
class Mission:
    """The data that an ego has before its first episode, constant over all episodes.

    Attributes:
        net: the network file.
        edges: ids of the edges of its route.
        path: centre line of its route, from where its centre starts to where its front arrives.
        lights: the traffic lights on it.
        dt: length of a timestep [s].
        horizon: longest duration of an episode [s].
        crossings: the marked crossings on the route, in order.
        surroundings: the lanes and pavements near it.
        approach_speed: at which it enters and is to drive [m/s]; None leaves it to the ego.
    """

    net: Path
    edges: tuple[str, ...]
    path: Polyline
    lights: tuple[Light, ...]
    dt: float
    horizon: float
    crossings: tuple[MarkedCrossing, ...] = ()
    surroundings: Surroundings = dataclasses.field(default_factory=Surroundings)
    approach_speed: float | None = None


class Ego:
    """Base of the egos; SUMO drives this one.

    Attributes:
        kind: its box and limits.
        depart_speed: speed on entering the network [m/s]; None for the largest that SUMO considers
            safe.
        sees_background: whether it uses the background traffic in the snapshots. See
            ``Agent.sees_background``.
        decides_every_s: time between two decisions, if that is longer than a timestep [s].
        outside: whether it drives from another process, which a branch of an episode would share.
    """

    PARAMETERS: ClassVar[Mapping[str, str]] = {}

    kind: Kind = EGO_KIND
    depart_speed: float | None = None
    sees_background: bool = True
    decides_every_s: float = 0.0
    outside: ClassVar[bool] = False

    def vtype(self) -> dict[str, str]:
        """The attributes of its SUMO vehicle type."""
        return {"length": f"{self.kind.length}", "width": f"{self.kind.width}"}

    def prepare(self, mission: Mission) -> None:
        """Get ready to drive, in the simulating process; an error here refuses the batch."""

    def close(self) -> None:
        """End the processes and connections of ``prepare``."""

    def reset(self, scene: Scene) -> None:
        """Begin an episode."""

    def act(self, snapshot: Snapshot) -> Command:
        """The command for the next timestep; None lets SUMO drive, in every timestep."""
        return None

    def conclude(self) -> None:
        """End the episode; EgoError if its answers belong to other observations."""

    def take_log(self) -> str:
        """Its output since the last call, to be kept beside the episode's row."""
        return ""


EGOS: Registry[Ego] = Registry(EGO_NAMES)
