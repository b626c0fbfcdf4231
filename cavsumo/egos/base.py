"""What an ego is: driven by SUMO, or a controller that answers each snapshot with a command."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, NamedTuple

from cavsumo.egos.names import EGO_NAMES
from cavsumo.model.bodies import CAR, Kind
from cavsumo.model.carriageway import Light
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.registry import Registry
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

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
    """What an ego may know before its first episode: all that no episode changes.

    Attributes:
        net: the network file.
        edges: ids of the edges of its route.
        path: centre line of its route, from where its centre starts to where its front arrives.
        lights: the traffic lights on it.
        dt: length of a timestep [s].
        horizon: how long an episode may last [s].
    """

    net: Path
    edges: tuple[str, ...]
    path: Polyline
    lights: tuple[Light, ...]
    dt: float
    horizon: float


class Ego:
    """Base of the egos; on its own it leaves the driving to SUMO.

    Attributes:
        kind: its box and limits.
        depart_speed: speed on entering the network [m/s]; None for as fast as SUMO finds safe.
        sees_background: whether it looks at the background traffic in the snapshots. See
            ``Agent.sees_background``.
    """

    PARAMETERS: ClassVar[Mapping[str, str]] = {}

    kind: Kind = EGO_KIND
    depart_speed: float | None = None
    sees_background: bool = True

    def vtype(self) -> dict[str, str]:
        """The attributes of its SUMO vehicle type."""
        return {"length": f"{self.kind.length}", "width": f"{self.kind.width}"}

    def prepare(self, mission: Mission) -> None:
        """Get ready to drive, in the process that simulates; what it raises refuses the batch."""

    def close(self) -> None:
        """End whatever ``prepare`` started."""

    def reset(self, scene: Scene) -> None:
        """Begin an episode."""

    def act(self, snapshot: Snapshot) -> Command:
        """The command for the next timestep; None lets SUMO drive, in every timestep."""
        return None

    def conclude(self) -> None:
        """The episode is over: EgoError if its answers turn out to be those to other questions."""

    def take_log(self) -> str:
        """What it has printed since the last call, to be kept beside the episode's row."""
        return ""


EGOS: Registry[Ego] = Registry(EGO_NAMES)
