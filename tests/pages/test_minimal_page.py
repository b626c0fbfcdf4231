"""The page of a test that was made smaller, in a real Chromium: two players side by side."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from support import PHONE

from cavsumo.batch.replay import Record
from cavsumo.kept.candidate import as_recorded
from cavsumo.kept.minimising import Minimised
from cavsumo.network.site import Site
from cavsumo.report.pages.minimal.page import write_minimal_page
from cavsumo.results.traces import Trace


def test_both_episodes_play(
    shown: tuple[Record, Trace, Site], open_page: Callable[..., Any], tmp_path: Path
) -> None:
    """Side by side, one below the other on a phone; each with its own controls."""
    record, trace, site = shown
    episode = as_recorded(trace.recording())
    found = Minimised(record, record, episode, episode, 3, True, site)
    write_minimal_page(found, tmp_path / "a.html")
    page = open_page(tmp_path / "a.html")
    assert page.locator(".sentence").inner_text().startswith("On crossing")
    boxes = [frame.bounding_box() for frame in page.locator("iframe").all()]
    assert boxes[0]["y"] == boxes[1]["y"]
    for frame in page.frames[1:]:
        frame.locator("#forward").click()
        assert frame.locator("#scrub").input_value() == "1"
    phone = open_page(tmp_path / "a.html", PHONE)
    boxes = [frame.bounding_box() for frame in phone.locator("iframe").all()]
    assert boxes[0]["x"] == boxes[1]["x"]
