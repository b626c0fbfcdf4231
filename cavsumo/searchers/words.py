"""Common features of failures, in words."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from statistics import median
from typing import Any, NamedTuple

from cavsumo.agents.cues import BRAKES, SPEEDS_UP
from cavsumo.agents.programme import WalkProgramme
from cavsumo.agents.searched import Programme
from cavsumo.searchers.places import FROM_LEFT, FROM_RIGHT, Place
from cavsumo.searchers.walks import DEPTHS_M

OBLIQUE_DEG = 15.0
THROUGH_M = 2.4  # who goes deeper into the ego's strip has crossed it
BACK_RAD, ALONG_RAD = math.radians(120.0), math.radians(45.0)
MOST = 0.8  # share of the failures that a feature describes


class Failure(NamedTuple):
    """A body that the ego failed.

    Attributes:
        place, programme: where it started and what it did; None if it stood by.
        others: how many other testers took part.
    """

    place: Place
    programme: Programme | None
    others: int = 0


Feature = tuple[str, Callable[[Any], bool]]  # words, and whether a programme has the feature
CUES: tuple[Feature, ...] = (
    ("begins as the ego brakes", lambda p: p.cue == BRAKES),
    ("begins as the ego speeds up again", lambda p: p.cue == SPEEDS_UP),
)
WALKS: tuple[Feature, ...] = (
    *CUES,
    ("stops before the ego's way", lambda p: p.depth < 0.0),
    ("stops in the ego's way", lambda p: 0.0 <= p.depth < THROUGH_M),
    ("crosses the ego's way at once", lambda p: p.depth >= THROUGH_M),
    ("turns back", lambda p: p.depth < DEPTHS_M[1] and abs(p.heading_2) > BACK_RAD),
    ("walks along", lambda p: ALONG_RAD < abs(p.heading_2) <= BACK_RAD),
    ("waits for the ego", lambda p: p.resume is not None),
)
RUNS: tuple[Feature, ...] = (
    ("runs the line", lambda p: p.depth is None),
    ("creeps over the line and stops before the ego's way", lambda p: _below(p.depth, 0.0)),
    ("stops in the ego's way", lambda p: p.depth is not None and p.depth >= 0.0),
)
# By the type of approach.
DRIVES: dict[str, tuple[Feature, ...]] = {
    "crossing": RUNS,
    "merging": RUNS,
    "following": (
        ("brakes", lambda p: p.depth is None),
        ("brakes to a stand", lambda p: p.depth is not None),
    ),
    "adjacent": (("cuts in", lambda p: True), ("stops", lambda p: p.depth is not None)),
}
WAITS: Feature = ("waits for the ego", lambda p: p.depth is not None and p.resume is not None)


def in_common(failures: Sequence[Failure], kind: str) -> str:
    """The features that most failures of testers of a kind share; empty for no failure."""
    acting = [(f.place, f.programme) for f in failures if f.programme is not None]
    if not failures:
        return ""
    words = [f"{kind} {_whence([f.place for f in failures])}"]
    if acting:
        words += [_speed([p for _, p in acting]), *_manner(acting)]
    if sum(f.others > 0 for f in failures) >= MOST * len(failures):
        words.append("with another one")
    return ", ".join(words)


def _whence(places: Sequence[Place]) -> str:
    """From where most come."""
    counts = Counter(place.whence for place in places)
    whence, count = counts.most_common(1)[0]
    if count >= MOST * len(places):
        return whence
    return "from either side" if counts.keys() == {FROM_LEFT, FROM_RIGHT} else "from several ways"


def _speed(programmes: Sequence[Programme]) -> str:
    speeds = [programme.speed for programme in programmes]
    low, high = min(speeds), max(speeds)
    return f"{low:.1f} m/s" if high - low < 0.15 else f"{low:.1f} to {high:.1f} m/s"


def _manner(acting: Sequence[tuple[Place, Programme]]) -> list[str]:
    """The features of their movements."""
    walks = [p for _, p in acting if isinstance(p, WalkProgramme)]
    if walks:
        return [_angle(walks), *_shared(WALKS, walks)]
    types = Counter(p.start.approach.type for p, _ in acting if p.start.approach is not None)
    type_, count = types.most_common(1)[0]
    kinds = {id(DRIVES[one]) for one in types}
    features = DRIVES[type_] if count >= MOST * len(acting) or len(kinds) == 1 else ()
    return _shared((*CUES, *features, WAITS), [p for _, p in acting])


def _shared(features: Sequence[Feature], programmes: Sequence[Programme]) -> list[str]:
    """The words of those features that most programmes have."""
    least = MOST * len(programmes)
    return [words for words, has in features if sum(map(has, programmes)) >= least]


def _angle(walks: Sequence[WalkProgramme]) -> str:
    degrees = math.degrees(median(walk.heading for walk in walks))
    if abs(degrees) < OBLIQUE_DEG:
        return "straight across"
    whither = "with the ego" if degrees > 0.0 else "towards the ego"
    return f"{abs(degrees):.0f} degrees {whither}"


def _below(depth: float | None, limit: float) -> bool:
    return depth is not None and depth < limit
