"""The page of a report in a real headless Chromium, opened as a file with its replays beside it."""

from __future__ import annotations

import csv
import io
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import LAPTOP, PHONE

from cavsumo.report.analysis import analyse
from cavsumo.report.pages.report.document import write_report
from cavsumo.results.reading import HEADER

Opened = Callable[..., Any]
SHOWN = """() => Array.from(document.querySelectorAll(".map > svg circle"))
    .filter((dot) => dot.getClientRects().length).length"""
CONTRASTS = """() => {
    const light = (c) => c.match(/[0-9.]+/g).slice(0, 3).reduce((a, b) => a + +b, 0);
    const section = document.querySelector("main > section");
    const panel = light(getComputedStyle(section).backgroundColor);
    return Array.from(document.querySelectorAll(".plot svg text, p, td, th, h2"), (e) =>
        Math.abs(light(getComputedStyle(e)[e.matches("text") ? "fill" : "color"]) - panel));
}"""
SCROLLED = """() => Array.from(document.querySelectorAll(".wide"))
    .filter((e) => e.scrollWidth > e.clientWidth).length"""
HINT = """(e) => getComputedStyle(e.querySelector("caption"), "::after").content"""
FILLED = """() => Array.from(document.querySelectorAll(".tables"), (all) => {
    const section = all.closest("section").getBoundingClientRect();
    const right = Math.max(...Array.from(all.querySelectorAll("table"),
        (table) => table.getBoundingClientRect().right));
    return (right - section.left) / section.width;
})"""
SMALLEST = """() => Math.min(...Array.from(document.querySelectorAll(".plot svg text"),
    (text) => text.getBoundingClientRect().height))"""
NASTY = "</script><img src=x onerror=alert(1)>{{ 7*7 }}$x$'\"`"


@pytest.fixture(scope="module")
def file(found_failure: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a batch at the crossing."""
    html = tmp_path_factory.mktemp("page") / "my report.html"
    write_report(analyse([found_failure]), html, 20)
    return html


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_can_be_read_in_both_schemes(open_page: Opened, file: Path, scheme: str) -> None:
    """Text stands out from what is behind it, in the plots too, whose text is text."""
    page = open_page(file, color_scheme=scheme)
    assert page.title() == "Report: crossing"
    assert page.locator(".answer p").first.text_content().startswith("proximity found ")
    assert page.locator(".plot svg text", has_text="timing").count() >= 3
    found = page.evaluate(CONTRASTS)
    assert len(found) > 50
    assert min(found) > 250


def test_a_replay_opens_and_plays(open_page: Opened, file: Path) -> None:
    """Every link leads to a page that is there; the first failure is played."""
    page = open_page(file)
    links = page.locator("#replays a")
    for link in links.all():
        target = page.evaluate("(e) => e.href", link.element_handle())
        assert Path(target.removeprefix("file://").replace("%20", " ")).is_file()
    links.first.click()
    page.wait_for_selector("#map")
    assert "violated" in page.locator("h1").text_content()
    page.select_option("#speed", "4")
    page.keyboard.press("Space")
    page.wait_for_selector('#map[data-playing="false"]')
    assert page.evaluate("cavsumo.frame") == page.evaluate("cavsumo.count") - 1
    page.go_back()
    assert page.title() == "Report: crossing"


def test_the_map_is_toggled_by_keyboard(open_page: Opened, file: Path) -> None:
    """Space takes an agent's dots, or a sort of dots, away and brings them back."""
    page = open_page(file)
    boxes = page.locator(".toggles input")
    everything = page.evaluate(SHOWN)
    assert everything >= 4
    assert boxes.count() == 5  # two agents, three sorts
    boxes.nth(1).focus()
    page.keyboard.press("Space")
    without = page.evaluate(SHOWN)
    assert 0 < without < everything
    page.keyboard.press("Space")
    assert page.evaluate(SHOWN) == everything
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.dataset.shows") == "passed"
    page.keyboard.press("Space")
    assert page.evaluate(SHOWN) < everything
    assert page.locator(".map > svg circle.passed:visible").count() == 0


def test_dots_lead_to_their_replays(open_page: Opened, file: Path) -> None:
    """A failure on the map says which run it is; a click plays it."""
    page = open_page(file)
    dot = page.locator(".map > svg a .impact").first
    assert "where the ego failed it" in dot.locator("title").text_content()
    dot.click(force=True)
    page.wait_for_selector("#scrub")


def test_the_keyboard_comes_by_every_link(open_page: Opened, file: Path) -> None:
    """The sections come first and lead to where they say; wide tables can be scrolled by keys."""
    page = open_page(file)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.hash") == "#rates"
    targets = page.evaluate(
        "Array.from(document.querySelectorAll('nav a'), (a) => !!document.querySelector(a.hash))"
    )
    assert all(targets)
    assert len(targets) == 8
    assert page.locator(".wide:not([tabindex='0'])").count() == 0


def test_it_fits_a_phone(open_page: Opened, file: Path) -> None:
    """The page is as wide as the screen; tables scroll in their own boxes, and say so."""
    page = open_page(file, PHONE, device_scale_factor=3, is_mobile=True, has_touch=True)
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    assert page.evaluate(SCROLLED) >= 1
    assert page.evaluate(SMALLEST) >= 10
    assert page.locator(".wide.cut").count() == page.evaluate(SCROLLED)
    box = page.locator(".wide.cut").first
    assert "scroll sideways" in box.evaluate(HINT)
    column = box.locator("td").first
    before = column.bounding_box()["x"]
    box.evaluate("(e) => { e.scrollLeft = e.scrollWidth; }")
    page.wait_for_selector(".wide.cut.end")
    assert column.bounding_box()["x"] == before
    assert box.locator("caption").bounding_box()["x"] == before


def test_it_uses_the_width_of_a_laptop(open_page: Opened, file: Path) -> None:
    """Every table is whole, and the tables of each section reach its right edge."""
    page = open_page(file, LAPTOP)
    assert page.evaluate(SCROLLED) == 0
    assert page.locator(".wide.cut").count() == 0
    filled = page.evaluate(FILLED)
    assert len(filled) >= 6
    assert min(filled) > 0.9


def test_names_are_only_text(open_page: Opened, found_failure: Path, tmp_path: Path) -> None:
    """Agents, testers, versions, commands and messages that would be markup stay words."""
    file = tmp_path / "nasty.csv"
    rows = list(csv.DictReader(io.StringIO(found_failure.read_text(encoding="utf-8"))))
    text = io.StringIO()
    writer = csv.DictWriter(text, HEADER.strip().split(","), lineterminator="\n")
    writer.writeheader()
    for row in rows:
        failed = row["outcome"] == "not_triggered"
        row |= {"agent": row["agent"] + NASTY, "trace": ""}
        row |= {"tester": row["tester"] + NASTY} if row["tester"] else {}
        writer.writerow(row | ({"outcome": "error", "error": NASTY} if failed else {}))
    file.write_text(text.getvalue(), encoding="utf-8")
    manifest = json.loads(found_failure.with_suffix(".json").read_text(encoding="utf-8"))
    manifest |= {"versions": {NASTY: NASTY}, "command": ["cavsumo", NASTY], "junction": NASTY}
    manifest["plan"]["scenario"]["net"] = f"{NASTY}.net.xml"
    file.with_suffix(".json").write_text(json.dumps(manifest), encoding="utf-8")
    html = tmp_path / "nasty.html"
    write_report(analyse([file]), html, 20)
    page = open_page(html)
    assert page.locator("img").count() == 0
    assert NASTY in page.locator(".answer").text_content()
    assert page.locator("td", has_text=NASTY).count() >= 5
    assert page.locator("dd", has_text=NASTY).count() >= 3
    assert page.locator(".plot svg text", has_text="timing</sc").count() >= 1


def test_two_networks_have_a_map_each(
    open_page: Opened, found_failure: Path, networks: dict[str, Path], tmp_path: Path
) -> None:
    """Each with toggles of its own, which leave the other alone."""
    from cavsumo.cli import main

    other = tmp_path / "other.csv"
    words = ["run", "-n", str(networks["pedestrians"]), "-r", "none", "-o", str(other), "-q"]
    assert main([*words, "--agent", "timing", "--runs", "6", "--exit-zero"]) == 0
    html = tmp_path / "two.html"
    write_report(analyse([found_failure, other]), html, 2)
    page = open_page(html, LAPTOP)
    maps = page.locator(".map")
    assert maps.count() == 2
    before = maps.nth(1).locator("svg circle:visible").count()
    for box in maps.nth(0).locator("input").all():
        box.uncheck()
    assert maps.nth(0).locator("svg > g > *:visible").count() == 0
    assert maps.nth(1).locator("svg circle:visible").count() == before
    assert {name.name.partition("-")[0] for name in html.parent.glob("two_replays/*")} <= {
        "batch1",
        "batch2",
    }
    shutil.rmtree(tmp_path / "two_replays")
