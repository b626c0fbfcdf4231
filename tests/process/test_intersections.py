"""Pieces of one intersection are one place for inspect."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from cavsumo.cli.command_line import main
from cavsumo.network.inspection import best_junctions, ground
from cavsumo.network.intersections import WIDEST_M, intersections
from cavsumo.network.reader import read_network

pytestmark = pytest.mark.usefixtures("netconvert")
Nodes = dict[str, tuple[float, float]]
Edges = list[tuple[str, str, str]]  # from, to, name of the street
Built = Callable[..., Path]
HALF_M = 2.25


@pytest.fixture
def built(tmp_path: Path) -> Built:
    """Call with junctions and one-way roads between them: their network, by netconvert."""
    import cavsumo.network.osm.netconvert as program

    def build(nodes: Nodes, edges: Edges, *options: str) -> Path:
        (tmp_path / "n.nod.xml").write_text(
            "<nodes>"
            + "".join(f'<node id="{i}" x="{x}" y="{y}"/>' for i, (x, y) in nodes.items())
            + "</nodes>"
        )
        (tmp_path / "n.edg.xml").write_text(
            "<edges>"
            + "".join(
                f'<edge id="{a}-{b}" from="{a}" to="{b}" numLanes="2" speed="14"'
                + (f' name="{name}"/>' if name else "/>")
                for a, b, name in edges
            )
            + "</edges>"
        )
        words = ["node-files=n.nod.xml", "edge-files=n.edg.xml", "output-file=n.net.xml"]
        words += ["sidewalks.guess", "crossings.guess", "output.street-names", *options]
        program.netconvert(words, tmp_path)
        return tmp_path / "n.net.xml"

    return build


def dual(gap: float, first: str = "A", second: str = "B") -> tuple[Nodes, Edges]:
    """Two dual carriageways that cross, their carriageways so far apart [m]."""
    h = gap / 2
    nodes = {
        **{"nw": (-h, h), "ne": (h, h), "sw": (-h, -h), "se": (h, -h)},
        **{"n1": (-h, 200), "n2": (h, 200), "s1": (-h, -200), "s2": (h, -200)},
        **{"w1": (-200, -h), "w2": (-200, h), "e1": (200, -h), "e2": (200, h)},
    }
    ways = ["s2 se ne n2", "n1 nw sw s1", "w1 sw se e1", "e2 ne nw w2"]
    names = [first, first, second, second]
    edges = [
        (a, b, name)
        for way, name in zip(ways, names, strict=True)
        for a, b in zip(way.split(), way.split()[1:], strict=False)
    ]
    return nodes, edges


def both(a: str, b: str, name: str) -> Edges:
    """A road in both directions."""
    return [(a, b, name), (b, a, name)]


def places(net: Path) -> list[tuple[str, ...]]:
    """The pieces of the intersections that are ranked."""
    found = best_junctions(ground(read_network(net), HALF_M), 9)
    return [junction.pieces for junction in found]


@pytest.mark.parametrize("names", [("A", "B"), ("", "")], ids=["named", "unnamed"])
@pytest.mark.parametrize("gap", [12.0, 20.0, 30.0])
@pytest.mark.parametrize("lights", [True, False], ids=["lights", "priority"])
def test_where_dual_carriageways_cross_is_one_place(
    built: Built, gap: float, names: tuple[str, str], *, lights: bool
) -> None:
    """Of four junctions, with traffic lights or without, whatever its streets are called."""
    pieces = ("ne", "nw", "se", "sw")
    options = [f"tls.set={','.join(pieces)}"] if lights else []
    net = built(*dual(gap, *names), *options)
    assert places(net) == [pieces]


def test_where_a_dual_carriageway_crosses_a_road_is_one_place(built: Built) -> None:
    """Of two junctions, between them a piece of the road, whose name changes there."""
    nodes = {"a": (-9.0, 0.0), "b": (9.0, 0.0), "w": (-200.0, 0.0), "e": (200.0, 0.0)}
    nodes |= {"n1": (-9.0, 200.0), "n2": (9.0, 200.0), "s1": (-9.0, -200.0), "s2": (9.0, -200.0)}
    edges = [("n1", "a", "A"), ("a", "s1", "A"), ("s2", "b", "A"), ("b", "n2", "A")]
    edges += both("w", "a", "B") + both("a", "b", "B") + both("b", "e", "C")
    assert places(built(nodes, edges)) == [("a", "b")]


def test_side_streets_close_to_each_other_stay_two_places(built: Built) -> None:
    """25 m apart, on either side of a road or on the same."""
    for y in (200.0, -200.0):
        nodes = {"a": (0.0, 0.0), "b": (25.0, 0.0), "w": (-200.0, 0.0), "e": (200.0, 0.0)}
        nodes |= {"n": (0.0, 200.0), "s": (25.0, y)}
        for names in ("ABC", ("", "", "")):
            edges = both("w", "a", names[0]) + both("a", "b", names[0]) + both("b", "e", names[0])
            edges += both("a", "n", names[1]) + both("b", "s", names[2])
            assert sorted(places(built(nodes, edges))) == [("a",), ("b",)]


def test_one_way_streets_of_a_dense_town_stay_places_of_their_own(built: Built) -> None:
    """Blocks of 28 m between streets of other names that lead in opposite directions."""
    nodes = {"a": (-14.0, 0.0), "b": (14.0, 0.0), "w": (-200.0, 0.0), "e": (200.0, 0.0)}
    nodes |= {"n1": (-14.0, 200.0), "n2": (14.0, 200.0), "s1": (-14.0, -200.0)}
    nodes |= {"s2": (14.0, -200.0)}
    edges = [("n1", "a", "First"), ("a", "s1", "First"), ("s2", "b", "Second")]
    edges += [("b", "n2", "Second")]
    edges += both("w", "a", "Main") + both("a", "b", "Main") + both("b", "e", "Main")
    assert sorted(places(built(nodes, edges))) == [("a",), ("b",)]


def test_short_edges_along_a_street_do_not_make_it_one_place(built: Built) -> None:
    """Twenty junctions 20 m apart, where the same two streets meet: none is wider than 80 m."""
    nodes = {f"c{i:02}": (20.0 * i, 0.0) for i in range(20)}
    nodes |= {f"n{i:02}": (20.0 * i, 100.0) for i in range(20)}
    edges = [e for i in range(19) for e in both(f"c{i:02}", f"c{i + 1:02}", "A")]
    edges += [e for i in range(20) for e in both(f"c{i:02}", f"n{i:02}", "B")]
    network = read_network(built(nodes, edges))
    found = {group for group in intersections(network).values() if len(group) > 1}
    assert len(found) > 3
    for group in found:
        xs = [nodes[name][0] for name in group]
        assert max(xs) - min(xs) <= WIDEST_M


def test_the_example_networks_join_what_touches(networks: dict[str, Path]) -> None:
    """Crossings within ten metres of a junction belong to it; streets apart do not."""
    found = {
        name: {g for g in intersections(read_network(net)).values() if len(g) > 1}
        for name, net in networks.items()
    }
    assert found["pedestrians"] == set()
    assert found["crossing"] == {("4435014126", "cluster_25469824_4435014129_4435014130")}
    assert found["junction"] == {
        ("3232013769", "3232013778", "cluster_25291550_310148890_3232013770"),
        ("1377211666", "3228733109", "3228733112"),
    }


def test_the_table_names_the_pieces(built: Built, capsys: pytest.CaptureFixture[str]) -> None:
    """And so does a look at one of them."""
    net = built(*dual(20.0))
    assert main(["inspect", str(net)]) == 0
    out = capsys.readouterr().out
    assert out.count("junction ") == 1
    assert "one intersection with " in out
    assert main(["inspect", str(net), "--junction", "se"]) == 0
    out = capsys.readouterr().out
    assert "1. junction se (A, B)" in out
    assert "one intersection with ne, nw, sw" in out
