"""A plan set up in the process that simulates: from a job to an episode to a row."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

from cavsumo.agents import Agent
from cavsumo.agents.casting import make_agents
from cavsumo.assertions.base import INVALID, VIOLATED, Judgement
from cavsumo.batch.jobs import Job, failed_row, head
from cavsumo.egos.reference import REFERENCES
from cavsumo.errors import CavsumoError, EgoError
from cavsumo.model.scenario import BatchPlan, Simulation
from cavsumo.model.seeds import episode_seed
from cavsumo.network.site import Site
from cavsumo.results.rows import Outcome, Row, verdicts_cell
from cavsumo.results.traces import frame, origin, trace_head, trace_text
from cavsumo.simulation.avoidability import Avoidability, AvoidabilityCheck
from cavsumo.simulation.loop import Episode, play
from cavsumo.simulation.playback import played_back, recorded
from cavsumo.simulation.setup import make_setup


class EpisodeRunner:
    """A plan set up in this process: plays jobs one after another; a context manager.

    ``inputs``: the checksums of its files if they are known already.
    """

    def __init__(
        self, plan: BatchPlan, site: Site, inputs: Mapping[str, str] | None = None
    ) -> None:
        self.plan, self._inputs = plan, inputs
        self.setup = make_setup(plan.scenario, site)
        self._agents: dict[str, tuple[list[Agent], tuple[Any, ...] | None]] = {}

    def __enter__(self) -> EpisodeRunner:
        return self

    def __exit__(self, *_: object) -> None:
        self.setup.close()

    @cached_property
    def _origin(self) -> dict[str, Any]:
        """What the traces of all episodes have in common."""
        return origin(self.plan, self.setup.site, self._inputs)

    def try_out(self, *, strict: bool = True) -> None:
        """Start the ego and SUMO once: what they refuse comes out before anything is written.

        In the middle of a batch, not ``strict``, an ego that cannot be started is no refusal: each
        episode tries again, and is an error if that fails.
        """
        try:
            self.setup.ego.prepare(self.setup.mission)
        except EgoError:
            if strict:
                raise
        for label in self.plan.cast:
            make_agents(self.plan, label)[0].prepare()
        simulation: Simulation = "own" if self.plan.reset == "fresh" else "new"
        self.setup.world.reset(episode_seed(self.plan.seed, 0), (), (), simulation=simulation)

    def play(
        self, job: Job, beat: Callable[[], None] = lambda: None
    ) -> tuple[Outcome, tuple[Any, ...] | None]:
        """Play a job: its outcome, and what the agents know afterwards if they learn.

        ``beat`` is called whenever another simulation begins for it.
        """
        begun = time.perf_counter()
        log = ""
        try:
            agents = self._cast(job)
            before = _recall(agents)
            own = job.simulation == "own"
            record = job.record or (self.plan.trace != "none" and own)
            retry = own and self.plan.reference != "none"
            if job.recorded is not None:
                episode = played_back(self.setup, job.recorded)
            else:
                how: dict[str, Any] = {"keep": retry, "simulation": job.simulation}
                episode = play(self.setup, agents, job.seed, record=record, **how)
            memory = _recall(agents)
            row = head(self.plan, job) | measured(episode)
            log = self.setup.ego.take_log()
            if retry and episode.outcome == VIOLATED:
                demand = job.recorded.departures if job.recorded else None
                retrial = AvoidabilityCheck(
                    self.setup, agents, job.seed, record, episode, beat, demand
                )
                row |= self._avoidable(retrial)
            trace = self._trace(job, row, before, episode) if record else ""
        except Exception as error:  # whatever it is, it costs this row and no other
            said = str(error) if isinstance(error, CavsumoError) else f"defect: {error!r}"
            row, trace, memory = failed_row(self.plan, job, said), "", job.memory
        row["wall_s"] = time.perf_counter() - begun
        said_later = self.setup.ego.take_log()  # of an episode that failed; a rerun's is not kept
        return Outcome(row, trace, log or said_later), memory

    def _avoidable(self, retrial: AvoidabilityCheck) -> Row:
        """Whether the plan's reference driver would have avoided a violation."""
        verdict: Avoidability = retrial.judged(REFERENCES.make(self.plan.reference, {}))
        avoidable = None if verdict.avoidable is None else int(verdict.avoidable)
        return {
            "avoidable": avoidable,
            "reference": self.plan.reference,
            "last_chance_s": verdict.last_chance,
            "margin_s": verdict.margin,
            "avoidable_note": verdict.note,
        }

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
        if not (episode.frames and (job.record or episode.judgement.triggered)):
            return ""
        played = recorded(self.setup, episode, job.seed, episode.departures)
        first = trace_head(self._origin, row, memory, episode.frames, played)
        frames = itertools.zip_longest(episode.frames, played.actions, fillvalue=())
        return trace_text(first, itertools.starmap(frame, frames))


def measured(episode: Episode) -> Row:
    """The columns of a row that a finished episode fills."""
    judgement, contacts = episode.judgement, episode.contacts
    if episode.invalid and episode.breach:  # what the assertions said is in ``verdicts``
        judgement = Judgement("", INVALID, episode.breach.tester)
    ttc, drac, pet = episode.criticality.extremes()
    with_ego = {pair for pair in episode.sumo_collisions if "ego" in pair}
    forecast = episode.forecast
    return {
        "forecast": forecast.verdict if forecast else "",
        "forecast_value": forecast.value if forecast else None,
        "outcome": judgement.verdict,
        "breach": str(episode.breach or ""),
        "blame": episode.blame,
        "assertion": judgement.assertion if judgement.triggered else "",
        "verdicts": verdicts_cell(episode.verdicts),
        "robustness": _signed(judgement),
        "tester": judgement.tester,
        "trigger_time_s": judgement.trigger_time,
        "violation_time_s": judgement.violation_time,
        "time_s": episode.time,
        "steps": episode.steps,
        "min_gap_m": contacts.min_gap,
        "min_ttc_s": ttc,
        "max_drac_mps2": drac,
        "pet_s": pet,
        "ego_speed_mps": judgement.ego_speed,
        "impact_speed_mps": judgement.impact_speed,
        "max_decel_mps2": episode.max_decel,
        "cost": episode.cost,
        "accel_rms_mps2": episode.rms_acceleration,
        "turning_rad": episode.naturalness.turning,
        "reward": episode.reward,
        "contacts": len(contacts.ego_pairs),
        "tester_contacts": len(contacts.tester_pairs),
        "sumo_collisions": len(with_ego),
        "background_collisions": len(episode.sumo_collisions - with_ego),
        "emergency_stops": episode.emergency_stops,
        "teleports": episode.teleports,
    }


def _signed(said: Judgement) -> float | None:
    """The robustness as the CSV has it: rounded, what is violated stays below zero."""
    value = said.robustness
    return min(value, -0.001) if value is not None and said.verdict == VIOLATED else value


def _recall(agents: Sequence[Agent]) -> tuple[Any, ...] | None:
    """What the agents learned, None when none of them does."""
    memory = tuple(agent.recall() for agent in agents)
    return None if all(m is None for m in memory) else memory
