"""The beginning of an episode: testers are placed; agents, ego and assertions reset."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from cavsumo.agents.base import Agent
from cavsumo.assertions.base import Assertion
from cavsumo.egos.base import Ego
from cavsumo.model.carriageway import Start
from cavsumo.model.departures import Demand
from cavsumo.model.scenario import Scenario
from cavsumo.model.scenario.sensor import Sensor
from cavsumo.model.scene import Scene
from cavsumo.model.seeds import starts_generator
from cavsumo.model.sensors import Senses, scripted_errors
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.simulation.placing import Placed, placed
from cavsumo.simulation.setup import Setup


def started(
    setup: Setup,
    agents: Sequence[Agent],
    seed: int,
    record: bool,
    demand: Demand | None,
) -> tuple[Scene, Senses | None, Placed, list[np.random.Generator]]:
    """Place the testers and begin an episode; one generator for each who draws."""
    generators = generators_of(setup, seed)
    scenario = setup.scenario
    placing = starts_generator(seed if scenario.starts_seed is None else scenario.starts_seed)
    watching: list[Ego | Agent | Assertion] = [setup.ego, *agents, *setup.assertions]
    # Vehicles keep their distance to all bodies ahead of them, so they see everybody.
    sensors = bool(_ego_sensor(scenario) or scenario.tester_sensor)
    everything = record or bool(setup.site.approaches) or sensors
    everything = everything or any(who.sees_background for who in watching)

    def reset(states: Sequence[BodyState], starts: Sequence[Start]) -> Snapshot:
        shown = {"everything": everything, "note": record}
        return setup.world.reset(seed, states, starts, demand=demand, **shown)

    begun = placed(setup, agents, placing, reset)
    ego = setup.world.ego_body
    scene = setup.site.scene(setup.world.dt, ego, setup.bodies, begun.starts, seed)
    scene = dataclasses.replace(scene, horizon=scenario.end, script=scenario.script)
    senses = _senses(setup, scene, generators[1 + len(agents) :])
    cast(setup, agents, scene, generators)
    setup.ego.reset(scene)
    for assertion in setup.assertions:
        assertion.reset(scene)
    return scene, senses, begun, generators


def generators_of(setup: Setup, seed: int) -> list[np.random.Generator]:
    """The generators of an episode: for coordination, each agent, the ego's and agents' sensors.

    Those of sensors come after all others, which are the same with sensors and without. The first
    stream is that of the starts (``starts_generator``).
    """
    streams, teams = np.random.SeedSequence(seed), len(setup.teams)
    _, *seeds = streams.spawn(2 + teams)
    return [np.random.default_rng(s) for s in (*seeds, *streams.spawn(1 + teams))]


def cast(
    setup: Setup, agents: Sequence[Agent], scene: Scene, generators: Sequence[np.random.Generator]
) -> None:
    """Have the agents begin, each with its team and generator, and know each other."""
    electing, *rest = generators[: 1 + len(setup.teams)]
    for agent, team, rng in zip(agents, setup.teams, rest, strict=True):
        agent.reset(scene, team, rng)
    type(agents[0]).coordinate(agents, electing)


def _senses(setup: Setup, scene: Scene, generators: Sequence[np.random.Generator]) -> Senses | None:
    """The observers of an episode, None with full observability."""
    ego, testers = _ego_sensor(setup.scenario), setup.scenario.tester_sensor
    if not (ego or testers):
        return None
    return Senses(scene, ego, testers, setup.teams, generators)


def _ego_sensor(scenario: Scenario) -> Sensor | None:
    """The ego's sensor; a script may add errors to one that is perfect."""
    if scenario.ego_sensor is None and scripted_errors(scenario.script):
        return Sensor()
    return scenario.ego_sensor
