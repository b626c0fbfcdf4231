"""The crosswalk of adaptive stress testing, against the public toolbox and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from cavsumo.model.crosswalk import (
    STARTS,
    CrosswalkStart,
    chosen_acceleration,
    failures,
    filtered,
    normals,
    walked,
)
from cavsumo.model.scenario.script import Programme
from cavsumo.model.scenario.track import ScriptedTrack

BOX = {"kind": "pedestrian", "length_m": 0.5, "width_m": 0.5}
# Failures of ToyAVSimulator (github.com/sisl/AdaptiveStressTestingToolbox, MIT) among the 1000
# episodes of draw 7; each of them is the same there.
TOOLBOX = {(-4.0, 1.0): 976, (-5.0, 1.0): 14, (-4.0, 1.4): 1, (-4.0, 0.75): 221, (-3.0, 0.5): 775}


@pytest.mark.parametrize(("start", "count"), TOOLBOX.items())
def test_as_many_episodes_fail_as_in_the_toolbox(start: tuple[float, float], count: int) -> None:
    """With the same disturbances, from starting points with rare and with frequent failures."""
    assert int(failures(CrosswalkStart(*start), normals(7, 1000)).sum()) == count


def test_an_episode_depends_on_its_own_numbers_alone() -> None:
    """Whether it is computed with others or without."""
    numbers = normals(3, 50)
    together = failures(STARTS[1], numbers)
    assert [bool(failures(STARTS[1], one[None])[0]) for one in numbers] == together.tolist()


def test_without_disturbances_the_pedestrian_walks_straight() -> None:
    """1.4 m/s across for five seconds, and never faster than 4.5 m/s."""
    assert walked(STARTS[2], np.zeros((50, 2)))[-1] == pytest.approx([0.0, 3.0])
    pushed = walked(STARTS[2], np.full((50, 2), 10.0))
    assert np.diff(pushed, axis=0)[-1] == pytest.approx([0.5, 0.5])  # 4.5 dt + 10 dt^2 / 2


def test_the_filter_follows_what_it_measures() -> None:
    """0.85 of an error of the place, 0.05 / s of it as velocity."""
    place, velocity = filtered(np.zeros(2), np.array([1.0, 0.0]), np.array([0.1, 1.0]))
    assert place == pytest.approx([0.1, 0.85])
    assert velocity == pytest.approx([1.0, 0.05])


@pytest.mark.parametrize(
    ("v", "gap", "across", "a"),
    [
        (10.0, 20.0, -1.6, 1.17),  # beside the road: the difference to 11.17 m/s
        (1.0, 20.0, -1.6, 3.0),
        (10.0, 20.0, 0.0, -9.0),
        (0.0, 8.0, 0.0, 2.25),  # 3 (1 - (4 / 8)^2)
    ],
)
def test_the_car_brakes_for_whom_it_takes_to_be_on_the_road(
    v: float, gap: float, across: float, a: float
) -> None:
    """By the law in the docstring, within its limits."""
    found = chosen_acceleration(*map(np.float64, (v, gap, across, 0.0)))
    assert float(found) == pytest.approx(a)


def test_a_track_is_at_its_points_and_between_them() -> None:
    """After the last one it stands, and heads where it first goes."""
    track = ScriptedTrack(every_s=0.1, points_m=((0.0, 0.0), (0.0, 0.0), (0.0, 1.0), (2.0, 1.0)))
    assert track.at(0.2) == (0.0, 1.0)
    assert track.at(0.1 + 0.2) == (2.0, 1.0)
    assert track.at(0.25) == pytest.approx((1.0, 1.0))
    assert track.at(9.0) == (2.0, 1.0)
    assert track.heading == pytest.approx(np.pi / 2)
    assert track.speeds == pytest.approx((0.0, 10.0, 20.0))


def test_a_track_stands_alone() -> None:
    """A body with a track has no other programme."""
    track = {"every_s": 0.1, "points_m": [[0, 0], [1, 0]]}
    assert Programme.model_validate({**BOX, "track": track}).enters == ((0.0, 0.0, 0.0), 10.0)
    with pytest.raises(ValidationError, match="track stands in place of way"):
        Programme.model_validate({**BOX, "track": track, "speed_mps": 1.0})
