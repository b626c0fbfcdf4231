"""A simulation that stood by is that of a start, to the last bit, with any demand it can serve."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from cavsumo.model.snapshot import Snapshot
from cavsumo.sumo import native
from cavsumo.sumo.late_routes import refusal
from cavsumo.sumo.world import World

Opener = Callable[..., World]
ROUTES = """<routes>
<vTypeDistribution id="mix">
    <vType id="a" vClass="passenger" probability="0.5" speedDev="0.3"/>
    <vType id="b" vClass="truck" probability="0.5"/>
</vTypeDistribution>
{bodies}
</routes>"""
FLOW = '<flow id="f" type="mix" begin="0" end="30" from="westbound" to="westbound" {how}/>'
WALKS = '<personFlow id="p" begin="0" end="9" {how}><walk edges="westbound"/></personFlow>'
DRAWN = 'departLane="random" departPos="random" departSpeed="random"'


def course(world: World, seed: int, *, stood_by: bool) -> list[Snapshot]:
    """All that is seen in an episode without testers."""
    if stood_by:
        world.stand_by()
    seen = [world.reset(seed, (), ())]
    assert world.simulations.stood_by == stood_by
    while len(seen) < 150 and (snapshot := world.step((), None)) is not None:
        seen.append(snapshot)
    return seen


def routes(folder: Path, bodies: str) -> Path:
    """A route file."""
    file = folder / "x.rou.xml"
    file.write_text(ROUTES.format(bodies=bodies), encoding="utf-8")
    return file


@pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])
@pytest.mark.parametrize("demand", [{}, {"routes": "auto"}, {"traffic": "20,20"}])
def test_the_same_episodes(open_world: Opener, name: str, demand: dict[str, str]) -> None:
    """In any order, of one seed and of another; SUMO draws what it draws from that seed."""
    with open_world(name, **demand) as world:
        started = [course(world, seed, stood_by=False) for seed in (3, 2**40)]
        assert [course(world, seed, stood_by=True) for seed in (3, 2**40)] == started
        assert course(world, 3, stood_by=False) == started[0]
    if demand and name != "pedestrians":
        assert started[0] != started[1]


def test_a_simulation_that_another_world_took_stands_by_no_more(open_world: Opener) -> None:
    """Whose it was starts another one."""
    with open_world("pedestrians") as world, open_world("crossing") as other:
        expected = course(world, 3, stood_by=False)
        world.stand_by()
        other.reset(1, (), ())
        assert course(world, 3, stood_by=False) == expected


@pytest.mark.parametrize(
    "bodies", [FLOW.format(how=f'number="20" {DRAWN}'), WALKS.format(how='number="9"')]
)
def test_what_is_drawn_as_the_file_is_read(open_world: Opener, tmp_path: Path, bodies: str) -> None:
    """Types, speed factors and places."""
    with open_world("pedestrians", routes=str(routes(tmp_path, bodies))) as world:
        assert world.simulations.stand_by_refusal == ""
        started = course(world, 5, stood_by=False)
        assert any(snapshot.raw_background for snapshot in started)
        assert course(world, 5, stood_by=True) == started
        assert course(world, 6, stood_by=True) != started


@pytest.mark.parametrize(
    ("bodies", "words"),
    [
        (FLOW.format(how='probability="0.5"'), "flow 'f' has random departures"),
        (FLOW.format(how='period="exp(0.5)"'), "flow 'f' has random departures"),
        (WALKS.format(how='probability="0.5"'), "flow 'p' has random departures"),
        ('<include href="other.rou.xml"/>', "includes others"),
        ("<vehicle", "cannot be read"),
    ],
)
def test_a_demand_that_must_be_there_at_the_start(tmp_path: Path, bodies: str, words: str) -> None:
    """SUMO draws from generators that it seeds only then."""
    assert words in refusal(routes(tmp_path, bodies), ())


def test_additional_files_from_which_nobody_enters(tmp_path: Path) -> None:
    """They are read when SUMO starts, so they must hold no traffic."""
    file = tmp_path / "x.add.xml"
    root = ElementTree.Element("additional")
    root.append(ElementTree.Element("vType", id="a"))
    ElementTree.ElementTree(root).write(file)
    assert refusal(None, [file]) == ""
    root.append(ElementTree.Element("vehicle", id="v"))
    ElementTree.ElementTree(root).write(file)
    assert "traffic enters from the additional file" in refusal(None, [file])


def test_another_build_of_libsumo(open_world: Opener, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that lacks a function says so, and starts as ever."""
    monkeypatch.setattr(native, "OPEN_ROUTES", "other")
    with open_world("pedestrians") as world:
        assert "cannot seed a running simulation" in world.simulations.stand_by_refusal
