"""Episodes that share a simulation: the same traffic again, the same rows whoever plays them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import libsumo
import pytest
from inline import cavsumo

from cavsumo.model.bodies import PEDESTRIAN, Body
from cavsumo.model.carriageway import Start
from cavsumo.model.scenario import Simulation
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.results.reading import read_rows
from cavsumo.results.rows import is_test
from cavsumo.sumo.demand import types_only
from cavsumo.sumo.world import World

Opener = Callable[..., World]
# An ego whose driver draws no random numbers of SUMO's.
CALM = {"ego_params": {"sigma": 0, "speedDev": 0}}
STEADY = ["--ego-param", "sigma=0", "--ego-param", "speedDev=0"]


def course(world: World, simulation: Simulation, steps: int = 120) -> list[Snapshot]:
    """What is seen in an episode with one tester who stands on a pavement."""
    area = world.site.areas[0]
    x, y, o = area.pavement.at((area.begin + area.end) / 2)
    start = Start(x, y, o, walk=area.walk)
    states = (BodyState(Body("tester0", PEDESTRIAN), x, y, 0.0, o),)
    seen = [world.reset(7, states, (start,), simulation=simulation)]
    for _ in range(steps):
        snapshot = world.step(states, None)
        if snapshot is None:
            break
        seen.append(snapshot)
    return seen


def who(seen: list[Snapshot]) -> list[set[str]]:
    """Who is there besides ego and tester, timestep by timestep."""
    return [{raw[0].id for raw in snapshot.raw_background} for snapshot in seen]


def run(folder: Path, *words: str, name: str = "r.csv") -> list[dict[str, str]]:
    """The rows of ``cavsumo run --reset shared``, without the real time."""
    done = cavsumo(folder, "run", "-q", "--exit-zero", "-o", name, *words)
    assert done.returncode == 0, done.stderr
    return [{k: v for k, v in row.items() if k != "wall_s"} for row in read_rows(folder / name)]


@pytest.mark.parametrize("name", ["crossing", "junction"])
def test_the_traffic_departs_again_as_it_did(open_world: Opener, name: str) -> None:
    """The same bodies enter at the same times as when SUMO reads the route file itself."""
    with open_world(name, routes="auto", **CALM) as world:
        own, *shared = (course(world, s) for s in ("own", "new", "same", "same"))
    assert any(who(own))
    for again in shared:
        common = min(len(own), len(again))
        assert who(again)[:common] == who(own)[:common]


def test_without_random_numbers_an_episode_is_the_same_bit_by_bit(open_world: Opener) -> None:
    """On empty roads with a steady driver nothing tells the first episode from the third."""
    with open_world("crossing", **CALM) as world:
        own, new, same = (course(world, s) for s in ("own", "new", "same"))
    assert len(own) > 50
    assert repr(own) == repr(new) == repr(same)


def test_lights_begin_anew(open_world: Opener) -> None:
    """Each episode meets the traffic lights of the first moment, not those of the last."""

    def lights(world: World, simulation: Simulation) -> list[tuple[str, ...]]:
        states: list[tuple[str, ...]] = []
        area = world.site.areas[0]
        x, y, o = area.pavement.at(area.begin)
        still = (BodyState(Body("tester0", PEDESTRIAN), x, y, 0.0, o),)
        world.reset(1, still, (Start(x, y, o, walk=area.walk),), simulation=simulation)
        for _ in range(70):
            names = libsumo.trafficlight.getIDList()
            states.append(tuple(map(libsumo.trafficlight.getRedYellowGreenState, names)))
            if world.step(still, None) is None:
                break
        return states

    with open_world("junction", end=60.0, **CALM) as world:
        first, second, third = (lights(world, s) for s in ("own", "new", "same"))
    assert first == second == third
    assert first[0]


def test_every_test_found_was_played_again_in_a_fresh_simulation(
    networks: dict[str, Path], tmp_path: Path
) -> None:
    """Tests are rows of fresh simulations, the same rows as without sharing, and replayable."""
    words = ["-n", str(networks["crossing"]), "--runs", "8", "--testers", "1", *STEADY]
    shared = run(tmp_path, *words, "--reset", "shared")
    fresh = run(tmp_path, *words, name="fresh.csv")
    assert {row["reset"] for row in shared} == {"fresh", "shared"}
    assert any(map(is_test, shared))
    for row, reference in zip(shared, fresh, strict=True):
        assert row["reset"] == "fresh" or not is_test(row)
        if row["reset"] == "fresh":
            assert row | {"trace": ""} == reference | {"trace": ""}
    for reset in ("fresh", "shared"):
        number = next(row["run"] for row in shared if row["reset"] == reset)
        done = cavsumo(tmp_path, "replay", "r.csv", number)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "the same" in done.stdout


def test_the_summary_says_how_many_did_not_come_out_again(
    networks: dict[str, Path], tmp_path: Path
) -> None:
    """Found and lost are counted: a search does not pass for a measurement."""
    words = ["-n", str(networks["crossing"]), "--runs", "6", "--reset", "shared"]
    done = cavsumo(tmp_path, "run", *words, "--trace", "none", "-o", "r.csv")
    rows = read_rows(tmp_path / "r.csv")
    found = sum(row["reset"] == "fresh" for row in rows)
    lost = found - sum(map(is_test, rows))
    assert f"{found} tests found in shared simulations" in done.stdout
    assert f": {lost} (" in done.stdout


def test_types_and_named_routes_are_kept_and_departures_are_not(tmp_path: Path) -> None:
    """What a route file defines stays, what it sends is sent by us."""
    file = tmp_path / "x.rou.xml"
    file.write_text(
        '<routes><vType id="a" tau="2"/><route id="r" edges="e"/><flow id="f" begin="0" end="9" '
        'number="3" route="r"/><vehicle id="v" depart="0" route="r"/><person id="p" depart="0"/>'
        "</routes>"
    )
    kept = types_only(file)
    assert 'id="a"' in kept
    assert 'tau="2"' in kept
    assert 'id="r"' in kept
    assert not any(f'id="{name}"' in kept for name in "fvp")


def test_a_person_who_rides_is_refused(networks: dict[str, Path], tmp_path: Path) -> None:
    """Rides depend on vehicles that may not come; it is said before anything is written."""
    file = tmp_path / "ride.rou.xml"
    file.write_text(
        '<routes><vType id="car" vClass="passenger"/>'
        '<vehicle id="taxi" type="car" depart="0"><route edges="westbound"/></vehicle>'
        '<person id="rider" depart="0"><ride from="westbound" to="westbound" lines="taxi"/>'
        "</person>"
        "</routes>"
    )
    words = ["-n", str(networks["pedestrians"]), "-r", str(file), "--reset", "shared"]
    done = cavsumo(tmp_path, "run", *words, "-o", "r.csv", "--runs", "1")
    assert done.returncode == 2, done.stderr
    assert "person 'rider' rides" in done.stderr
    assert not (tmp_path / "r.csv").exists()
