"""How far the ego came, what it lost against a free drive, whether it stood still or crawled."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from staging import Stage

from cavsumo.agents.casting import resolve_cast
from cavsumo.model.carriageway import Limit
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import Snapshot
from cavsumo.network.site import Site
from cavsumo.results.columns import measured
from cavsumo.simulation.ego_progress import EgoProgress, free_time
from cavsumo.simulation.loop import play
from cavsumo.simulation.setup import make_setup

Staged = Callable[..., tuple[BatchPlan, Site]]
A, B = 2.6, 4.5  # m/s2, of the free drive


@pytest.fixture(scope="module")
def straight(staged: Staged) -> Stage:
    """The straight road without traffic."""
    return Stage(*staged("pedestrians"))


def test_a_free_drive_at_the_limit_takes_way_over_speed() -> None:
    """Nothing is lost where there is nothing to wait for."""
    limits = (Limit(0.0, 10.0),)
    assert free_time(limits, 100.0, 20.0, 65.5, 10.0) == pytest.approx(4.55)
    assert free_time(limits, 100.0, 20.0, 20.0, 10.0) == 0.0
    assert free_time((), 100.0, 0.0, 50.0, 10.0) is None


def test_a_free_drive_from_rest_accelerates() -> None:
    """v = a t up to the limit, then steady: 100 m in 10 / a + (100 - 50 / a) / 10 seconds."""
    by_hand = 10.0 / A + (100.0 - 50.0 / A) / 10.0
    found = free_time((Limit(0.0, 10.0),), 200.0, 0.0, 100.0, 0.0)
    assert found == pytest.approx(by_hand, abs=0.02)  # the last cell is cut at the limit


def test_a_free_drive_brakes_before_a_lower_limit() -> None:
    """From 10 to 5 m/s at b takes 75 / (2 b) metres before the new limit, and 5 / b seconds."""
    limits = Limit(0.0, 10.0), Limit(50.0, 5.0)
    braking = (100.0 - 25.0) / (2 * B)
    by_hand = (50.0 - braking) / 10.0 + 5.0 / B + 20.0 / 5.0
    assert free_time(limits, 100.0, 0.0, 70.0, 10.0) == pytest.approx(by_hand, abs=0.02)


@pytest.mark.parametrize(
    ("progress", "said"),
    [
        (EgoProgress(False, 0.0, 60.0, 60.0, 60.0, 60.0), "stood"),
        (EgoProgress(False, 50.0, 60.0, 55.0, 20.0, 10.0), "stood"),
        (EgoProgress(False, 50.0, 60.0, 55.0, 20.0, 9.9), "crawled"),  # 40 s for 5 s
        (EgoProgress(None, 10.0, 12.0, 11.0, 0.0, 0.0), "crawled"),
        (EgoProgress(None, 10.0, 9.0, 8.0, 0.0, 0.0), ""),  # too short to tell
        (EgoProgress(True, 140.0, 60.0, 42.0, 35.0, 0.0), ""),  # a red light
        (EgoProgress(True, 100.0, 10.0, -0.5, 0.0, 0.0), ""),
        (EgoProgress(True, 100.0, 30.0, None, 0.0, 0.0), ""),
    ],
)
def test_who_stood_still_or_crawled(progress: EgoProgress, said: str) -> None:
    """Standing at the end for ten seconds, or moving four times as long as the free drive."""
    assert progress.frozen == said


@pytest.mark.parametrize("network", ["pedestrians", "crossing"])
def test_a_plain_driver_alone_loses_next_to_nothing(staged: Staged, network: str) -> None:
    """SUMO's driver who decides in every timestep, on roads without traffic, arrives in time."""
    plan, site = staged(
        network, agents=["noop"], testers=1, ego_params={"actionStepLength": 0, "sigma": 0}
    )
    setup = make_setup(plan.scenario, site)
    agents = resolve_cast(plan).agents("noop")
    try:
        row = measured(play(setup, agents, 1))
    finally:
        setup.close()
    assert (row["outcome"], row["arrived"], row["frozen"]) == ("not_triggered", 1, "")
    assert abs(row["lost_s"]) < 0.1 * row["time_s"]
    length = site.route.path.length - site.route.path.project(*site.route.path.points[0]).along
    assert row["driven_m"] == pytest.approx(length, abs=20.0)
    assert row["mean_speed_mps"] == pytest.approx(row["driven_m"] / row["time_s"])


def test_an_ego_that_stops_for_ever_stood(straight: Stage) -> None:
    """It is never put to a test, so its verdict says nothing; the row says why."""
    far = [straight.beside(60.0, 5.0, -math.pi / 2)]
    episode = straight.play("reaction-zone", lambda snapshot: 0.0, places=far, end=20.0)[1]
    row = measured(episode)
    assert (row["outcome"], row["arrived"], row["frozen"]) == ("not_triggered", 0, "stood")
    assert row["stood_s"] == pytest.approx(20.0, abs=1.5)  # it braked from 8 m/s
    assert row["lost_s"] > 15.0


def test_an_ego_at_walking_pace_crawled(straight: Stage) -> None:
    """It never stood, and would take minutes for the road."""
    far = [straight.beside(60.0, 5.0, -math.pi / 2)]
    episode = straight.play("reaction-zone", lambda snapshot: 1.0, places=far, end=20.0)[1]
    row = measured(episode)
    assert (row["arrived"], row["stood_s"], row["frozen"]) == (0, 0.0, "crawled")


def test_a_verdict_leaves_open_whether_the_ego_arrives(straight: Stage) -> None:
    """The episode ends with the collision, before it was time to arrive."""

    def on(snapshot: Snapshot) -> float:
        return 8.0

    there = [straight.beside(40.0, 0.0, -math.pi / 2)]
    row = measured(straight.play("collision", on, places=there)[1])
    assert (row["outcome"], row["arrived"], row["frozen"]) == ("violated", None, "")
