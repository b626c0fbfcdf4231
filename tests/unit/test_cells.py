"""Answers that are remembered by cells are those of the computation."""

from __future__ import annotations

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from cavsumo.model import cells
from cavsumo.model.carriageway import Roads
from cavsumo.model.cells import Cells

PLACES = st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=1, max_size=30)
# A carriageway with a hole and a notch, and a pavement beside it.
SHAPE = shapely.Polygon(
    [(-6, -3), (6, -3), (6, 3), (0.3, 2.9), (0, 0.5), (-0.3, 3), (-6, 3)],
    [[(2, -1), (3, -1), (2.5, 1)]],
)
ROADS = Roads(
    SHAPE, [shapely.LineString([(-6, 0), (6, 0)])], [shapely.LineString([(-9, 5), (9, 5)])]
)


@given(PLACES)
def test_a_carriageway_contains_what_its_shape_contains(places: list[tuple[float, float]]) -> None:
    """Anywhere, in any order, along the boundary too; and nothing changes within the room."""
    for x, y in places:
        holds, room = ROADS.on_carriageway.at(x, y)
        assert holds == ROADS.contains(x, y) == bool(shapely.contains_xy(SHAPE, x, y))
        assert room <= shapely.distance(SHAPE.boundary, shapely.Point(x, y))


@pytest.mark.parametrize("on_foot", [False, True])
@given(places=PLACES)
def test_a_reach_is_measured_from_carriageway_or_pavement(
    on_foot: bool, places: list[tuple[float, float]]
) -> None:
    """A pavement counts for those on foot alone."""
    for x, y in places:
        far = ROADS.walking_distance(x, y) if on_foot else ROADS.driving_distance(x, y)
        holds, room = ROADS.within(1.0, on_foot=on_foot).at(x, y)
        assert holds == (far <= 1.0)
        assert room <= abs(far - 1.0)


def test_an_answer_is_remembered_as_far_as_it_reaches(monkeypatch: pytest.MonkeyPatch) -> None:
    """The half-plane x > 0, one cell after the other; what is remembered is bounded."""
    asked: list[float] = []

    def holds(x: float, y: float) -> bool:
        asked.append(x)
        return x > 0.0

    half = Cells(holds, lambda x, y: abs(x))
    assert half.at(3.1, 0.1) == (True, 3.1)
    assert half.at(3.4, 0.1) == (True, pytest.approx(3.1 - 0.3, abs=1e-5))
    assert half.at(4.1, 0.1) == (True, 4.1)
    assert [half.at(x, 0.0) for x in (0.1, 0.45, -0.1)] == [(True, 0.1), (True, 0.0), (False, 0.1)]
    assert asked == [3.1, 4.1, 0.1, 0.45, -0.1]
    monkeypatch.setattr(cells, "MOST", 2)
    for i in range(9):
        half.at(5.0 + i, 0.0)
    assert len(half._known) <= 2
