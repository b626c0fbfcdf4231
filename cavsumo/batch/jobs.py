"""One episode as a job, and its row if it fails.

Imported by the parent process, so this file does not import SUMO.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cavsumo.agents.recorded import Recorded
from cavsumo.model.labels import labelled
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.seeds import episode_seed
from cavsumo.results.column import FinishedEpisode
from cavsumo.results.columns import row_of
from cavsumo.results.rows import Outcome

if TYPE_CHECKING:
    from cavsumo.simulation.avoidability import Avoidability
    from cavsumo.simulation.episode import Episode

Memory = tuple[Any, ...]  # the knowledge of an episode's agents, as plain data, agent by agent


@dataclass(frozen=True)
class Job:
    """One episode to play.

    Attributes:
        run: its number in the batch.
        agent: the tester agent's label.
        seed: the episode's seed.
        memory: the agents' knowledge from earlier episodes; None for none.
        record: keep the frames in any case.
        recorded: an episode to play back instead of asking the agents; None to ask them.
        briefly: whether a failure is judged by one rerun: preventable or not, and no more.
    """

    run: int
    agent: str
    seed: int
    memory: Memory | None = None
    record: bool = False
    recorded: Recorded | None = None
    briefly: bool = False


def job(plan: BatchPlan, run: int, memory: Memory | None = None) -> Job:
    """The run-th episode of a batch: agents take turns, so run i is the same for any N.

    ``memory``: knowledge from earlier episodes, unless the plan fixes it for all episodes.
    """
    episode, which = divmod(run, len(plan.agents))
    seed, label = episode_seed(plan.seed, episode), labelled(plan.agents[which])[0]
    known = memory if plan.known is None else plan.known.get(label)
    return Job(run, label, seed, known, plan.trace == "all")


def finished(
    plan: BatchPlan,
    job: Job,
    episode: Episode | None = None,
    avoidability: Avoidability | None = None,
    error: str = "",
) -> FinishedEpisode:
    """A job with its result: an episode, or the reason why there is none."""
    return FinishedEpisode(plan, job.run, job.agent, job.seed, episode, avoidability, error)


def failed(plan: BatchPlan, job: Job, message: str, wall: float) -> Outcome:
    """The outcome of an episode that could not be played."""
    return Outcome(row_of(finished(plan, job, error=message)) | {"wall_s": wall})
