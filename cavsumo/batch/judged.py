"""Recorded tracks judged once more, without simulating: the verdict that they give."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from cavsumo.agents.casting import tester_bodies
from cavsumo.agents.recorded import start_of
from cavsumo.assertions.base import weightiest
from cavsumo.assertions.contacts import ContactMonitor
from cavsumo.assertions.judgement import INVALID, VIOLATED, Judgement
from cavsumo.assertions.specs import assertions_of
from cavsumo.assertions.validity import ValidityMonitor
from cavsumo.errors import ResultsError
from cavsumo.model.bodies import Body, Kind
from cavsumo.model.scenario import BatchPlan, Scenario
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.recorded_starts import recorded_start
from cavsumo.network.site import Site
from cavsumo.results.traces import Trace


class Judged(NamedTuple):
    """The verdict that tracks give.

    Attributes:
        judgement: of the assertion that weighs most.
        outcome: as in the column of results.
        verdicts: of each assertion.
    """

    judgement: Judgement
    outcome: str
    verdicts: Mapping[str, str]


def judged(plan: BatchPlan, trace: Trace, site: Site) -> Judged:
    """The verdict of a plan's assertions over the tracks of a trace.

    Only the part of the scene that is in files is known: an assertion that needs more, such as the
    signals for pedestrians, says that of its own. Raises ResultsError for tracks of other bodies.
    """
    scenario = plan.scenario
    snapshots = list(_snapshots(scenario, trace))
    scene, assertions = _scene(scenario, trace, site, snapshots[0]), assertions_of(scenario)
    contacts, validity = ContactMonitor(), ValidityMonitor(scene)
    for assertion in assertions:
        assertion.reset(scene)
    for snapshot in snapshots:
        touching = contacts.observe(snapshot)
        if VIOLATED not in [assertion.judgement.verdict for assertion in assertions]:
            validity.observe(snapshot, contacts.pairs)
        for assertion in assertions:
            assertion.observe(snapshot, touching)
    for assertion in assertions:
        assertion.conclude()
    said = weightiest(assertions)
    outcome = INVALID if validity.spoils(said) else said.verdict
    return Judged(said, outcome, {one.name: one.judgement.verdict for one in assertions})


def _scene(scenario: Scenario, trace: Trace, site: Site, first: Snapshot) -> Scene:
    """The constant part of the episode."""
    starts = [recorded_start(site, start_of(plain)) for plain in trace.head.get("starts", ())]
    bodies = tester_bodies(scenario)
    return site.scene(scenario.step_length, first.ego.body, bodies, starts, int(trace.row["seed"]))


def _snapshots(scenario: Scenario, trace: Trace) -> Iterator[Snapshot]:
    """The states of all bodies, frame by frame."""
    bodies = {body.id: body for body in tester_bodies(scenario)}
    bodies |= {
        name: Body(name, _kind(*shape))
        for name, shape in trace.shapes().items()
        if name not in bodies
    }
    for frame in trace.frames:
        if not frame["testers"].keys() == {body.id for body in tester_bodies(scenario)}:
            raise ResultsError(f"testers {', '.join(frame['testers'])} at {frame['time_s']:g} s")
        states = {
            part: tuple(BodyState(bodies[name], *state) for name, state in frame[part].items())
            for part in ("testers", "background")
        }
        ego = BodyState(bodies["ego"], *frame["ego"])
        raw: Any = tuple(tuple(state) for state in states["background"])
        lights = tuple(frame.get("lights", ""))
        yield Snapshot(
            frame["step"], frame["time_s"], ego, frame["steering"], states["testers"], raw, lights
        )


def _kind(name: str, length: float, width: float, wheelbase: float) -> Kind:
    """A body that is only looked at: its box."""
    return Kind(name, length, width, wheelbase, 0.0, 55.0, -9.0, 9.0, 0.6)
