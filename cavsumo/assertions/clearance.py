"""The room that the ego left: robustness of assertions about contact."""

from __future__ import annotations

import math

from cavsumo.assertions.contacts import Contact
from cavsumo.model.geometry import gap
from cavsumo.model.snapshot import BodyState

LEAST = 1e-3  # m/s that a contact counts at least, so that the sign tells of it


def impact(contact: Contact) -> float:
    """The robustness of a contact: minus its closing speed [m/s]."""
    return -max(contact.closing_speed, LEAST)


class Room:
    """The smallest gap to the ego so far.

    Attributes:
        smallest: [m]; infinite before any was noted.
    """

    def __init__(self) -> None:
        self.smallest = math.inf

    def note(self, ego: BodyState, other: BodyState) -> bool:
        """Look at one more pair; whether it is the closest so far. Exact gaps are dear."""
        reach = ego.body.kind.reach + other.body.kind.reach
        if math.hypot(other.x - ego.x, other.y - ego.y) - reach >= self.smallest:
            return False
        here = gap(ego.box, other.box)
        if here >= self.smallest:
            return False
        self.smallest = here
        return True
