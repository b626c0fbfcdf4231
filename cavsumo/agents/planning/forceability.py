"""Whether a body can still force its goal from its state, against a class of egos.

Far from the strip the body walks on, which loses nothing, since it may also stand later. The table
of the solved game begins a few metres before the strip.

Forcing is monotone, and one ego is the worst for all bodies: the reaction zone of an ego that never
stops must reach a body that stands in its way, so its only defence is to arrive too fast. Several
bodies therefore force together only what one of them forces alone, and no joint game is solved.
"""

from __future__ import annotations

import math

from cavsumo.agents.planning.coordinates import Relative
from cavsumo.agents.planning.solved import Solved
from cavsumo.model.bodies import Kind

LEAST_MPS = 0.1  # an ego slower than that is taken as standing: it has no zones
ROOM_M = 0.2  # margin at which rounding up could lead off the table


class Forceability:
    """Values of relative states of one body; subclasses define the actions of the ego.

    Args:
        kind: of the body.
        table: the solved game.
        max_decel: of the braking zone [m/s2].
        dt: length of a timestep [s].
    """

    def __init__(self, kind: Kind, table: Solved, max_decel: float, dt: float) -> None:
        self.kind, self.table, self.max_decel, self.dt = kind, table, max_decel, dt
        self.edge = table.rules.left_max - ROOM_M

    def sure(self, here: Relative) -> bool:
        """Whether the goal can be forced for certain: at the worst corner of the cell."""
        at = self._on_table(here, self.dt) if here.v > LEAST_MPS else None
        return at is not None and self.table.surely(*at)

    def possible(self, here: Relative) -> bool:
        """Whether the goal can perhaps be forced: at the best corner."""
        at = self._on_table(here, 0.0) if here.v > LEAST_MPS else None
        return at is not None and self.table.possibly(*at)

    def worth(self, here: Relative) -> float:
        """The interpolated value: about 0 where the goal is sure, -1 where it is lost."""
        at = self._on_table(here, 0.5 * self.dt) if here.v > LEAST_MPS else None
        return -1.0 if at is None else self.table.worth(*at)

    def _on_table(self, here: Relative, late: float) -> tuple[float, float, float, float] | None:
        """The state once the body has come near enough, ``late`` seconds after that.

        A body is seen to touch at the end of a timestep, so it may count one timestep late.
        """
        raise NotImplementedError

    def walked(self, here: Relative, until: float) -> tuple[float, float, float]:
        """Time until a distance is left to walk, and the distance and the speed at that time.

        The body's position follows its speed one timestep late (explicit Euler); measured half a
        timestep of its speed farther it moves exactly as on the lattice.
        """
        kind, v = self.kind, here.walk
        lag = (kind.v_max - v) * self.dt / 2
        if here.left <= until:
            return 0.0, max(here.left + lag, 0.0), v
        way, a, top = here.left + lag - until, kind.throttle_max, kind.v_max
        gaining = (top * top - v * v) / (2.0 * a)
        if gaining >= way:
            w = math.sqrt(v * v + 2.0 * a * way)
            return (w - v) / a, until, w
        return (top - v) / a + (way - gaining) / top, until, top


class ConstantSpeed(Forceability):
    """Against an ego that keeps its speed."""

    def _on_table(self, here: Relative, late: float) -> tuple[float, float, float, float] | None:
        if here.gap <= 0.0:
            return None
        t, left, walk = self.walked(here, self.edge)
        arrives = here.gap / here.v - 0.5 * here.v / self.max_decel
        return arrives - t - late, 1.0, left, walk


class Free(Forceability):
    """Against an ego that brakes and accelerates freely, but never stops."""

    def _on_table(self, here: Relative, late: float) -> tuple[float, float, float, float] | None:
        t, left, walk = self.walked(here, self.edge)
        gap, v = self._at_worst(here, t + late)
        return (gap, v, left, walk) if gap > 0.0 else None

    def possible(self, here: Relative) -> bool:
        # Far away the ego may arrive slower than at worst: then only a goal that is lost now is
        # lost.
        if here.left <= self.edge or here.v <= LEAST_MPS:
            return super().possible(here)
        return here.gap > 0.5 * here.v * here.v / self.max_decel

    def _at_worst(self, here: Relative, t: float) -> tuple[float, float]:
        """Gap and speed of an ego that accelerates all the time."""
        rules = self.table.rules
        a, top = rules.accelerate * rules.speed_step / rules.interval, self.top
        gaining = min(t, max(0.0, (top - here.v) / a))
        v = here.v + a * gaining
        return here.gap - (here.v + v) / 2 * gaining - v * (t - gaining), v

    @property
    def top(self) -> float:
        """The fastest speed on the lattice [m/s]."""
        return self.table.rules.speeds * self.table.rules.speed_step


class Unaware(Free):
    """Against an ego that keeps its speed until the body is on the carriageway, then acts freely.

    Args:
        kerb: distance from touching the carriageway to the strip [m].
    """

    def __init__(self, kind: Kind, table: Solved, max_decel: float, dt: float, kerb: float) -> None:
        super().__init__(kind, table, max_decel, dt)
        self.kerb = kerb

    def _on_table(self, here: Relative, late: float) -> tuple[float, float, float, float] | None:
        return super()._on_table(self._at_kerb(here), late)

    def possible(self, here: Relative) -> bool:
        return super().possible(self._at_kerb(here))

    def _at_kerb(self, here: Relative) -> Relative:
        """The state once the body has walked to the carriageway."""
        if here.left <= self.kerb:
            return here
        t, left, walk = self.walked(here, self.kerb)
        lag = (self.kind.v_max - walk) * self.dt / 2  # ``walked`` adds it again
        return here._replace(gap=here.gap - here.v * t, left=left - lag, walk=walk)
