"""Bounds of a space of tests: the ranges in which a user wants its numbers, sides and places.

``speed=0.3:0.8 side=left meets=20:60`` keeps walkers slow, who come from the left and cross the
ego's path 20 to 60 m from its beginning. A point of the bounded space is one of the unit cube too:
each bounded number is a share of its own range, so points drawn uniformly are uniform in it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cavsumo.agents.searched import Programme
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.bodies import Kind
from cavsumo.searchers.drives import AHEAD, BEHIND, BESIDE, ONCOMING
from cavsumo.searchers.places import FROM_LEFT, FROM_RIGHT, Place
from cavsumo.searchers.space import Movements, Space

SIDE, MEETS = "side", "meets"  # keys that choose places, not numbers
SIDES = {  # by the words of ``Place.whence``
    "left": FROM_LEFT,
    "right": FROM_RIGHT,
    "ahead": AHEAD,
    "beside": BESIDE,
    "oncoming": ONCOMING,
    "behind": BEHIND,
}
WHOLE = (0.0, 1.0)
NAME = "search.within"

Range = tuple[float, float]


@dataclass(frozen=True)
class BoundedMovements:
    """Movements whose numbers, by their shares, stay in ranges (``space.Movements``).

    Attributes:
        base: the movements, with the places that are left.
        shares: for a name the range of its shares.
    """

    base: Movements
    shares: tuple[tuple[str, Range], ...]

    @property
    def name(self) -> str:
        return self.base.name

    @property
    def kind(self) -> Kind:
        return self.base.kind

    @property
    def places(self) -> tuple[Place, ...]:
        return self.base.places

    @property
    def meanings(self) -> Mapping[str, str]:
        return self.base.meanings

    @property
    def manner(self) -> tuple[str, ...]:
        return self.base.manner

    @property
    def scales(self) -> Mapping[str, Range]:
        return self.base.scales

    def suited(self, shares: Mapping[str, float]) -> tuple[Place, ...]:
        return self.base.suited(self._inside(shares))

    def realised(self, place: Place, shares: Mapping[str, float]) -> tuple[Place, Programme]:
        return self.base.realised(place, self._inside(shares))

    def fits(self, place: Place, others: Sequence[Place]) -> bool:
        return self.base.fits(place, others)

    def part(self, name: str, wanted: Range) -> Range:
        """The part of a range of shares of the whole space that is inside, as shares of it.

        Where nothing of it is inside, the end that is nearest to it.
        """
        low, high = dict(self.shares).get(name, WHOLE)
        within = (
            min(1.0, max(0.0, (x - low) / (high - low))) if high > low else 0.0 for x in wanted
        )
        first, last = within
        return first, last

    def _inside(self, shares: Mapping[str, float]) -> dict[str, float]:
        """The shares of the whole space."""
        bounds = dict(self.shares)
        return {
            name: low + (high - low) * share
            for name, share in shares.items()
            for low, high in [bounds.get(name, WHOLE)]
        }


def part(movements: Movements, name: str, wanted: Range) -> Range:
    """The part of a range of shares that movements permit; see ``BoundedMovements.part``."""
    return movements.part(name, wanted) if isinstance(movements, BoundedMovements) else wanted


def within_of(params: Mapping[str, Any]) -> str:
    """The bounds that a search's parameters ask for; empty for none."""
    return str(params.get("within", ""))


def bounds_numbers(space: Space) -> bool:
    """Whether a space bounds more than the places."""
    return isinstance(space.movements, BoundedMovements) and bool(space.movements.shares)


def bounded(space: Space, words: str) -> Space:
    """The part of a space inside bounds ``KEY=LOW:HIGH ...``, separated by spaces or commas.

    Raises InputError for a key that the movements do not have, for a range that is none or not
    theirs, and where no place is left.
    """
    movements, shares, seen = space.movements, [], set()
    for word in words.replace(",", " ").split():
        key, _, value = word.partition("=")
        if key in seen:
            raise InputError(f"{NAME}: {key} is bounded twice")
        seen.add(key)
        if key in (SIDE, MEETS):
            movements = _with_places(movements, key, value)
            continue
        if key not in movements.scales:
            raise UnknownName("number", key, (SIDE, MEETS, *movements.scales), NAME)
        shares.append((key, _shares(key, value, movements.scales[key])))
    if not seen:
        return space
    return dataclasses.replace(space, movements=BoundedMovements(movements, tuple(shares)))


def _with_places(movements: Movements, key: str, value: str) -> Movements:
    """Movements with the places that one bound leaves."""
    if key == SIDE:
        if value not in SIDES:
            raise UnknownName("side", value, SIDES, NAME)
        left = tuple(p for p in movements.places if p.whence == SIDES[value])
    else:
        low, high = _range(key, value)
        left = tuple(p for p in movements.places if low <= p.along <= high)
    if not left:
        there = sorted({word for p in movements.places for word in _told(key, p)})
        raise InputError(f"{NAME}: {key}={value} leaves no start; there is {', '.join(there)}")
    return dataclasses.replace(movements, places=left)  # type: ignore[type-var]


def _told(key: str, place: Place) -> list[str]:
    """The side or the stretch of a place, in words."""
    if key == SIDE:
        return [side for side, whence in SIDES.items() if whence == place.whence]
    return [
        f"{10 * math.floor(place.along / 10):d} to {10 * math.floor(place.along / 10) + 10:d} m"
    ]


def _shares(key: str, value: str, scale: Range) -> Range:
    """The range of shares of one number."""
    low, high = _range(key, value)
    first, last = scale
    if not first - 1e-9 <= low <= high <= last + 1e-9:
        raise InputError(f"{NAME}: {key}={value} is not within {first:g}:{last:g}")
    return ((low - first) / (last - first), (high - first) / (last - first))


def _range(key: str, value: str) -> Range:
    """A range LOW:HIGH."""
    words = value.split(":")
    try:
        low, high = (float(word) for word in words)
    except ValueError:
        raise InputError(
            f"{NAME}: {key}={value}: expected LOW:HIGH, two numbers, such as {key}=1:2"
        ) from None
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"{NAME}: {key}={value}: expected finite numbers")
    if low > high:
        raise InputError(
            f"{NAME}: {key}={value} is the wrong way round; write {key}={high:g}:{low:g}"
        )
    return low, high
