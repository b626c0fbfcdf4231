"""One episode as a job: which it is, whose bodies play, and its row when it fails.

Imported by the parent process, so nothing here touches SUMO.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cavsumo.agents import AGENTS, Agent
from cavsumo.agents.policy import make_agent, parameters_of, policy_file
from cavsumo.bodies import Body, kind_named, model_of
from cavsumo.errors import InputError, UnknownName
from cavsumo.labels import labelled
from cavsumo.outcomes import Outcome, Row
from cavsumo.scenario import BatchPlan, Scenario, Simulation


@dataclass(frozen=True)
class Job:
    """One episode to play.

    Attributes:
        run: its number in the batch.
        agent: the tester agent's label.
        seed: the episode's seed.
        memory: what the agents learned in earlier episodes, one entry an agent; None for none.
        record: keep the frames whatever happens.
        simulation: "own", or "new" to start one that later jobs share as the "same".
    """

    run: int
    agent: str
    seed: int
    memory: tuple[Any, ...] | None = None
    record: bool = False
    simulation: Simulation = "own"


def episode_seed(batch_seed: int, episode: int) -> int:
    """The seed of an episode: the same for every agent, so that agents meet the same starts."""
    words = np.random.SeedSequence((batch_seed, episode)).generate_state(1, np.uint32)
    return int(words[0])


def starts_generator(seed: int) -> np.random.Generator:
    """Draws the testers' starts of the episode with that seed: the first of its generators."""
    return np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0])


def job(plan: BatchPlan, run: int, memory: tuple[Any, ...] | None = None) -> Job:
    """The run-th episode of a batch: agents take turns, so run i stays what it is for any N.

    ``memory``: what earlier episodes taught, unless the plan says what is known in all of them.
    """
    episode, which = divmod(run, len(plan.agents))
    seed, label = episode_seed(plan.seed, episode), labelled(plan.agents[which])[0]
    known = memory if plan.known is None else plan.known.get(label)
    return Job(run, label, seed, known, plan.trace == "all")


def make_agents(plan: BatchPlan, label: str) -> list[Agent]:
    """The agents of one label, one for each team."""
    name = plan.cast[label]
    params = plan.agent_params(label, [p.name for p in parameters_of(name)])
    return [make_agent(name, params) for _ in teams(plan.scenario)]


def agent_files(plan: BatchPlan) -> list[Path]:
    """The files of the agents: those that are policies, and those that their parameters name."""
    files = []
    for label, name in plan.cast.items():
        if (file := policy_file(name)) is not None:
            files.append(file)
            continue
        params = plan.agent_params(label, [p.name for p in parameters_of(name)])
        files += [
            Path(str(params[key]))
            for key in getattr(AGENTS.get(name), "FILES", ())
            if key in params
        ]
    return files


def learners(plan: BatchPlan) -> frozenset[str]:
    """The labels of the agents that learn from episode to episode."""
    if plan.known is not None:
        return frozenset()
    return frozenset(n for n in plan.cast if any(a.learns for a in make_agents(plan, n)))


def teams(scenario: Scenario) -> tuple[tuple[int, ...], ...]:
    """For each agent the indices of the bodies that it owns."""
    size = scenario.bodies_per_agent
    return tuple(tuple(range(i, i + size)) for i in range(0, scenario.testers, size))


def tester_bodies(scenario: Scenario) -> tuple[Body, ...]:
    """The testers' bodies, as an agent-body-effector model that was validated (Definition 1)."""
    kind = kind_named(scenario.kind)
    bodies = tuple(Body(f"tester{i}", kind) for i in range(scenario.testers))
    model_of({f"agent{a}": [bodies[i] for i in team] for a, team in enumerate(teams(scenario))})
    return bodies


def failed_row(plan: BatchPlan, job: Job, message: str) -> Row:
    """The row of an episode that could not be played."""
    return head(plan, job) | {"outcome": "error", "error": message}


def failed(plan: BatchPlan, job: Job, message: str, wall: float) -> Outcome:
    """The outcome of an episode that could not be played."""
    return Outcome(failed_row(plan, job, message) | {"wall_s": wall})


def head(plan: BatchPlan, job: Job) -> Row:
    """The columns that are known beforehand."""
    scenario = plan.scenario
    return {
        "run": job.run,
        "agent": job.agent,
        "ego": scenario.ego,
        "testers": scenario.testers,
        "reset": "fresh" if job.simulation == "own" else "shared",
        "embodiment": scenario.embodiment,
        "sumo_width_m": scenario.sumo_width,
        "seed": job.seed,
    }


def check_agents(plan: BatchPlan) -> None:
    """Build every agent once and account for every parameter, before anything starts."""
    known = {label: [p.name for p in parameters_of(name)] for label, name in plan.cast.items()}
    shared = {key for keys in known.values() for key in keys}
    qualified = {f"{label}.{key}" for label, keys in known.items() for key in keys}
    for key in plan.params:
        valid = qualified if "." in key else shared
        if key not in valid:
            raise UnknownName("parameter", key, valid, f"agent {' '.join(plan.agents)}")
    kind = kind_named(plan.scenario.kind)
    for label, name in plan.cast.items():
        if label != name and label in AGENTS:
            raise InputError(f"agent {label}={name}: the label is the name of another agent")
        for agent in make_agents(plan, label)[:1]:
            try:
                agent.check_bodies(kind, plan.scenario.bodies_per_agent)
            except ValueError as error:
                raise InputError(f"agent {label}: {error}") from error
