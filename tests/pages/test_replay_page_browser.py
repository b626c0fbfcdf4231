"""The page of an episode in a real headless Chromium, opened as a file."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import PHONE, json_lines

from cavsumo.batch.replay import Record
from cavsumo.model.geometry import Box
from cavsumo.model.stopping_zones import zone_polygons
from cavsumo.network.site import Site
from cavsumo.report.pages.replay.curves import moment
from cavsumo.report.pages.replay.page import page as page_of
from cavsumo.report.pages.replay.page import write_page
from cavsumo.results.traces import Trace, parsed, states

Shown = tuple[Record, Trace, Site]
Opened = Callable[..., Any]


@pytest.fixture(scope="module")
def file(shown: Shown, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the episode."""
    written = tmp_path_factory.mktemp("page") / "run 1.html"
    write_page(*shown, written)
    return written


@pytest.fixture
def opened(open_page: Opened, file: Path) -> Opened:
    """Call with a viewport and such for the page, or for another one."""
    return lambda which=file, **how: open_page(which, **how)


def scrub(page: Any, frame: int) -> None:
    """Move the slider as a hand does."""
    page.locator("#scrub").fill(str(frame))


def pixel(page: Any, x: float, y: float) -> tuple[int, ...]:
    """The colour that the map shows at a place in the world."""
    return tuple(
        page.evaluate(
            """([x, y]) => {
                const map = document.getElementById("map"), [u, v] = cavsumo.screen(x, y);
                const ratio = map.width / map.getBoundingClientRect().width;
                const spot = document.createElement("canvas").getContext("2d");
                spot.drawImage(map, -Math.floor(u * ratio), -Math.floor(v * ratio));
                return Array.from(spot.getImageData(0, 0, 1, 1).data);
            }""",
            [x, y],
        )
    )


def colour(page: Any, name: str) -> tuple[int, ...]:
    """A colour of the style sheet, opaque."""
    code = page.evaluate(
        f"getComputedStyle(document.documentElement).getPropertyValue('--{name}').trim()"
    )
    return (*bytes.fromhex(code.removeprefix("#")), 255)


def test_it_loads_and_plays_to_the_end(opened: Opened, shown: Shown) -> None:
    """From the first frame to the last one, then it stands there and can be played again."""
    page = opened()
    assert page.title() == "Run 1 (timing), crossing"
    assert page.evaluate("[cavsumo.frame, cavsumo.count]") == [0, len(shown[1].frames)]
    page.select_option("#speed", "4")
    page.click("#play")
    assert page.locator("#play").get_attribute("aria-label") == "Pause"
    page.wait_for_selector('#map[data-playing="false"]')
    assert page.evaluate("[cavsumo.frame, cavsumo.playing]") == [len(shown[1].frames) - 1, False]
    assert page.locator("#clock").text_content() == "10.5 / 10.5 s"
    page.click("#play")
    page.wait_for_selector('#map[data-playing="true"]')
    assert page.evaluate("cavsumo.frame") < 100


@pytest.mark.parametrize("frame", [0, 41, 98, 105])
def test_scrubbing_shows_who_was_where(opened: Opened, shown: Shown, frame: int) -> None:
    """Every body within half a millimetre of the trace; lights, zones and curves of that moment."""
    trace = shown[1]
    page = opened()
    scrub(page, frame)
    was = trace.frames[frame]
    found = page.evaluate("cavsumo.bodies")
    assert found.keys() == {name for _, name, _ in states(was)}
    for _, name, (x, y, v, o) in states(was):
        assert found[name][:3] == pytest.approx([x, y, v], abs=6e-4)
        assert math.remainder(found[name][3] - o, math.tau) == pytest.approx(0.0, abs=6e-5)
    assert page.evaluate("cavsumo.lights") == was["lights"]
    shape = trace.shapes()["ego"]
    x, y, v, o = was["ego"]
    zones = zone_polygons(
        Box(x, y, o, shape.length, shape.width), v, max_decel=9.0, reaction_time=0.675,
        wheelbase=shape.wheelbase, steering=was["steering"],
    )  # fmt: skip
    drawn = page.evaluate("cavsumo.zones")
    for name, points in zones._asdict().items():
        assert drawn[name] == pytest.approx([c for point in points for c in point], abs=0.006)
    now = moment(was, trace.shapes(), shown[2].roads)
    curves = page.evaluate("cavsumo.curves")
    assert [curves["speed"], curves["gap"]] == pytest.approx([now.speed, now.gap], abs=6e-4)
    assert (
        math.isnan(curves["ttc"])
        if now.ttc is None
        else now.ttc == pytest.approx(curves["ttc"], abs=6e-4)
    )
    assert page.locator("#scrub").get_attribute("aria-valuetext") == f"{was['time_s']:.1f} seconds"


def test_bodies_are_drawn_where_they_are(opened: Opened, shown: Shown) -> None:
    """The map has the ego's colour in the middle of its box, and the road's beside it."""
    page = opened()
    page.keyboard.press("f")
    for frame in (30, 80):
        scrub(page, frame)
        x, y, _, o = shown[1].frames[frame]["ego"]
        assert pixel(page, x, y) == colour(page, "ego")
        beside = (
            x - 2.0 * math.cos(o) + 1.4 * math.sin(o),
            y - 2.0 * math.sin(o) - 1.4 * math.cos(o),
        )
        assert pixel(page, *beside) != colour(page, "ego")
    assert page.evaluate("cavsumo.view.cx") == pytest.approx(x, abs=1e-3)


def test_it_is_played_from_the_keyboard(opened: Opened) -> None:
    """Space, arrows, shift, Home and End, plus and minus; and the focus is no trap."""
    page = opened()

    def frame() -> int:
        return int(page.evaluate("cavsumo.frame"))

    def press(*keys: str) -> None:
        for key in keys:
            page.keyboard.press(key)

    press("ArrowRight", "ArrowRight", "ArrowLeft", "Shift+ArrowRight")
    assert frame() == 11
    press("End")
    assert frame() == 105
    press("ArrowRight")
    assert frame() == 105
    press("Home", "ArrowLeft")
    assert frame() == 0
    press("ArrowUp", "ArrowUp", "ArrowUp")
    assert page.evaluate("cavsumo.rate") == 4
    press("ArrowDown")
    assert page.locator("#speed").input_value() == "2"
    before = page.evaluate("cavsumo.view.scale")
    press("+", "+", "-")
    assert page.evaluate("cavsumo.view.scale") == pytest.approx(1.25 * before, rel=1e-6)
    press("f")
    assert page.locator("#follow").get_attribute("aria-pressed") == "true"
    press("w", "Space")
    assert page.evaluate("[cavsumo.playing, cavsumo.view.follow]") == [True, False]
    press("Space")
    assert page.evaluate("cavsumo.playing") is False
    page.focus("#play")
    press("Space")  # presses the button, once
    assert page.evaluate("cavsumo.playing") is True


def test_everything_can_be_reached_and_has_a_name(opened: Opened) -> None:
    """With the tabulator one comes by every control, and each says what it is."""
    page = opened()
    met = []
    for _ in range(20):
        page.keyboard.press("Tab")
        met.append(page.evaluate("document.activeElement.id || document.activeElement.textContent"))
    wanted = "map whole follow closer farther scrub start back play forward end speed".split()
    assert met[: len(wanted)] == wanted
    assert {"trigger 9.8 s", "violation 10.5 s"} <= set(met)
    names = page.evaluate(
        "Array.from(document.querySelectorAll('button, canvas, input'), (e) => "
        "e.getAttribute('aria-label') || e.textContent.trim())"
    )
    assert all(names)


def test_marks_and_graphs_lead_to_their_times(opened: Opened) -> None:
    """The buttons of trigger and violation, and a click in the middle of a graph."""
    page = opened()
    page.get_by_role("button", name="trigger 9.8 s").click()
    assert page.evaluate("cavsumo.frame") == 98
    box = page.locator("#gap-graph").bounding_box()
    page.mouse.click(box["x"] + (30 + box["width"] - 8) / 2, box["y"] + 40)
    assert page.evaluate("cavsumo.frame") in (52, 53)
    page.get_by_role("button", name="violation").click()
    assert page.locator("#gap-now").text_content() == "0.0 m"


def test_it_fits_a_phone(opened: Opened) -> None:
    """Nothing is wider than the screen, what is touched is large enough; a finger seeks."""
    page = opened(viewport=PHONE, device_scale_factor=3, is_mobile=True, has_touch=True)
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    sizes = page.evaluate(
        "Array.from(document.querySelectorAll('button'), (b) => b.getBoundingClientRect().height)"
    )
    assert min(sizes) >= 40
    assert page.evaluate("cavsumo.view.follow") is True
    graph = page.locator("#speed-graph")
    graph.scroll_into_view_if_needed()
    box = graph.bounding_box()
    page.touchscreen.tap(box["x"] + box["width"] - 9, box["y"] + 40)
    assert page.evaluate("cavsumo.frame") >= 104


def test_it_is_dark_in_the_dark(opened: Opened, shown: Shown) -> None:
    """The colours follow the system's scheme, on the map too, also when it changes."""
    page = opened(color_scheme="dark")
    x, y, _, _ = shown[1].frames[0]["ego"]
    off_road = x, y - 15.0
    dark = pixel(page, *off_road)
    assert dark == colour(page, "ground")
    page.emulate_media(color_scheme="light")
    page.wait_for_selector('html[data-scheme="light"]')
    light = pixel(page, *off_road)
    assert sum(light[:3]) > 3 * sum(dark[:3])
    assert light == colour(page, "ground")


def test_names_are_only_text(opened: Opened, shown: Shown, tmp_path: Path) -> None:
    """Names from maps, files and users that would be markup are shown as they are."""
    record, trace, site = shown
    nasty = "</script><img src=x onerror=alert(1)>{{ 7*7 }}'\"`"
    text = json_lines(trace.head, *trace.frames)
    for name in ("tester1", "bg_car0", "bg_person0"):
        text = text.replace(f'"{name}"', json.dumps(f"{name}{nasty}"))
    head = dict(parsed(text).head)
    head["versions"] = {nasty: nasty}
    row = dict(record.row)
    row |= {column: row[column] + nasty for column in ("agent", "assertion", "tester")}
    scenario = record.plan.scenario.model_copy(
        update={
            "net": Path(f"{nasty.replace('/', '')}.net.xml"),
            "junction": nasty,
            "assertions": (nasty, "reaction-zone"),
        }
    )
    plan = record.plan.model_copy(update={"scenario": scenario, "params": {nasty: nasty}})
    changed = dataclasses.replace(record, row=row, plan=plan, file=Path(f"{nasty}.csv"))
    file = tmp_path / "nasty.html"
    file.write_text(page_of(changed, Trace(head, parsed(text).frames), site), encoding="utf-8")
    page = opened(file)
    page.keyboard.press("End")
    assert page.locator("img").count() == 0
    assert nasty in page.locator("h1").text_content()
    assert page.locator("dd", has_text=nasty).count() >= 5
    assert f"bg_car0{nasty}" in page.evaluate("cavsumo.bodies")
