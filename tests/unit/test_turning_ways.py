"""The ways of turning egos, by an integration of their curvature that shares nothing with them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cavsumo.model.scenario import Scenario
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.model.scenario.suite import SuiteChoice
from cavsumo.suites.cases import SuiteCases
from cavsumo.suites.files import read_suite, suite_file

NAME = "euroncap-2026"
FILE = suite_file(NAME)
# The protocol: radius of the arc [m], angles of each clothoid and of the arc [deg], by the speed of
# the ego [km/h]; the last one turns to the near side.
TURNS = {10: (9, 20.62, 48.76), 15: (11.75, 20.93, 48.14), 20: (14.75, 21.79, 46.42)}
NEAR = (8, 22.85, 44.30)
R1_M, STEPS = 1500.0, 200_000


def turning() -> Iterator[tuple[str, ScriptedTest]]:
    """The scripts of all cases in which the ego turns."""
    choice = SuiteChoice(name=NAME, only=("CPTA", "CBTA", "CCFtap", "CMFtap"), extended=True)
    cases = SuiteCases(read_suite(FILE), choice, FILE.parent, 1)
    for run in range(len(cases)):
        script = cases.scenario(run, Scenario(net=Path("proving-crossing"))).script
        assert script is not None
        yield script.name, script


SCRIPTS = dict(turning())


def integrated(script: ScriptedTest) -> np.ndarray:
    """The turn (x, y, heading), from the end of the straight line on, in even steps."""
    speed = float(script.parameters["ego_kmh"])
    near = "/n" in script.name
    radius, alpha, beta = NEAR if near else TURNS[min(20, int(speed))]
    clothoid = 2 * math.radians(alpha) / (1 / R1_M + 1 / radius)
    arc = math.radians(beta) * radius
    s = np.linspace(0.0, 2 * clothoid + arc, STEPS + 1)
    marks = [0.0, clothoid, clothoid + arc, 2 * clothoid + arc]
    bend = np.interp(s, marks, [1 / R1_M, 1 / radius, 1 / radius, 1 / R1_M])
    bend *= -1.0 if near else 1.0
    step = s[1]
    heading = np.concatenate([[0.0], np.cumsum((bend[1:] + bend[:-1]) / 2) * step])
    middle = (heading[1:] + heading[:-1]) / 2
    begin = script.ego.way.curve.at(script.ego.way.legs[0].length_m)
    x = begin[0] + np.concatenate([[0.0], np.cumsum(np.cos(middle)) * step])
    y = begin[1] + np.concatenate([[0.0], np.cumsum(np.sin(middle)) * step])
    return np.column_stack([s, x, y, heading])


@pytest.mark.parametrize("name", SCRIPTS)
def test_an_ego_turns_by_clothoid_arc_and_clothoid(name: str) -> None:
    """By a right angle, and never farther from the smooth way than 5 cm."""
    way = SCRIPTS[name].ego.way
    turn = integrated(SCRIPTS[name])
    assert abs(turn[-1, 3]) == pytest.approx(math.pi / 2, abs=1e-6)
    straight = way.legs[0].length_m
    for s, x, y, heading in turn[:: STEPS // 50]:
        found = way.curve.at(straight + s)
        assert math.dist(found[:2], (x, y)) < 0.05
        assert math.remainder(found[2] - heading, math.tau) == pytest.approx(0.0, abs=0.03)


@pytest.mark.parametrize("name", [n for n in SCRIPTS if n.startswith(("CPTA", "CBTA"))])
def test_a_turning_ego_meets_the_target_at_the_middle_of_its_front(name: str) -> None:
    """Its reference point, when the box touches the line of the front."""
    script = SCRIPTS[name]
    (begins,), (tester,) = script.commitments, script.testers
    assert begins is not None
    assert None not in (begins.ego_at_m, begins.own_at_m, script.ego.axle_m)
    axle = script.ego.axle(0.0)
    s = float(begins.ego_at_m or 0.0) - axle - script.ego.way.legs[0].length_m
    turn = integrated(script)
    x, y, heading = (float(np.interp(s, turn[:, 0], turn[:, i])) for i in (1, 2, 3))
    x, y = x + axle * math.cos(heading), y + axle * math.sin(heading)
    way, own = tester.way, float(begins.own_at_m or 0.0)
    middle = (
        way.x_m + own * math.cos(way.heading_rad),
        way.y_m + own * math.sin(way.heading_rad),
    )
    front = {"CPTA": 0.36, "CBTA": 0.93}[name[:4]]
    on = tester.length_m / 2 - front
    point = (middle[0] + on * math.cos(way.heading_rad), middle[1] + on * math.sin(way.heading_rad))
    beside = (point[1] - y) * math.cos(heading) - (point[0] - x) * math.sin(heading)
    assert abs(beside) < 0.02
    half = tester.length_m / 2, tester.width_m / 2
    turned = way.heading_rad - heading
    reach = half[0] * abs(math.cos(turned)) + half[1] * abs(math.sin(turned))
    ahead = (middle[0] - x) * math.cos(heading) + (middle[1] - y) * math.sin(heading)
    assert ahead == pytest.approx(reach, abs=0.03)
