"""The side of the road on which traffic keeps, out of the tags and the place of an extract."""

from __future__ import annotations

import pytest

from cavsumo.network.osm.handedness import side, warning


@pytest.mark.parametrize(
    ("lat", "lon", "left"),
    [
        (51.46, -2.55, True),  # Bristol
        (53.35, -6.26, True),  # Dublin
        (50.95, 1.85, False),  # Calais
        (35.68, 139.77, True),  # Tokyo
        (35.18, 129.08, False),  # Busan
        (22.30, 114.17, True),  # Hong Kong
        (22.54, 114.06, False),  # Shenzhen
        (28.61, 77.21, True),  # Delhi
        (13.75, 100.50, True),  # Bangkok
        (11.56, 104.92, False),  # Phnom Penh
        (14.60, 120.98, False),  # Manila
        (-6.21, 106.85, True),  # Jakarta
        (-33.87, 151.21, True),  # Sydney
        (-41.29, 174.78, True),  # Wellington
        (-1.29, 36.82, True),  # Nairobi
        (-1.95, 30.06, False),  # Kigali
        (-26.20, 28.05, True),  # Johannesburg
        (-8.84, 13.23, False),  # Luanda
        (18.01, -76.79, True),  # Kingston
        (25.76, -80.19, False),  # Miami
        (23.11, -82.37, False),  # Havana
        (52.52, 13.40, False),  # Berlin
        (60.17, 24.94, False),  # Helsinki
        (47.62, -122.34, False),  # Seattle
        (31.20, 121.40, False),  # Shanghai
    ],
)
def test_large_cities_are_on_the_right_side(lat: float, lon: float, left: bool) -> None:
    """The rough outlines are right where many people live."""
    found = side({}, (lon, lat, lon, lat))
    assert found.left == left
    assert warning(found, left) is None
    assert warning(found, not left) is not None


@pytest.mark.parametrize(
    ("lat", "lon", "left"),
    [
        (51.51, -0.12, True),  # London
        (53.35, -6.26, True),  # Dublin
        (35.68, 139.77, True),  # Tokyo
        (22.30, 114.17, True),  # Hong Kong
        (28.61, 77.21, True),  # Delhi
        (13.08, 80.27, True),  # Chennai
        (13.75, 100.50, True),  # Bangkok
        (1.35, 103.82, True),  # Singapore
        (3.14, 101.69, True),  # Kuala Lumpur
        (-6.21, 106.85, True),  # Jakarta
        (-33.87, 151.21, True),  # Sydney
        (-1.29, 36.82, True),  # Nairobi
        (-4.05, 39.67, True),  # Mombasa
        (-6.80, 39.28, True),  # Dar es Salaam
        (-26.20, 28.05, True),  # Johannesburg
        (-33.96, 25.60, True),  # Port Elizabeth
        (-33.92, 18.42, True),  # Cape Town
        (18.01, -76.79, True),  # Kingston
        (-8.52, 179.19, True),  # Funafuti
        (48.85, 2.35, False),  # Paris
        (52.52, 13.40, False),  # Berlin
        (37.57, 126.98, False),  # Seoul
        (39.90, 116.40, False),  # Beijing
        (21.03, 105.85, False),  # Hanoi
        (14.60, 120.98, False),  # Manila
        (22.53, -78.40, False),  # Cayo Coco
        (9.03, 38.74, False),  # Addis Ababa
        (-8.84, 13.23, False),  # Luanda
        (-1.95, 30.06, False),  # Kigali
        (40.71, -74.01, False),  # New York
        (-23.55, -46.63, False),  # Sao Paulo
    ],
)
def test_the_side_of_large_cities_is_certain(lat: float, lon: float, left: bool) -> None:
    """An extract of two kilometres is taken for what it is, without options."""
    found = side({}, (lon - 0.01, lat - 0.01, lon + 0.01, lat + 0.01))
    assert (found.left, found.certain) == (left, True)


@pytest.mark.parametrize(
    ("lat", "lon"),
    [
        (22.54, 114.06),  # Shenzhen
        (50.95, 1.85),  # Calais
        (17.97, 102.63),  # Vientiane
        (17.88, 102.74),  # Nong Khai, across the river
        (27.47, 89.64),  # Thimphu
        (3.38, -59.80),  # Lethem, beside Brazil
    ],
)
def test_near_a_border_the_side_is_not_certain(lat: float, lon: float) -> None:
    """The outlines are rough there."""
    assert not side({}, (lon - 0.01, lat - 0.01, lon + 0.01, lat + 0.01)).certain


def test_a_large_extract_must_lie_inside_as_a_whole() -> None:
    """Its middle may be far from the border, its end beyond."""
    assert side({}, (76.9, 28.3, 77.5, 28.9)).certain
    assert not side({}, (70.0, 21.0, 84.0, 35.0)).certain
    assert not side({}, (-5.0, 44.0, 7.0, 52.0)).certain


def test_tags_and_place_are_certain_when_they_agree() -> None:
    """One that contradicts the others, or the place, leaves a doubt."""
    berlin, calais = (13.4, 52.5, 13.4, 52.5), (1.85, 50.95, 1.85, 50.95)
    assert side({("addr:country", "DE"): 1, ("traffic_sign", "FR"): 1}, berlin).certain
    assert not side({("addr:country", "GB"): 3}, berlin).certain
    assert not side({("addr:country", "GB"): 1, ("addr:country", "FR"): 9}, calais).certain
    assert side({("addr:country", "FR"): 9}, calais) == (
        False,
        "by its tags the extract lies in FR",
        True,
    )


def test_tags_tell_the_side_before_coordinates_do() -> None:
    """driving_side before countries, countries before the outlines."""
    berlin, bristol = (13.4, 52.5, 13.4, 52.5), (-2.5, 51.4, -2.5, 51.4)
    said = warning(side({("addr:country", "GB"): 3}, berlin), False)
    assert "lies in GB" in (said or "")
    german = side({("traffic_sign", "DE"): 2, ("addr:country", "GB"): 1}, bristol)
    assert warning(german, False) is None
    tagged = {("driving_side", "left"): 1, ("addr:country", "DE"): 9}
    assert "driving_side=left" in (warning(side(tagged, berlin), False) or "")
    hong_kong = (114.1, 22.3, 114.2, 22.4)  # tagged as China now and then
    assert warning(side({("addr:country", "CN"): 3}, hong_kong), True) is None
    assert "without --left-hand" in (warning(side({}, berlin), True) or "")
