"""A trace shown in sumo-gui: every body is placed as recorded, timestep by timestep.

This file does not simulate: sumo-gui has the network, receives the ego's route as a polygon, and
all positions by TraCI. It runs in a separate process and comes with the extra ``[osm]``
(eclipse-sumo and traci).
"""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.sax.saxutils import quoteattr

from cavsumo.errors import InputError
from cavsumo.model.scenario import Scenario
from cavsumo.network.drawing.place import COLOURS, DrawnPlace, site_drawn
from cavsumo.network.osm.items import EXTRA
from cavsumo.network.osm.netconvert import sumo_environment, sumo_home
from cavsumo.network.site import Site
from cavsumo.results.traces import Shape, Trace, states
from cavsumo.sumo.poses import to_sumo

COLORS = {"ego": "31,95,191", "tester": "217,72,15", "background": "120,128,136"}
SHAPES = {"passenger": "passenger", "car": "passenger"}  # SUMO's names of the shapes
VIEW = "View #0"
ZOOM = 1500.0  # per cent; some 80 m across the window
KEEP_EXACT = 2  # moveToXY: exactly there, on the network or off it
DELAY_MOST = 60_000.0  # ms
CONNECT_S = 60  # longest time for sumo-gui to start
ROUTE_WIDTH, ROUTE_LAYER = 0.3, 10  # m; above the lanes, below the bodies
WAY = "cavsumo_way"  # a route for every vehicle, which none follows


def check_gui(delay_ms: float | None = None) -> Path:
    """sumo-gui's file; raises InputError in one sentence when it cannot be shown."""
    if delay_ms is not None and not 0.0 <= delay_ms <= DELAY_MOST:
        raise InputError(f"--delay must lie in [0, {DELAY_MOST:g}] ms, got {delay_ms:g}")
    try:
        program = sumo_home() / "bin" / "sumo-gui"
    except InputError as error:
        raise InputError(f"--gui needs sumo-gui: {EXTRA}") from error
    if not program.is_file():
        raise InputError(f"--gui: no sumo-gui at {str(program)!r}")
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.getenv("WAYLAND_DISPLAY")):
        raise InputError("--gui: there is no display to show it on (DISPLAY is not set)")
    return program


def show(
    trace: Trace,
    scenario: Scenario,
    site: Site,
    delay_ms: float | None = None,
    *,
    close: bool = False,
) -> None:
    """Play a trace in sumo-gui, until its window is closed.

    Args:
        delay_ms: real time that a timestep takes; None for as long as it lasts.
        close: close the window at the end.
    """
    import sumolib
    import traci

    program = check_gui()
    delay = 1000.0 * scenario.step_length if delay_ms is None else delay_ms
    with TemporaryDirectory(prefix="cavsumo-gui-") as folder:
        types = Path(folder) / "types.add.xml"
        types.write_text(additional_file(trace, site_drawn(site)), encoding="utf-8")
        port = sumolib.miscutils.getFreeSocketPort()
        words = command(program, site.net, types, scenario.step_length, delay, close=close)
        words += ["--remote-port", str(port)]
        process = subprocess.Popen(
            words, env=sumo_environment(sumo_home()), stdin=subprocess.DEVNULL, stdout=sys.stderr
        )
        try:
            with contextlib.redirect_stdout(io.StringIO()):  # it prints every attempt
                sumo = traci.connect(port, CONNECT_S, proc=process, waitBetweenRetries=1)
        except (traci.TraCIException, traci.FatalTraCIError) as error:
            process.kill()
            process.wait()
            raise InputError(f"--gui: sumo-gui cannot be started: {error}") from error
        with contextlib.suppress(traci.FatalTraCIError):  # its window was closed before the end
            _play(sumo, trace, site)
            sumo.close()  # waits until the window is closed
        process.wait()


def command(
    program: Path, net: Path, types: Path, step_length: float, delay_ms: float, *, close: bool
) -> list[str]:
    """The command line of sumo-gui."""
    options = {
        "net-file": str(net),
        "additional-files": str(types),
        "step-length": f"{step_length:g}",
        "delay": f"{delay_ms:g}",
        "start": "true",
        "quit-on-end": str(close).lower(),
        "collision.action": "none",
        "time-to-teleport": "-1",
        "no-step-log": "true",
        "no-warnings": "true",
    }
    return [str(program), *(word for key, text in options.items() for word in (f"--{key}", text))]


def additional_file(trace: Trace, place: DrawnPlace) -> str:
    """A vehicle type for each box and part, and the ego's route."""
    rows = [
        f"  <vType id={quoteattr(_type(part, shape))} length={quoteattr(f'{shape.length}')} "
        f'width={quoteattr(f"{shape.width}")} minGap="0" color={quoteattr(COLORS[part])} '
        f"guiShape={quoteattr(SHAPES.get(shape.kind, shape.kind))}/>"
        for part in COLORS
        for shape in sorted(set(trace.shapes().values()))
    ]
    return "\n".join(["<additional>", *rows, *_routes(place), "</additional>", ""])


def _routes(place: DrawnPlace) -> list[str]:
    """The ego's routes as polygons of sumo-gui, which draws the rest of the place itself."""
    colour = ",".join(str(part) for part in bytes.fromhex(COLOURS["route"].removeprefix("#")))
    return [
        f'  <poly id="ego_route{i}" type="ego route" color="{colour}" fill="0" '
        f'lineWidth="{ROUTE_WIDTH}" layer="{ROUTE_LAYER}" '
        f'shape="{" ".join(f"{x:.2f},{y:.2f}" for x, y in line.coords)}"/>'
        for i, line in enumerate(place.lines["route"])
    ]


def _type(part: str, shape: Shape) -> str:
    """The id of a vehicle type."""
    return f"{part}_{shape.kind}_{shape.length:g}_{shape.width:g}"


def _play(sumo: Any, trace: Trace, site: Site) -> None:
    """Place all bodies, frame by frame."""
    sumo.route.add(WAY, [site.route.edges[0]])
    shapes, shown = trace.shapes(), set[str]()
    for frame in trace.frames:
        here = {name: (part, state) for part, name, state in states(frame)}
        for name in shown - here.keys():
            sumo.vehicle.remove(name)
        for name in here.keys() - shown:
            sumo.vehicle.add(name, WAY, typeID=_type(here[name][0], shapes[name]))
            sumo.vehicle.setSpeedMode(name, 0)
        for name, (_, (x, y, v, o)) in here.items():
            front_x, front_y, angle = to_sumo(x, y, o, shapes[name].length)
            sumo.vehicle.moveToXY(name, "", -1, front_x, front_y, angle, KEEP_EXACT)
            sumo.vehicle.setSpeed(name, v)
        _set_lights(sumo, frame, site)
        sumo.simulationStep()
        if not shown:
            sumo.gui.setSchema(VIEW, "real world")  # bodies as large as they are
            sumo.gui.setZoom(VIEW, ZOOM)
            sumo.gui.trackVehicle(VIEW, "ego")
        shown = set(here)


def _set_lights(sumo: Any, frame: Mapping[str, Any], site: Site) -> None:
    """Set the lights on the ego's route to their recorded states."""
    for light, letter in zip(site.lights, frame.get("lights", ""), strict=False):
        sumo.trafficlight.setLinkState(light.id, light.link, letter)
