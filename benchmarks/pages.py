"""The page of a busy episode: how large it is, and how smoothly Chromium plays it.

    python benchmarks/pages.py [--chromium FILE]

A minute at the junction with tester cars and drawn traffic, some 60 bodies, is recorded, written as
a page, opened in a headless Chromium (without a graphics card) and played from beginning to end.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from statistics import quantiles
from typing import Any

from playwright.sync_api import sync_playwright

from cavsumo.batch.executors import Means
from cavsumo.batch.preflight import Manner
from cavsumo.batch.prepared import prepare
from cavsumo.batch.replay import recorded
from cavsumo.cli.commands.run import run
from cavsumo.report.pages.replay.page import write_page

ROOT = Path(__file__).resolve().parent.parent
SETTINGS: dict[str, Any] = {
    "net": ROOT / "networks" / "junction.net.xml",
    "agents": ["proximity"],
    "kind": "car",
    "signal": "red",
    "traffic": "10,10",
    "runs": 1,
    "trace": "all",
}
OPTIONS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking"]
SCREENS = {
    "laptop": ({"width": 1280, "height": 800}, 1),
    "phone": ({"width": 390, "height": 844}, 3),
}


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        file, page = Path(folder) / "results.csv", Path(folder) / "page.html"
        run(SETTINGS, file, Means(), Manner(quiet=True, exit_zero=True))
        record = recorded(file, 0)
        assert record.trace is not None
        write_page(record, record.trace, prepare(record.plan).site, page)
        bodies, frames = len(record.trace.shapes()), len(record.trace.frames)
        trace = file.parent / record.row["trace"]
        print(f"{bodies} bodies, {frames} timesteps: trace {trace.stat().st_size / 1e6:.2f} MB, "
              f"page {page.stat().st_size / 1e6:.2f} MB")  # fmt: skip
        print(f"{'':8} {'':24} {'median':>9} {'95 %':>9} {'longest':>9}")
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=options.chromium, args=OPTIONS)
            for name, (viewport, ratio) in SCREENS.items():
                context = browser.new_context(viewport=viewport, device_scale_factor=ratio)
                play(context.new_page(), page, name)
            browser.close()


def play(page: Any, file: Path, name: str) -> None:
    """Play the page to its end and print how long the drawings took."""
    page.goto(file.as_uri())
    page.select_option("#speed", "2")
    page.click("#play")
    page.wait_for_selector('#map[data-playing="false"]', timeout=120_000)
    for words, key in (("a drawing", "costs"), ("between two drawings", "intervals")):
        times = sorted(page.evaluate(f"cavsumo.{key}"))
        figures = quantiles(times, n=20)
        print(
            f"{name:8} {words:24}",
            *(f"{ms:6.1f} ms" for ms in (figures[9], figures[18], times[-1])),
        )


if __name__ == "__main__":
    main()
