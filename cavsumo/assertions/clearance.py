"""The smallest gap to the ego: robustness of assertions about contact."""

from __future__ import annotations

import math

from cavsumo.assertions.contacts import Contact
from cavsumo.model.geometry import gap
from cavsumo.model.snapshot import BodyState

LEAST = 1e-3  # m/s, least closing speed of a contact, so that the sign shows it


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
        """Take in one more pair; returns whether it is the closest so far."""
        reach = ego.body.kind.reach + other.body.kind.reach
        if math.hypot(other.x - ego.x, other.y - ego.y) - reach >= self.smallest:
            return False
        here = gap(ego.box, other.box)
        if here >= self.smallest:
            return False
        self.smallest = here
        return True
