"""A SUMO configuration in place of a network: the files that it names, and no more."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from cavsumo.errors import InputError
from cavsumo.model.scenario import BatchPlan, plan_from
from cavsumo.model.scenario_file import read_config

INPUT = """
    <net-file value="town.net.xml"/>
    <route-files value="cars.rou.xml"/>
    <additional-files value="signs.add.xml, lots/stops.add.xml"/>
"""

Town = Callable[[str], Path]


@pytest.fixture
def town(tmp_path: Path, networks: dict[str, Path]) -> Town:
    """Call with the input section of a configuration: it, beside the files of a town."""
    (tmp_path / "town.net.xml").symlink_to(networks["pedestrians"])
    (tmp_path / "lots").mkdir()
    for name in ("cars.rou.xml", "more.rou.xml", "town.rou.xml"):
        (tmp_path / name).write_text("<routes/>", encoding="utf-8")
    for name in ("signs.add.xml", "lots/stops.add.xml"):
        (tmp_path / name).write_text("<additional/>", encoding="utf-8")

    def write(section: str) -> Path:
        file = tmp_path / "town.sumocfg"
        text = (
            f"<configuration><input>{section}</input><time><end value='9'/></time></configuration>"
        )
        file.write_text(text, encoding="utf-8")
        return file

    return write


def planned(net: Path, **settings: object) -> BatchPlan:
    """The plan of settings."""
    return plan_from({"net": net, **settings}, "run")


def test_it_gives_network_routes_and_additional_files(town: Town, tmp_path: Path) -> None:
    """Relative to itself; what else it says is not taken over."""
    scenario = planned(town(INPUT)).scenario
    assert scenario.net == tmp_path / "town.net.xml"
    assert scenario.routes == tmp_path / "cars.rou.xml"
    assert scenario.additional == (
        tmp_path / "signs.add.xml",
        tmp_path / "lots" / "stops.add.xml",
    )
    assert scenario.end == 60.0


def test_what_is_said_goes_before_what_it_names(town: Town, tmp_path: Path) -> None:
    """Files by their options, and traffic that is drawn."""
    file = town(INPUT)
    scenario = planned(file, routes=tmp_path / "more.rou.xml", additional=()).scenario
    assert (scenario.routes, scenario.additional) == (tmp_path / "more.rou.xml", ())
    assert planned(file, routes="none").scenario.routes is None
    drawn = planned(file, traffic=4).scenario
    assert (drawn.routes, drawn.traffic) == (None, (4.0, 4.0))
    assert planned(file, traffic="none").scenario.routes == tmp_path / "cars.rou.xml"


def test_where_it_names_no_routes_the_roads_are_empty(town: Town) -> None:
    """A route file that would be found beside the network is not its own; SUMO's short names do."""
    scenario = planned(town('<net value="town.net.xml"/>')).scenario
    assert (scenario.routes, scenario.additional) == (None, ())


def test_a_scenario_file_may_name_one(town: Town, tmp_path: Path) -> None:
    """By a path relative to it."""
    town(INPUT)
    file = tmp_path / "scenario.toml"
    file.write_text('net = "town.sumocfg"\n', encoding="utf-8")
    assert plan_from(read_config(file), "run").scenario.net == tmp_path / "town.net.xml"


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ("", "names no network (net-file)"),
        ('<net-file value="a.net.xml,b.net.xml"/>', "names no network (net-file)"),
        (
            '<net-file value="town.net.xml"/><route-files value="cars.rou.xml,more.rou.xml"/>',
            "names 2 route files, a batch has one; name it with --routes FILE",
        ),
        ('<net-file value="town.net.xml"/><route-files value="no.rou.xml"/>', "no such file"),
        ("<net-file", "not well-formed XML"),
    ],
)
def test_one_that_cannot_be_played_is_refused(town: Town, section: str, said: str) -> None:
    """In a sentence that names it."""
    with pytest.raises(InputError) as refused:
        planned(town(section))
    assert said in str(refused.value)
    assert str(refused.value).startswith("run: ")


def test_of_several_route_files_one_is_named(town: Town, tmp_path: Path) -> None:
    """As the refusal says."""
    file = town('<net-file value="town.net.xml"/><route-files value="cars.rou.xml,more.rou.xml"/>')
    cars = tmp_path / "cars.rou.xml"
    assert planned(file, routes=cars).scenario.routes == cars


@pytest.mark.parametrize(
    ("name", "network"),
    [
        ("my town.osm", "'my town.net.xml'"),
        ("a/town.osm.xml", "town.net.xml"),
        ("town.osm.gz", "town.net.xml"),
        ("region.osm.pbf", "region.net.xml"),
        ("REGION.PBF", "REGION.net.xml"),
    ],
)
def test_openstreetmap_data_is_answered_with_the_command_that_imports_it(
    name: str, network: str
) -> None:
    """Whether it is there or not; the command can be pasted."""
    with pytest.raises(InputError) as refused:
        planned(Path(name))
    said = str(refused.value)
    assert said.startswith(f"run: {name!r} is OpenStreetMap data")
    assert "cavsumo import-osm" in said
    assert said.endswith(f"-o {network}")
