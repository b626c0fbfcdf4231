"""A plan set up in the simulating process: from a job to an episode to a row."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

from cavsumo.agents import Agent
from cavsumo.assertions.base import VIOLATED
from cavsumo.batch.jobs import Job, Memory, finished
from cavsumo.batch.messages import Answer
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.egos.reference import IDEAL, REFERENCES
from cavsumo.egos.specs import ego_of
from cavsumo.errors import CavsumoError, EgoError, plain
from cavsumo.model.objects import is_instance
from cavsumo.model.scenario import Scenario
from cavsumo.model.seeds import episode_seed
from cavsumo.results.columns import Row, row_of
from cavsumo.results.frame_text import frames_text
from cavsumo.results.rows import Outcome
from cavsumo.results.trace_file import packed
from cavsumo.results.traces import origin, trace_head, trace_text
from cavsumo.simulation.avoidability import Avoidability, AvoidabilityCheck, preventable
from cavsumo.simulation.checkpoints import begun
from cavsumo.simulation.episode import Episode
from cavsumo.simulation.loop import EpisodeLoop, played_on
from cavsumo.simulation.playback import played_back, recorded
from cavsumo.simulation.setup import Setup, make_setup


class EpisodeRunner:
    """A batch set up in this process: plays jobs one after another; a context manager."""

    def __init__(self, prepared: PreparedBatch) -> None:
        self.prepared, self.plan = prepared, prepared.plan_of(0)
        self.setup = self._setup()
        self._played: Scenario | None = self.plan.scenario  # that of the setup
        self._agents: dict[str, tuple[list[Agent], Memory | None]] = {}

    def __enter__(self) -> EpisodeRunner:
        return self

    def __exit__(self, *_: object) -> None:
        self.setup.close()

    def _setup(self) -> Setup:
        """The setup of the present plan."""
        ego = ego_of(self.plan.scenario)
        return make_setup(self.plan.scenario, self.prepared.site_of(self.plan, ego), ego)

    def _turn_to(self, run: int) -> None:
        """Set up the case of a run, if the batch plays a suite."""
        self.plan = self.prepared.plan_of(run)
        if self.plan.scenario == self._played:
            return
        self.setup.close()
        self.__dict__.pop("_origin", None)
        self._played = None
        self.setup = self._setup()
        self.setup.ego.prepare(self.setup.mission)
        self._played = self.plan.scenario

    @cached_property
    def _origin(self) -> dict[str, Any]:
        """The common part of the traces of all episodes, or of those of a case."""
        return origin(self.plan, self.setup.site, self.prepared.checksums)

    def try_out(self, *, strict: bool = True) -> None:
        """Start the ego and SUMO once, so that refusals precede the first written row.

        In the middle of a batch (not ``strict``) an ego that cannot be started does not refuse the
        batch: each episode tries again, and is an error if that fails.
        """
        try:
            self.setup.ego.prepare(self.setup.mission)
        except EgoError:
            if strict:
                raise
        for member in self.prepared.cast:
            self._team(member.label)[0][0].prepare()
        self.setup.world.reset(episode_seed(self.plan.seed, 0), (), ())

    def play(
        self,
        job: Job,
        beat: Callable[[], None] = lambda: None,
        *,
        judge: bool = True,
        digest: bool = False,
    ) -> Answer:
        """Play a job; ``beat`` is called when another simulation begins for it.

        ``judge``: judge a failure; else nothing is prepared for that, and a failure that would have
        to be judged is an answer without a trace that says so. ``digest``: with a checksum.
        """
        since = time.perf_counter()
        log, seen, checkpoint = "", "", None
        try:
            if self.prepared.plan.suite is not None:
                self._turn_to(job.run)
            agents = self.agents_of(job)
            before = _recall(agents)
            record = job.record or self.plan.trace != "none"
            retry = self.plan.reference != "none"

            def check(episode: Episode, kept: EpisodeLoop | None = None) -> AvoidabilityCheck:
                demand = job.recorded.departures if job.recorded else None
                how = self.setup, agents, job.seed, record, episode, beat, demand, kept
                return AvoidabilityCheck(*how)

            if job.recorded is not None:
                episode = played_back(self.setup, job.recorded)
                history = episode.frames
            else:
                asked = check if retry and judge else None
                deadline = self.plan.deadline_s / 2
                loop, checkpoint = begun(
                    self.setup, agents, job.seed, asked, deadline, record=record, keep=retry
                )
                episode, history = played_on(loop), loop.history
            seen = hashlib.sha256(repr(history).encode()).hexdigest() if digest else ""
            memory = _recall(agents)
            log = self.setup.ego.take_log()
            avoidability, judged = None, True
            if not judge and retry and episode.outcome == VIOLATED:
                record = judged = False
            elif retry and episode.outcome == VIOLATED:
                reference, ideal = (
                    REFERENCES.make(name, {}) for name in (self.plan.reference, IDEAL)
                )
                if job.briefly:
                    avoidability = Avoidability(preventable(check(episode), reference))
                if checkpoint is not None:
                    beat()
                    avoidability = checkpoint.judged(episode, reference, ideal)
                avoidability = avoidability or check(episode).judged(reference, ideal)
            row = row_of(finished(self.plan, job, episode, avoidability))
            trace = self._trace(job, row, before, episode) if record else b""
        except Exception as error:  # any error costs this row and no other
            known = isinstance(error, CavsumoError | OSError)
            said = plain(error) if known else f"defect: {error!r}"
            row, trace = row_of(finished(self.plan, job, error=said)), b""
            memory, judged = job.memory, True
        finally:
            if checkpoint is not None:
                checkpoint.close()
        row["wall_s"] = time.perf_counter() - since
        said_later = self.setup.ego.take_log()  # of an episode that failed; a rerun's is not kept
        return Answer(Outcome(row, trace, log or said_later), memory, judged, seen)

    def _team(self, label: str) -> tuple[list[Agent], Memory | None]:
        """The agents of a label, and their knowledge when they were built; fresh copies of an agent
        that was given as an object.
        """
        member = self.prepared.cast[label]
        if label not in self._agents or is_instance(member.name):
            agents = self.prepared.cast.agents(label)
            self._agents[label] = agents, _recall(agents)
        return self._agents[label]

    def agents_of(self, job: Job) -> list[Agent]:
        """The agents of a job, with their memory."""
        agents, unlearned = self._team(job.agent)
        memories = unlearned if job.memory is None else job.memory
        for agent, memory in zip(agents, memories or (), strict=False):
            agent.remember(memory)
        return agents

    def _trace(self, job: Job, row: Row, memory: Any, episode: Episode) -> bytes:
        """The trace, if it is worth keeping: of tests found, or of every episode if asked."""
        if not (episode.frames and (job.record or episode.judgement.triggered)):
            return b""
        played = recorded(self.setup, episode, job.seed, episode.departures)
        first = trace_head(self._origin, row, memory, episode.frames, played)
        return packed(trace_text(first, frames_text(episode.frames, played.actions)))


def _recall(agents: Sequence[Agent]) -> Memory | None:
    """The knowledge of the agents, None when none of them learns."""
    memory = tuple(agent.recall() for agent in agents)
    return None if all(m is None for m in memory) else memory
