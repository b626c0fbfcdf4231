"""The careful driver of UN R157, against the counts of the public reference implementation."""

from __future__ import annotations

import pytest

from cavsumo.suites.careful_driver import (
    cut_in_preventable,
    cut_out_preventable,
    deceleration_preventable,
)
from cavsumo.suites.cells import all_cells
from cavsumo.suites.files import read_suite, suite_file

SUITE = read_suite(suite_file("un-r157"))
# Collisions of JRC-FSM (github.com/ec-jrc/JRC-FSM, EUPL) by the speeds of both cars [km/h], of the
# 1,062 or 1,080 cases of each pair; benchmarks/un_r157.py counts all of them.
COLLISIONS = {(20, 10): 136, (60, 20): 378, (90, 40): 261, (130, 100): 167}


def test_no_braking_ahead_is_too_hard_at_a_time_gap_of_two_seconds() -> None:
    """None of the published 1,121 cases is a collision."""
    cells = [cell.parameters for cell in all_cells(SUITE) if cell.test.name == "deceleration"]
    assert len(cells) == 1121
    assert all(
        deceleration_preventable(float(cell["ego_kmh"]) / 3.6, float(cell["braking_g"]) * 9.81)
        for cell in cells
    )


@pytest.mark.parametrize(("pair", "collisions"), COLLISIONS.items())
def test_cut_ins_collide_as_often_as_published(pair: tuple[int, int], collisions: int) -> None:
    """For each pair of speeds."""
    cells = [
        cell.parameters
        for cell in all_cells(SUITE)
        if cell.test.name.startswith("cut-in")
        and (cell.parameters["ego_kmh"], cell.parameters["other_kmh"]) == pair
    ]
    assert len(cells) in (1062, 1080)
    ego, other = (speed / 3.6 for speed in pair)
    found = [
        cut_in_preventable(ego, other, float(cell["gap_m"]), float(cell["lateral_mps"]))
        for cell in cells
    ]
    assert found.count(False) == collisions


def test_a_car_that_stays_in_its_lane_or_is_far_ahead_is_no_danger() -> None:
    """Whereas one that has just come into the way is."""
    assert cut_in_preventable(60 / 3.6, 10 / 3.6, 1.0, 0.0)
    assert cut_in_preventable(60 / 3.6, 10 / 3.6, 59.0, 1.0)
    assert not cut_in_preventable(60 / 3.6, 10 / 3.6, 30.0, 1.0)


def test_a_standing_car_behind_a_car_that_moves_aside_late_is_hit() -> None:
    """Nearer, it is not seen in time; at little speed the driver stops."""
    assert cut_out_preventable(30 / 3.6, 52.0, 1.1)
    assert not cut_out_preventable(130 / 3.6, 2.0, 2.9)
