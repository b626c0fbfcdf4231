"""The grade of an episode as the testers' reward, given at its end."""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.agents.base import Agent
from cavsumo.assertions.base import VIOLATED
from cavsumo.egos.reference import REFERENCES
from cavsumo.model.scenario import NO_REFERENCE
from cavsumo.results.grade import grade
from cavsumo.simulation.avoidability import AvoidabilityCheck
from cavsumo.simulation.loop import EpisodeLoop
from cavsumo.simulation.setup import Setup


def final_grade(
    loop: EpisodeLoop, setup: Setup, agents: Sequence[Agent], seed: int, reference: str
) -> float:
    """The grade of an episode that has ended, whose snapshots and actions were kept.

    A failure is judged by reruns with the reference driver, which take the simulation.
    """
    episode = loop.finished()
    if episode.outcome != VIOLATED or reference == NO_REFERENCE:
        return grade(episode, None)
    check = AvoidabilityCheck(setup, agents, seed, False, episode, lambda: None)
    return grade(episode, check.judged(REFERENCES.make(reference, {})))
