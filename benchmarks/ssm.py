"""Compare the criticality metrics with SUMO's SSM device on pairs of vehicles.

    python benchmarks/ssm.py

The ego follows a vehicle that slows down, on a straight road; then ways cross at a junction, both
vehicles at 8 m/s, so that the other comes to the place some seconds before the ego or after it.
All are SUMO's. The device measures along lanes, cavsumo (``criticality_monitor``) boxes on the
plane.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

import libsumo

from cavsumo.assertions.contacts import ContactMonitor
from cavsumo.assertions.criticality_monitor import CriticalityMonitor
from cavsumo.batch.prepared import prepare
from cavsumo.model.bodies import CAR, Body
from cavsumo.model.carriageway import Approach
from cavsumo.model.scenario import plan_from
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.site import Site
from cavsumo.sumo.poses import from_sumo

NETWORKS = Path(__file__).parents[1] / "networks"
STRAIGHT, JUNCTION = NETWORKS / "pedestrians.net.xml", NETWORKS / "junction.net.xml"
DT, SPEED = 0.1, 8.0
MEASURES = ("minTTC", "maxDRAC", "PET")
TYPE = (
    '<vType id="car" length="4.5" width="1.75" sigma="0" minGap="0.5" tau="0.5" decel="9" '
    'emergencyDecel="9" speedDev="0"/>'
)
Found = tuple[CriticalityMonitor, Mapping[str, str]]


def state(name: str) -> BodyState:
    """A vehicle as SUMO has it."""
    x, y = libsumo.vehicle.getPosition(name)
    pose = from_sumo(x, y, libsumo.vehicle.getAngle(name), CAR.length)
    return BodyState(Body(name, CAR), pose[0], pose[1], libsumo.vehicle.getSpeed(name), pose[2])


def vehicle(name: str, edges: str, depart: float, place: str, device: Path | None = None) -> str:
    """A vehicle of a route file, with an SSM device that writes there."""
    params = {} if device is None else {
        "has.ssm.device": "true",
        "device.ssm.measures": "TTC DRAC PET",
        "device.ssm.thresholds": "10 0 10",
        "device.ssm.range": "100",
        "device.ssm.file": str(device),
    }  # fmt: skip
    inside = "".join(f'<param key="{key}" value="{value}"/>' for key, value in params.items())
    return (
        f'<vehicle id="{name}" type="car" depart="{depart:.1f}" departPos="{place}" '
        f'departSpeed="{SPEED}"><route edges="{edges}"/>{inside}</vehicle>'
    )


def play(net: Path, folder: Path, vehicles: str, act: Callable[[int], None]) -> Found:
    """What both measured of the ego and the other; ``act`` is called in each timestep."""
    routes = folder / "cars.rou.xml"
    routes.write_text(f"<routes>{TYPE}{vehicles}</routes>", encoding="utf-8")
    words = ["sumo", "-n", str(net), "-r", str(routes), "--step-length", str(DT), "--no-step-log"]
    words += ["--no-warnings", "--collision.action", "warn", "--collision.check-junctions"]
    libsumo.start(words)
    criticality, monitor = CriticalityMonitor(), ContactMonitor()
    for step in range(400):
        libsumo.simulationStep()
        act(step)
        if {"ego", "other"} <= set(libsumo.vehicle.getIDList()):
            seen = Snapshot(step, step * DT, state("ego"), 0.0, (state("other"),))
            criticality.observe(seen, monitor.observe(seen))
    libsumo.close()
    conflict = ElementTree.parse(folder / "ssm.xml").getroot().find("conflict")
    assert conflict is not None
    return criticality, {e.tag: e.get("value", "") for e in conflict if e.tag in MEASURES}


def follow(folder: Path, gap: float) -> Found:
    """Ego behind a vehicle that slows down to a walk within 1.5 s."""
    edge = ElementTree.parse(STRAIGHT).getroot().find("edge[@from]")
    assert edge is not None
    there, brakes = str(edge.get("id")), 1.5
    vehicles = vehicle("other", there, 0.0, f"{10.0 + gap + CAR.length}")
    vehicles += vehicle("ego", there, 0.0, "10", folder / "ssm.xml")

    def act(step: int) -> None:
        if step == 10:
            libsumo.vehicle.setSpeedMode("ego", 0)
            libsumo.vehicle.setSpeed("ego", SPEED)
            libsumo.vehicle.slowDown("other", 1.4, brakes)
        if step == 10 + round(brakes / DT):
            libsumo.vehicle.setSpeed("ego", 1.0)

    return play(STRAIGHT, folder, vehicles, act)


def cross(folder: Path, site: Site, way: Approach, ahead: float) -> Found:
    """Another vehicle begins to be in the ego's way so long before the ego is there [s]."""
    mine, theirs = way.ego_enter / SPEED, (way.enter - CAR.length / 2) / SPEED
    wait = theirs - mine + ahead  # how long the ego departs after the other
    ego = vehicle(
        "ego", " ".join(site.route.edges), max(0.0, wait), str(site.route.depart_m),
        folder / "ssm.xml",
    )  # fmt: skip
    other = vehicle("other", " ".join(way.edges), max(0.0, -wait), "base")

    def act(step: int) -> None:
        for name in libsumo.vehicle.getIDList():
            libsumo.vehicle.setSpeedMode(name, 0)  # for nobody and no light
            libsumo.vehicle.setSpeed(name, SPEED)

    return play(JUNCTION, folder, other + ego if wait > 0.0 else ego + other, act)


def line(label: str, found: Found) -> None:
    """The extremes of both, theirs behind ours."""
    criticality, device = found
    ours = (f"{x:.3f}" if math.isfinite(x) else "none" for x in criticality.extremes())
    cells = [f"{a:>7} {device[name]:>7}" for a, name in zip(ours, MEASURES, strict=True)]
    print(f"{label:30}", *cells, sep="  ")


def main() -> None:
    """A table of the extremes of both."""
    print(f"{'':30}   TTC ours, SSM   DRAC ours, SSM   PET ours, SSM")
    site = prepare(plan_from({"net": JUNCTION, "kind": "car"}, "benchmark")).site
    ways = [way for way in site.approaches if way.type == "crossing"]
    with TemporaryDirectory() as name:
        for gap in (20.0, 15.0, 12.0):
            line(f"following, gap {gap:g} m", follow(Path(name), gap))
        for way in (ways[0], ways[3]):
            turn = way.path.at(way.enter)[2] - site.route.path.at(way.ego_enter)[2]
            degrees = abs(math.degrees(math.remainder(turn, math.tau)))
            for ahead in (3.0, 2.0, 1.0, -1.0, -2.0):
                label = f"crossing at {degrees:.0f} deg, {ahead:+g} s"
                line(label, cross(Path(name), site, way, ahead))


if __name__ == "__main__":
    main()
