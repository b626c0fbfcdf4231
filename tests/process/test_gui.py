"""A trace in sumo-gui: the command, the sentences when it cannot be, and the real window."""

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cavsumo.batch.replay import Record
from cavsumo.cli import main
from cavsumo.errors import Exit, InputError
from cavsumo.interop import gui
from cavsumo.interop.gui import additional_file, check_gui, command, show
from cavsumo.network.drawing.place import site_drawn
from cavsumo.network.osm import netconvert as program
from cavsumo.network.site import Site
from cavsumo.results.traces import Trace


@pytest.fixture
def display(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, netconvert: None) -> Iterator[str]:
    """A screen that nobody sees."""
    server = shutil.which("Xvfb")
    if server is None:
        pytest.skip("no Xvfb here: apt-get install xvfb")
    with (tmp_path / "number").open("w+b") as said:
        number = str(said.fileno())
        process = subprocess.Popen(
            [server, "-displayfd", number, "-nolisten", "tcp"],
            pass_fds=(said.fileno(),), stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            end = time.monotonic() + 20
            while not (name := (tmp_path / "number").read_text().strip()):
                assert process.poll() is None
                assert time.monotonic() < end, "Xvfb does not start"
                time.sleep(0.02)
            monkeypatch.setenv("DISPLAY", f":{name}")
            yield name
        finally:
            process.terminate()
            process.wait(10)


def test_a_trace_is_played_in_the_real_window(
    shown: tuple[Record, Trace, Site], display: str
) -> None:
    """sumo-gui takes every frame of an episode and is closed at its end."""
    record, trace, site = shown
    some = Trace(trace.head, trace.frames[:5] + trace.frames[-2:])
    show(some, record.plan.scenario, site, 0.0, close=True)


def test_sumo_is_given_the_route_that_everybody_draws(
    shown: tuple[Record, Trace, Site], tmp_path: Path
) -> None:
    """As a polygon that SUMO takes, along the ego's path."""
    _, trace, site = shown
    file = tmp_path / "types.add.xml"
    file.write_text(additional_file(trace, site_drawn(site)), encoding="utf-8")
    libsumo = pytest.importorskip("libsumo")
    libsumo.start(["sumo", "-n", str(site.net), "-a", str(file), "--no-step-log"])
    try:
        (route,) = libsumo.polygon.getIDList()
        shape = libsumo.polygon.getShape(route)
    finally:
        libsumo.close()
    ends = site.route.path.points[0], site.route.path.points[-1]
    for (x, y), (at_x, at_y) in zip((shape[0], shape[-1]), ends, strict=True):
        assert (x, y) == pytest.approx((at_x, at_y), abs=0.01)
    assert all(abs(site.route.path.project(x, y).lateral) < 0.05 for x, y in shape)


@pytest.mark.usefixtures("netconvert")
def test_without_a_display_it_says_so(
    monkeypatch: pytest.MonkeyPatch, found_failure: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before anything is played."""
    pytest.importorskip("sumo")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(gui.sys, "platform", "linux")
    assert main(["replay", str(found_failure), "1", "--gui"]) == Exit.USAGE
    assert "there is no display to show it on" in capsys.readouterr().err


def test_without_sumo_gui_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """The extra that brings it."""
    monkeypatch.setattr(program, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'cavsumo\[osm\]'"):
        check_gui()


@pytest.mark.parametrize("delay", [-1.0, float("nan"), 1e6])
def test_a_delay_that_is_none_is_refused(delay: float) -> None:
    """Milliseconds, a minute at most."""
    with pytest.raises(InputError, match=r"--delay must lie in"):
        check_gui(delay)


def test_the_command_has_the_network_and_begins_at_once() -> None:
    """Nothing is simulated but what is told, at the pace that was asked for."""
    words = command(Path("sumo-gui"), Path("a.net.xml"), Path("t.xml"), 0.1, 50.0, close=False)
    options = dict(zip(words[1::2], words[2::2], strict=True))
    assert options["--net-file"] == "a.net.xml"
    assert options["--delay"] == "50"
    assert options["--start"] == "true"
    assert options["--quit-on-end"] == "false"
    assert "--route-files" not in options
