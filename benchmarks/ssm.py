"""Compare the criticality metrics with SUMO's SSM device on pairs of vehicles.

    python benchmarks/ssm.py

The ego follows a vehicle that slows down, on a straight road; both are SUMO's. The device measures
along lanes, cavsumo boxes on the plane (``criticality``).
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

import libsumo

from cavsumo.bodies import CAR, Body
from cavsumo.criticality import Course
from cavsumo.snapshot import BodyState, Snapshot
from cavsumo.sumo_poses import from_sumo

NET = Path(__file__).parents[1] / "networks" / "pedestrians.net.xml"
DT = 0.1
TYPE = (
    '<vType id="car" length="4.5" width="1.75" sigma="0" minGap="0.5" tau="0.5" decel="9" '
    'emergencyDecel="9" speedDev="0"/>'
)


def state(name: str) -> BodyState:
    """A vehicle as SUMO has it."""
    x, y = libsumo.vehicle.getPosition(name)
    pose = from_sumo(x, y, libsumo.vehicle.getAngle(name), CAR.length)
    return BodyState(Body(name, CAR), pose[0], pose[1], libsumo.vehicle.getSpeed(name), pose[2])


def drive(folder: Path, lead: float, ego: float, brakes: float) -> tuple[Course, Path]:
    """Ego behind a vehicle that slows down to a walk; what both measured."""
    edge = ElementTree.parse(NET).getroot().find("edge[@from]")
    assert edge is not None
    output, routes = folder / "ssm.xml", folder / "cars.rou.xml"
    routes.write_text(
        f'<routes>{TYPE}<route id="r" edges="{edge.get("id")}"/>'
        f'<vehicle id="lead" type="car" route="r" depart="0" departPos="{lead}" departSpeed="8"/>'
        f'<vehicle id="ego" type="car" route="r" depart="0" departPos="{ego}" departSpeed="8">'
        '<param key="has.ssm.device" value="true"/>'
        '<param key="device.ssm.measures" value="TTC DRAC"/>'
        '<param key="device.ssm.thresholds" value="10 0"/>'
        '<param key="device.ssm.trajectories" value="true"/>'
        f'<param key="device.ssm.file" value="{output}"/></vehicle></routes>',
        encoding="utf-8",
    )
    words = ["sumo", "-n", str(NET), "-r", str(routes), "--step-length", str(DT)]
    libsumo.start([*words, "--no-step-log", "--no-warnings"])
    course = Course()
    for step in range(200):
        libsumo.simulationStep()
        here = libsumo.vehicle.getIDList()
        if {"ego", "lead"} <= set(here):
            if step == 10:
                libsumo.vehicle.setSpeedMode("ego", 0)
                libsumo.vehicle.setSpeed("ego", 8.0)
            if step == 10:
                libsumo.vehicle.slowDown("lead", 1.4, brakes)
            if step == 10 + round(brakes / DT):
                libsumo.vehicle.setSpeed("ego", 1.0)
            seen = Snapshot(step, step * DT, state("ego"), 0.0, (state("lead"),))
            course.observe(seen, ())
    libsumo.close()
    return course, output


def main() -> None:
    """A table of the extremes of both."""
    print("gap [m]  TTC ours, SSM [s]   DRAC ours, SSM [m/s2]")
    with TemporaryDirectory() as name:
        for gap in (20.0, 15.0, 12.0):
            course, output = drive(Path(name), 10.0 + gap + CAR.length, 10.0, 1.5)
            found = course.extremes()
            conflict = ElementTree.parse(output).getroot().find("conflict")
            assert conflict is not None
            ttc, drac = conflict.find("minTTC"), conflict.find("maxDRAC")
            assert ttc is not None
            assert drac is not None
            said = ttc.get("value"), drac.get("value")
            print(f"{gap:7.1f}  {found.ttc:8.3f} {said[0]:>8}   {found.drac:9.3f} {said[1]:>8}")


if __name__ == "__main__":
    main()
