"""Background traffic that is drawn: how much, where, the same again, and that SUMO plays it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import libsumo
import pytest

from cavsumo import cli
from cavsumo.batch.prepared import BEYOND_S, prepare
from cavsumo.model.scenario import BatchPlan, plan_from
from cavsumo.network.reader import driving_lanes, is_pavement, read_network
from cavsumo.network.site import Site
from cavsumo.network.traffic import APART_M, CLEAR_M
from cavsumo.sumo.world import World

Staged = Callable[..., tuple[BatchPlan, Site]]
Opener = Callable[..., World]
ALL = pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])


def drawn(staged: Staged, name: str, **settings: object) -> ElementTree.Element:
    """The demand that is drawn for a network, read back."""
    return ElementTree.fromstring(staged(name, **settings)[1].demand or "")


def kilometres(file: Path) -> tuple[float, float]:
    """Roads for cars, and roads with pavements, each direction for itself."""
    edges = read_network(file).edges
    roads = sum(e.getLength() for e in edges if driving_lanes(e))
    paved = sum(e.getLength() for e in edges if any(is_pavement(x) for x in e.getLanes()))
    return roads / 1000, paved / 1000


def run(folder: Path, monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    """The exit status of ``cavsumo run`` in a folder."""
    monkeypatch.chdir(folder)
    return cli.main(["run", "-q", "--exit-zero", "--trace", "none", *words])


# How much, where


@ALL
def test_as_many_set_out_as_the_density_says(
    staged: Staged, networks: dict[str, Path], name: str
) -> None:
    """Departures after the start, per minute and kilometre, for cars and for pedestrians."""
    root = drawn(staged, name, traffic=[12, 7])
    roads, paved = kilometres(networks[name])
    minutes = (60.0 + BEYOND_S) / 60.0
    for tag, density, length in (("vehicle", 12, roads), ("person", 7, paved)):
        times = [float(e.get("depart", "")) for e in root.iter(tag)]
        assert times == sorted(times)
        later = [time for time in times if time > 0.0]
        assert all(1.0 <= time <= 60.0 + BEYOND_S for time in later)
        assert len(later) / minutes / length == pytest.approx(density, abs=0.6 / minutes / length)
    assert drawn(staged, name, traffic="12,7").tag == "routes"


@ALL
def test_sumo_lets_them_depart_when_they_are_meant_to(
    open_world: Opener, networks: dict[str, Path], name: str
) -> None:
    """In SUMO the density is what was asked for, within a tenth, and nobody is left behind."""
    with open_world(name, traffic=[8, 8]) as world:
        world.reset(1, (), ())
        cars = persons = 0
        while libsumo.simulation.getTime() < 60.0 + BEYOND_S:
            libsumo.simulationStep()
            cars += len([v for v in libsumo.simulation.getDepartedIDList() if v != "ego"])
            persons += len(libsumo.simulation.getDepartedPersonIDList())
        left = len(libsumo.simulation.getPendingVehicles())
    minutes = (60.0 + BEYOND_S) / 60.0
    for count, length in zip((cars, persons), kilometres(networks[name]), strict=True):
        assert count / minutes / length == pytest.approx(8, rel=0.1, abs=0.6 / minutes / length)
    assert left <= 1


def test_some_are_on_the_road_at_the_start(staged: Staged) -> None:
    """Cars underway with room around them, pedestrians; none where the ego is to enter."""
    site = staged("junction", traffic=30)[1]
    root = ElementTree.fromstring(site.demand or "")
    places: dict[str, list[float]] = {}
    for car in root.iter("vehicle"):
        route = car.find("route")
        if car.get("depart") == "0.0" and route is not None:
            along = float(car.get("departPos", ""))
            places.setdefault((route.get("edges") or "").split()[0], []).append(along)
    assert sum(map(len, places.values())) > 10
    for along in places.values():
        gaps = [b - a for a, b in zip(sorted(along), sorted(along)[1:], strict=False)]
        assert all(gap >= APART_M - 0.1 for gap in gaps)
    first = places.get(site.route.edges[0], [])
    assert all(along >= site.route.depart_m + CLEAR_M - 0.1 for along in first)
    assert any(person.get("depart") == "0.0" for person in root.iter("person"))


def test_nothing_at_all_at_density_zero(staged: Staged) -> None:
    """Zero keeps the roads empty, one by one too."""
    assert len(drawn(staged, "crossing", traffic=0)) == 1  # the type of the cars
    tags = {e.tag for e in drawn(staged, "crossing", traffic="0,9")}
    assert tags == {"vType", "person"}


def test_pedestrians_only_where_there_are_pavements(
    staged: Staged, networks: dict[str, Path], tmp_path: Path
) -> None:
    """A network without pavements has cars only."""
    file = tmp_path / "bare.net.xml"
    road = networks["pedestrians"].read_text(encoding="utf-8")
    file.write_text(road.replace('allow="pedestrian"', 'allow="bicycle"'), encoding="utf-8")
    site = staged(net=file, traffic=20, jaywalk=True)[1]
    assert "<vehicle" in (site.demand or "")
    assert "<person" not in (site.demand or "")


# The same again


@pytest.mark.parametrize("name", ["crossing", "junction"])
def test_the_ego_enters_and_nobody_jumps(open_world: Opener, name: str) -> None:
    """Ten episodes in dense traffic: the ego is on the road at once, with room around it."""
    with open_world(name, traffic=15) as world:
        for seed in range(10):
            snapshot = world.reset(seed, (), ())
            assert libsumo.simulation.getTime() < 3.0
            ego = snapshot.ego
            assert all(
                abs(x - ego.x) + abs(y - ego.y) > 4.0 for _, x, y, *_ in snapshot.raw_background
            )
            for _ in range(50):
                if world.step((), None) is None:
                    break
            assert world.teleports == 0
            assert not any("ego" in pair for pair in world.collisions)


def test_another_density_is_another_batch(
    tmp_path: Path,
    networks: dict[str, Path],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """--resume compares the density and, by its checksum, what was drawn."""
    net = ["--net", str(networks["pedestrians"]), "--runs", "1", "-o", "a.csv"]
    assert run(tmp_path, monkeypatch, *net, "--traffic", "6") == 0
    assert run(tmp_path, monkeypatch, *net, "--traffic", "7", "--resume") == 2
    assert "traffic was [6.0, 6.0], is [7.0, 7.0]" in capsys.readouterr().err
    manifest = json.loads((tmp_path / "a.json").read_text())
    manifest["sha256"]["traffic"] = "0" * 64
    (tmp_path / "a.json").write_text(json.dumps(manifest))
    assert run(tmp_path, monkeypatch, *net, "--traffic", "6", "--resume") == 2
    assert "sha256: traffic was 000" in capsys.readouterr().err


# What is asked for


def test_traffic_takes_the_place_of_a_route_file_that_is_found(networks: dict[str, Path]) -> None:
    """routes/NAME.rou.xml is not used; with routes none, traffic is drawn; traffic none is none."""
    net = networks["crossing"]
    assert plan_from({"net": net}, "t").scenario.routes is not None
    for settings in ({"traffic": 4}, {"traffic": "4", "routes": "none"}):
        scenario = plan_from({"net": net, **settings}, "t").scenario
        assert (scenario.routes, scenario.traffic) == (None, (4.0, 4.0))
    scenario = plan_from({"net": net, "traffic": "none"}, "t").scenario
    assert scenario.routes is not None
    assert scenario.traffic is None
    assert prepare(plan_from({"net": net}, "t")).site.demand is None


@pytest.mark.parametrize(
    "density", ["-1", "nan", "inf", "1,nan", "4,-2", "1,2,3", "much", "", "101", "true", ","]
)
def test_what_is_no_density_is_refused(
    tmp_path: Path,
    networks: dict[str, Path],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    density: str,
) -> None:
    """One sentence with what was given, exit status 2, and nothing is written."""
    net = ["--net", str(networks["crossing"])]
    assert run(tmp_path, monkeypatch, *net, f"--traffic={density}") == 2
    said = capsys.readouterr().err
    assert said.startswith("cavsumo: run: traffic: must be a number from 0 to 100, or two")
    assert repr(density) in said
    assert said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_route_file_and_traffic_exclude_each_other(
    tmp_path: Path,
    networks: dict[str, Path],
    routes: dict[str, Path],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Who names both is told so in one sentence."""
    words = ["--net", str(networks["crossing"]), "--routes", str(routes["crossing"])]
    assert run(tmp_path, monkeypatch, *words, "--traffic", "4") == 2
    said = capsys.readouterr().err
    assert "not both" in said
    assert said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
