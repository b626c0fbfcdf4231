"""Common features of failures, in words."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from statistics import median

from cavsumo.agents.programme import WalkProgramme
from cavsumo.searchers.places import Place
from cavsumo.searchers.walks import DEPTHS_M

Failure = tuple[Place, WalkProgramme]

OBLIQUE_DEG = 15.0
THROUGH_M = 2.4  # who goes deeper into the ego's strip has crossed it
BACK_RAD, ALONG_RAD = math.radians(120.0), math.radians(45.0)
MOST = 0.8  # share of the failures that a feature describes


def in_common(failures: Sequence[Failure]) -> str:
    """The features that most failures share; empty for no failure."""
    if not failures:
        return ""
    return ", ".join(
        filter(None, (_side(failures), _speed(failures), _angle(failures), *_manner(failures)))
    )


def _side(failures: Sequence[Failure]) -> str:
    left = sum(place.left for place, _ in failures) / len(failures)
    if left >= MOST:
        return "from the left"
    return "from the right" if left <= 1.0 - MOST else "from either side"


def _speed(failures: Sequence[Failure]) -> str:
    speeds = [programme.speed for _, programme in failures]
    low, high = min(speeds), max(speeds)
    return f"{low:.1f} m/s" if high - low < 0.15 else f"{low:.1f} to {high:.1f} m/s"


def _angle(failures: Sequence[Failure]) -> str:
    degrees = math.degrees(median(programme.heading for _, programme in failures))
    if abs(degrees) < OBLIQUE_DEG:
        return "straight across"
    whither = "with the ego" if degrees > 0.0 else "towards the ego"
    return f"{abs(degrees):.0f} degrees {whither}"


def _manner(failures: Sequence[Failure]) -> list[str]:
    features: list[tuple[str, Callable[[WalkProgramme], bool]]] = [
        ("stops before the ego's way", lambda p: p.depth < 0.0),
        ("stops in the ego's way", lambda p: 0.0 <= p.depth < THROUGH_M),
        ("crosses the ego's way at once", lambda p: p.depth >= THROUGH_M),
        ("turns back", lambda p: p.depth < DEPTHS_M[1] and abs(p.heading_2) > BACK_RAD),
        ("walks along", lambda p: ALONG_RAD < abs(p.heading_2) <= BACK_RAD),
        ("waits for the ego", lambda p: p.resume is not None),
    ]
    programmes = [programme for _, programme in failures]
    return [words for words, of in features if sum(map(of, programmes)) >= MOST * len(programmes)]
