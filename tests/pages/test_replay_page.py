"""What the page of an episode is made of: packed numbers, curves, zones, words."""

from __future__ import annotations

import dataclasses
import json
import math
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import LineString
from support import ROOT

from cavsumo.batch.replay import Record
from cavsumo.errors import InputError
from cavsumo.model.carriageway import Roads
from cavsumo.network.site import Site
from cavsumo.report.pages.replay.curves import moment, on_or_entering, time_to_collision
from cavsumo.report.pages.replay.facts import marks, verdict
from cavsumo.report.pages.replay.packing import NOTHING, columns, packed, shapes, unpacked
from cavsumo.report.pages.replay.page import episode, page, write_page
from cavsumo.results.traces import Shape, Trace

Shown = tuple[Record, Trace, Site]


@given(st.lists(st.integers(-(10**9), 10**9)))
def test_packed_numbers_come_back(values: list[int]) -> None:
    """Whatever integers: the same again."""
    assert unpacked(packed(values)) == values


def test_steady_numbers_take_a_byte_each() -> None:
    """Differences from -64 to 63 are one byte, so three of them four letters."""
    assert len(packed(range(0, 3000, 50))) == 80


def test_a_table_is_packed_by_column() -> None:
    """Each column in its own unit."""
    assert unpacked(columns([(1.0, 0.5), (2.0, -0.25)], (10.0, 100.0))) == [10, 20, 50, -25]


def test_shapes_are_packed_with_their_sizes() -> None:
    """Points in centimetres, abscissae first; a shape without points stays one."""
    text = shapes([[(0.0, 1.0), (2.0, 3.0)], [], [(4.0, 5.0)]])
    assert unpacked(text["sizes"]) == [2, 0, 1]
    assert unpacked(text["points"]) == [0, 200, 400, 100, 300, 500]


BOX = {"ego": Shape("car", 4.0, 2.0, 2.6), "a": Shape("pedestrian", 1.0, 1.0, 0.5)}


@pytest.mark.parametrize(
    ("ego", "other", "gap", "ttc"),
    [
        # 10 m between the centres, 2.0 + 0.5 m of boxes in between, closing at 5 m/s
        ([0, 0, 5, 0], [10, 0, 0, 0], 7.5, 1.5),
        # it comes towards the ego at 1 m/s
        ([0, 0, 5, 0], [10, 0, 1, math.pi], 7.5, 1.25),
        # it goes away as fast as the ego comes
        ([0, 0, 5, 0], [10, 0, 5, 0], 7.5, None),
        # crossing at right angles at the same distance as the ego: both come nearer
        ([-3, 0, 3, 0], [0, -3, 3, math.pi / 2], 2.5**0.5, 2.5**0.5 / 18**0.5),
        # touching
        ([0, 0, 5, 0], [2.4, 0, 0, 0], 0.0, 0.0),
    ],
)  # fmt: skip
def test_gap_and_time_to_collision(
    ego: list[float], other: list[float], gap: float, ttc: float | None
) -> None:
    """Worked out by hand."""
    found = moment({"ego": ego, "testers": {"a": other}}, BOX)
    assert found.speed == ego[2]
    assert found.gap == pytest.approx(gap)
    assert found.ttc == (None if ttc is None else pytest.approx(ttc))


def test_the_nearest_and_the_soonest_count() -> None:
    """The gap is that to the nearest tester, the time that to the first to be reached."""
    frame = {"ego": [0, 0, 10, 0], "testers": {"a": [0, 4, 0, 0], "b": [20, 0, 0, 0]}}
    found = moment(frame, {**BOX, "b": BOX["a"]})
    assert found.gap == pytest.approx(2.5)
    assert found.ttc == pytest.approx(1.75)
    assert moment({"ego": [0, 0, 10, 0], "testers": {}}, BOX)[1:] == (None, None)


@pytest.mark.parametrize(
    ("other", "ttc"),
    [
        ([20, -2.5, 0, math.pi / 2], None),  # stands on the pavement, its front at the kerb
        ([20, -2.5, 1.4, 0.0], None),  # walks along it
        ([20, -4.5, 1.4, math.pi / 2], None),  # walks to the kerb, 1.5 s from it
        ([20, -2.5, 1.4, math.pi / 2], 1.7),  # steps off it
        ([20, -1.5, 0, 0.0], 1.7),  # stands on the carriageway
        ([2.4, -1.5, 0, math.pi / 2], 0.0),  # touches the ego
    ],
)
def test_who_stays_on_the_pavement_is_no_collision_to_come(
    other: list[float], ttc: float | None
) -> None:
    """The time counts of those on the carriageway, here |y| < 2 m, and of those entering it."""
    roads = Roads(shapely.box(-50, -2, 50, 2), [LineString([(-50, 0), (50, 0)])])
    found = moment({"ego": [0, 0, 10, 0], "testers": {"a": other}}, BOX, roads)
    assert found.gap is not None
    assert found.ttc == (None if ttc is None else pytest.approx(ttc, abs=0.1))


def test_the_page_asks_where_the_testers_are(shown: Shown) -> None:
    """Along a kerb the graph has a time only while a tester is on the road or about to be."""
    record, trace, site = shown
    found = unpacked(episode(record, trace, site)["ttc"])
    shapes_met = trace.shapes()
    counting = [
        any(on_or_entering(site.roads, s, shapes_met[n]) for n, s in frame["testers"].items())
        for frame in trace.frames
    ]
    assert not all(counting)
    assert all(
        value == NOTHING for value, counts in zip(found, counting, strict=True) if not counts
    )
    assert any(value != NOTHING for value in found)


def test_nobody_comes_nearer_to_himself() -> None:
    """Centres at the same place have no line between them."""
    assert time_to_collision(0.0, [1, 1, 1, 0], [1, 1, 0, 0]) == 0.0


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        ("violated", "The ego hit tester1 at 10.5 s, closing at 4.3 m/s."),
        ("held", "reaction-zone was triggered by tester1 at 9.8 s, and it coped"),
        ("unfair", "tester1 left the ego no chance"),
        ("not_triggered", "No test"),
    ],
)
def test_what_happened_is_a_sentence(shown: Shown, outcome: str, words: str) -> None:
    """For every outcome."""
    assert words in verdict({**shown[0].row, "outcome": outcome})


def test_an_assertion_without_contact_is_named(shown: Shown) -> None:
    """Speed limits are broken without hitting anybody."""
    row = {**shown[0].row, "impact_speed_mps": "", "assertion": "speed-limit"}
    assert verdict(row) == "The ego violated speed-limit at 10.5 s."


def test_trigger_and_violation_are_marked(shown: Shown) -> None:
    """At the times of the row; what did not happen is not marked."""
    assert [(m["name"], m["time"]) for m in marks(shown[0].row)] == [
        ("trigger", 9.8),
        ("violation", 10.5),
    ]
    assert marks({**shown[0].row, "trigger_time_s": "", "violation_time_s": ""}) == []


def test_who_leaves_and_comes_back_has_two_ways(shown: Shown) -> None:
    """A body that is out of sight for some timesteps is not drawn there."""
    record, trace, site = shown
    frames = [json.loads(json.dumps(frame)) for frame in trace.frames[:9]]
    for frame in frames[3:5]:
        del frame["background"]["bg_car0"]
    found = episode(record, dataclasses.replace(trace, frames=frames), site)
    ways = [b for b in found["bodies"] if b["id"] == "bg_car0"]
    assert [(b["first"], len(unpacked(b["way"])) // 4) for b in ways] == [(0, 3), (5, 4)]


def test_a_minute_with_sixty_bodies_is_below_a_megabyte(shown: Shown) -> None:
    """Sixty bodies, none of which drives straight on, for 600 timesteps."""
    record, trace, site = shown
    ids = [f"other{i}" for i in range(60)]
    box = {"box": ["passenger", 5.0, 1.8, 3.3], "ids": ids}
    first = trace.frames[0]
    frames = [
        {
            **first,
            "step": k,
            "background": {
                name: [200 + i + k, 100 + 9 * math.sin(i * k / 7), 8 + math.sin(k), k / 9 % 3]
                for i, name in enumerate(ids)
            },
        }
        for k in range(601)
    ]  # fmt: skip
    head = {**trace.head, "bodies": [*trace.head["bodies"], box]}
    assert len(page(record, Trace(head, frames), site).encode()) < 1_000_000


def test_the_page_needs_nothing_else(shown: Shown) -> None:
    """No address but in namespaces; the same episode gives the same bytes."""
    text = page(*shown)
    assert "http" not in text.replace("http-equiv", "")
    assert text == page(*shown)


def test_a_page_that_cannot_be_written_is_refused(shown: Shown, tmp_path: Path) -> None:
    """One sentence with the option's name."""
    with pytest.raises(InputError, match=r"--html .*: Is a directory"):
        write_page(*shown, tmp_path)


def test_a_wheel_has_the_players_files(tmp_path: Path) -> None:
    """What is no Python is packed too."""
    pytest.importorskip("hatchling")
    done = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)],
        cwd=ROOT, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    names = zipfile.ZipFile(next(tmp_path.glob("*.whl"))).namelist()
    names_of = ("shell", "replay/player", "report/report")
    templates = [f"report/pages/{name}.html.j2" for name in names_of]
    for file in [*templates, *(f"{name.split('.')[0]}.css" for name in templates)]:
        assert f"cavsumo/{file}" in names
        assert (ROOT / "cavsumo" / file).is_file()
