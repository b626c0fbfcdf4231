"""Cues of the ego: its reactions, read from its speed, and the phase of its decisions."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from cavsumo.agents.cues import BRAKES, SPEEDS_UP, Awaited, EgoReactions, in_phase, zone_m
from cavsumo.model.bodies import CAR, Body
from cavsumo.model.snapshot import BodyState, Snapshot

DT = 0.1
EGO = Body("ego", CAR)


def _speeds(*speeds: float, unseen: Sequence[int] = ()) -> list[Snapshot]:
    """Snapshots of an ego with these speeds; in some it is not seen."""
    return [
        Snapshot(
            i, i * DT, BodyState(EGO, 0.0, 0.0, v, 0.0), 0.0, (),
            unseen=frozenset({"ego"}) if i in unseen else None,
        )
        for i, v in enumerate(speeds)
    ]  # fmt: skip


def _seen(*speeds: float, unseen: Sequence[int] = ()) -> list[str | None]:
    reactions, found = EgoReactions(), []
    for snapshot in _speeds(*speeds, unseen=unseen):
        reactions.see(snapshot)
        found.append(reactions.now)
    return found


def test_a_reaction_is_a_change_of_speed_in_all() -> None:
    """It brakes as 0.8 m/s are lost, and speeds up as 0.5 m/s are gained, from the lowest speed."""
    assert _seen(8.0, 7.5, 7.1, 5.0, 4.0, 4.3, 4.6) == [
        None, None, BRAKES, BRAKES, BRAKES, BRAKES, SPEEDS_UP,
    ]  # fmt: skip


def test_an_ego_that_sets_off_or_dawdles_does_not_react() -> None:
    """Gaining speed before it ever braked is none, nor is what SUMO's driver loses by chance."""
    assert set(_seen(0.0, 2.0, 5.0, 8.0, 7.87, 8.0, 7.8, 8.0)) == {None}


def test_what_is_not_seen_is_no_reaction() -> None:
    """A sensor shows the ego as it was last seen."""
    assert _seen(8.0, 8.0, 3.0, 3.0, unseen=[2]) == [None, None, None, BRAKES]


def test_an_awaited_reaction_may_be_under_way_and_has_a_delay() -> None:
    """The delay begins when the reaction is noticed; what comes after it does not matter."""
    reactions, awaited, came = EgoReactions(), Awaited(BRAKES, 0.2), []
    for snapshot in _speeds(8.0, 7.0, 7.6, 8.0, 8.0):
        reactions.see(snapshot)
        came.append(awaited.came(reactions, snapshot.time))
    assert came == [False, False, False, True, True]
    assert not Awaited(BRAKES).came(reactions, 1.0)  # it speeds up by now
    assert Awaited(SPEEDS_UP).came(reactions, 1.0)


@pytest.mark.parametrize("phase", [0.0, 0.35, 0.99])
def test_one_timestep_of_an_interval_has_the_phase(phase: float) -> None:
    """The first one from it on; all of them for an ego that decides in every timestep."""
    times = [i * DT for i in range(30)]
    chosen = [t for t in times if in_phase(t, phase, 1.0, DT)]
    assert len(chosen) in (2, 3)
    for time in chosen:
        assert (time - phase + 1e-6) % 1.0 < DT
    assert all(in_phase(t, 0.0, 0.0, DT) for t in times)


def test_a_zone_is_counted_from_the_braking_distance() -> None:
    """That from 9 m/s at 9 m/s2 is 4.5 m; the way of the reaction time is 6.075 m."""
    assert zone_m(0.0, 9.0) == pytest.approx(4.5)
    assert zone_m(1.0, 9.0) == pytest.approx(4.5 + 6.075)
    assert zone_m(-0.5, 9.0) == pytest.approx(4.5 - 3.0375)
