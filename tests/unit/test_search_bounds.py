"""Bounds of a space of tests: what is drawn stays inside, what makes no sense is refused."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from cavsumo.agents.programme import WalkProgramme
from cavsumo.errors import InputError
from cavsumo.model.bodies import CAR, PEDESTRIAN
from cavsumo.model.scenario import BatchPlan
from cavsumo.network.site import Site
from cavsumo.searchers.bounds import bounded, part
from cavsumo.searchers.methods import SEARCHERS, check_method, searcher_of
from cavsumo.searchers.portfolio import Portfolio
from cavsumo.searchers.protocol import PlayedPoint
from cavsumo.searchers.space import Space, space_of

WORDS = "speed=0.3:0.8, heading=-60:-20 side=left meets=20:60"


@pytest.fixture
def space(staged: Callable[..., tuple[BatchPlan, Site]]) -> Space:
    """Two pedestrians on the straight road."""
    return space_of(staged("pedestrians")[1], PEDESTRIAN, ((0,), (1,)))


@pytest.mark.parametrize("method", [m for m in SEARCHERS if m not in ("tree", "explore")])
def test_every_searcher_stays_inside(space: Space, method: str) -> None:
    """All bodies, of all points; nothing else is narrowed."""
    if method == "diversity":
        pytest.importorskip("ribs")
    inside = bounded(space, WORDS)
    searcher = searcher_of(method, inside, np.random.default_rng(1))
    depths = set()
    for _ in range(6):
        points = searcher.ask()
        for place, programme in (body for point in points for body in inside.played(point)):
            assert place.left
            assert 20.0 <= place.along <= 60.0
            if programme is not None:
                assert isinstance(programme, WalkProgramme)
                assert 0.3 <= programme.speed <= 0.8 + 1e-9
                assert -60.0 - 1e-9 <= math.degrees(programme.heading) <= -20.0 + 1e-9
                depths.add(round(programme.depth))
        searcher.tell(points, [PlayedPoint(-2.0, False, ()) for _ in points])
    assert len(depths) > 3


def test_points_of_the_bounded_space_are_even_in_it(space: Space) -> None:
    """The middle of a point's number is the middle of its bounds."""
    inside = bounded(space, "speed=0.4:0.6")
    (_, programme), *_ = inside.played(np.full(inside.dimension, 0.5))
    assert programme is not None
    assert programme.speed == pytest.approx(0.5)
    assert bounded(space, "") is space


def test_one_value_is_a_range(space: Space) -> None:
    """Its ends are the same."""
    inside = bounded(space, "speed=0.4:0.4")
    points = np.random.default_rng(2).random((20, inside.dimension))
    speeds = [one.speed for p in points for _, one in inside.played(p) if one is not None]
    assert speeds == pytest.approx([0.4] * len(speeds))


def test_manoeuvres_keep_their_ranges(space: Space) -> None:
    """The part of them that is inside; the nearest end where none is."""
    inside = bounded(space, "speed=0.575:0.85")  # shares 0.25 to 0.5
    assert part(inside.movements, "speed", (0.0, 0.35)) == pytest.approx((0.0, 0.4))
    assert part(inside.movements, "speed", (0.5, 1.0)) == pytest.approx((1.0, 1.0))
    assert part(inside.movements, "zone", (0.15, 0.5)) == (0.15, 0.5)
    assert part(space.movements, "speed", (0.0, 0.35)) == (0.0, 0.35)


def test_decisions_know_places_alone(space: Space) -> None:
    """A method that decides anew every second is refused, and is left out of the portfolio."""
    numbers, places = bounded(space, WORDS), bounded(space, "side=left")
    assert "tree" not in Portfolio(numbers, np.random.default_rng(1)).members
    assert "tree" in Portfolio(places, np.random.default_rng(1)).members
    check_method("tree", places)
    with pytest.raises(InputError, match=r"of search.within it can keep side and meets alone"):
        check_method("tree", numbers)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("spede=0.3:0.8", "did you mean 'speed'"),
        ("speed=0.8:0.3", r"is the wrong way round; write speed=0.3:0.8"),
        ("speed=0.3:5", "is not within 0.3:1.4"),
        ("speed=0.3", "expected LOW:HIGH"),
        ("speed=slow:fast", "expected LOW:HIGH"),
        ("speed=nan:1", "expected finite numbers"),
        ("speed=0.3:0.4 speed=0.5:0.6", "speed is bounded twice"),
        ("side=lef", "did you mean 'left'"),
        ("side=ahead", "leaves no start; there is left, right"),
        ("meets=900:1000", "leaves no start; there is"),
        ("resume=0:1", "unknown number 'resume'"),
    ],
    ids=lambda text: text if "=" in text else None,
)
def test_bounds_that_make_no_sense_are_refused(space: Space, words: str, said: str) -> None:
    """In one sentence that names the key."""
    with pytest.raises(InputError, match=said):
        bounded(space, words)


def test_vehicles(staged: Callable[..., tuple[BatchPlan, Site]]) -> None:
    """Sides and speeds of approaches."""
    space = space_of(staged("junction", kind="car")[1], CAR, ((0,),))
    sides = {place.whence for place in space.movements.places}
    side = "left" if "from the left" in sides else "right"
    inside = bounded(space, f"side={side} speed=2:4")
    for point in np.random.default_rng(3).random((20, inside.dimension)):
        (place, programme), *_ = inside.played(point)
        assert place.whence == f"from the {side}"
        assert programme is not None
        assert 2.0 <= programme.speed <= 4.0
