"""What a reference driver is: when it perceives a risk, and how it brakes from then on."""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.egos.reference.encounter import Encounter
from cavsumo.egos.reference.names import REFERENCE_NAMES
from cavsumo.model.bodies import Kind
from cavsumo.model.registry import Registry


class Reference:
    """Base of the reference drivers; all keep to the ego's path and do nothing but brake.

    Attributes:
        words: what it is called in a sentence.
    """

    words: str

    def perceived(self, encounters: Sequence[Encounter | None], dt: float) -> int | None:
        """The timestep of its risk perception point, None when there is nothing to perceive.

        Args:
            encounters: how the ego and the body of the violation lie at each timestep up to it;
                None where the body is not there.
            dt: length of a timestep [s].
        """
        raise NotImplementedError

    def speed_lost(self, elapsed: float, kind: Kind) -> float:
        """How much speed it has taken off since its risk perception point [m/s].

        The integral of its braking over the time ``elapsed`` [s], as if it never came to stand;
        never falling. No vehicle brakes harder than its kind can.
        """
        raise NotImplementedError

    def throttle(self, elapsed: float, dt: float, kind: Kind) -> float:
        """Its mean acceleration over the timestep that begins then [m/s2], not positive."""
        return (self.speed_lost(elapsed, kind) - self.speed_lost(elapsed + dt, kind)) / dt


REFERENCES: Registry[Reference] = Registry(REFERENCE_NAMES)


def ramped(elapsed: float, delay: float, rise: float, full: float) -> float:
    """Speed lost by braking that begins after a delay and rises linearly to its full value.

    Args:
        elapsed, delay, rise: since the perception, until the brake begins, and from there until
            it is full [s].
        full: deceleration [m/s2].
    """
    t = max(0.0, elapsed - delay)
    if t < rise:
        return 0.5 * full * t * t / rise
    return full * (t - 0.5 * rise)
