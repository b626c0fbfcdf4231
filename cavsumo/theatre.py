"""A plan set up in the process that simulates: from a job to an episode to a row."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import cached_property
from typing import Any

from cavsumo.agents import Agent
from cavsumo.errors import CavsumoError, EgoError
from cavsumo.jobs import Job, episode_seed, failed_row, head, make_agents
from cavsumo.outcomes import Outcome, Row
from cavsumo.scenario import BatchPlan, Simulation
from cavsumo.simulator import Episode, play
from cavsumo.site import Site
from cavsumo.stage import set_stage
from cavsumo.traces import frame, origin, trace_head, trace_text


class Theatre:
    """A plan set up in this process: plays jobs one after another; a context manager."""

    def __init__(self, plan: BatchPlan, site: Site) -> None:
        self.plan = plan
        self.stage = set_stage(plan.scenario, site)
        self._agents: dict[str, tuple[list[Agent], tuple[Any, ...] | None]] = {}

    def __enter__(self) -> Theatre:
        return self

    def __exit__(self, *_: object) -> None:
        self.stage.close()

    @cached_property
    def _origin(self) -> dict[str, Any]:
        """What the traces of all episodes have in common."""
        return origin(self.plan, self.stage.site)

    def rehearse(self, *, strict: bool = True) -> None:
        """Start the ego and SUMO once: what they refuse comes out before anything is written.

        In the middle of a batch, not ``strict``, an ego that cannot be started is no refusal: each
        episode tries again, and is an error if that fails.
        """
        try:
            self.stage.ego.prepare(self.stage.mission)
        except EgoError:
            if strict:
                raise
        simulation: Simulation = "own" if self.plan.reset == "fresh" else "new"
        self.stage.world.reset(episode_seed(self.plan.seed, 0), (), (), simulation=simulation)

    def play(self, job: Job) -> tuple[Outcome, tuple[Any, ...] | None]:
        """Play a job: its outcome, and what the agents know afterwards if they learn."""
        begun = time.perf_counter()
        try:
            agents = self._cast(job)
            before = _recall(agents)
            episode = play(
                self.stage,
                agents,
                job.seed,
                record=job.record or (self.plan.trace != "none" and job.simulation == "own"),
                simulation=job.simulation,
            )
            row = head(self.plan, job) | measured(episode)
            trace = self._trace(job, row, before, episode)
            memory = _recall(agents)
        except Exception as error:  # whatever it is, it costs this row and no other
            said = str(error) if isinstance(error, CavsumoError) else f"defect: {error!r}"
            row, trace, memory = failed_row(self.plan, job, said), "", job.memory
        row["wall_s"] = time.perf_counter() - begun
        return Outcome(row, trace, self.stage.ego.take_log()), memory

    def _cast(self, job: Job) -> list[Agent]:
        """The agents of a job, with their memory."""
        if job.agent not in self._agents:
            agents = make_agents(self.plan, job.agent)
            self._agents[job.agent] = agents, _recall(agents)
        agents, unlearned = self._agents[job.agent]
        memories = unlearned if job.memory is None else job.memory
        for agent, memory in zip(agents, memories or (), strict=False):
            agent.remember(memory)
        return agents

    def _trace(self, job: Job, row: Row, memory: Any, episode: Episode) -> str:
        """The frames worth keeping: of tests found, or of every episode if asked."""
        if episode.frames and (job.record or episode.judgement.triggered):
            first = trace_head(self._origin, row, memory, episode.frames)
            return trace_text(first, map(frame, episode.frames))
        return ""


def measured(episode: Episode) -> Row:
    """The columns of a row that a finished episode fills."""
    judgement, contacts = episode.judgement, episode.contacts
    with_ego = {pair for pair in episode.sumo_collisions if "ego" in pair}
    return {
        "outcome": judgement.verdict,
        "assertion": judgement.assertion if judgement.triggered else "",
        "tester": judgement.tester,
        "trigger_time_s": judgement.trigger_time,
        "violation_time_s": judgement.violation_time,
        "time_s": episode.time,
        "steps": episode.steps,
        "min_gap_m": contacts.min_gap,
        "ego_speed_mps": judgement.ego_speed,
        "impact_speed_mps": judgement.impact_speed,
        "max_decel_mps2": episode.max_decel,
        "cost": episode.cost,
        "reward": episode.reward,
        "contacts": len(contacts.ego_pairs),
        "tester_contacts": len(contacts.tester_pairs),
        "sumo_collisions": len(with_ego),
        "background_collisions": len(episode.sumo_collisions - with_ego),
        "emergency_stops": episode.emergency_stops,
        "teleports": episode.teleports,
    }


def _recall(agents: Sequence[Agent]) -> tuple[Any, ...] | None:
    """What the agents learned, None when none of them does."""
    memory = tuple(agent.recall() for agent in agents)
    return None if all(m is None for m in memory) else memory
