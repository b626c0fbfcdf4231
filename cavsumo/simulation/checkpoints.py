"""An episode kept at its start, in a fork that waits, so that its failure is judged from there.

A rerun needs the episode's simulation at its start. To start SUMO again takes seconds on a large
network, and a fork that waits some milliseconds. There is one at a time. It ends when it has judged
a failure, or when the episode has none.
"""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Callable, Sequence
from typing import Any

from cavsumo.agents.base import Agent
from cavsumo.egos.reference import Reference
from cavsumo.errors import BranchError
from cavsumo.model.forks import Fork, can_fork, cost_of_fork
from cavsumo.simulation.avoidability import Avoidability, AvoidabilityCheck
from cavsumo.simulation.episode import Episode
from cavsumo.simulation.loop import EpisodeLoop
from cavsumo.simulation.setup import Setup

QUICK_S = 0.05  # a start that takes less takes less than twenty forks
WORTH = 20.0  # a start that costs as many forks: it pays if one episode in twenty fails


# From how an episode ended, and the same episode at its start, the question of its failure.
Check = Callable[[Episode, EpisodeLoop], AvoidabilityCheck]


class Checkpoint:
    """An episode at its start, in a fork that waits for its end.

    Args:
        check: makes the question of an episode, given how it ended and the loop at its start.
        deadline: how long the fork may take to judge [s].
    """

    def __init__(
        self,
        loop: EpisodeLoop,
        check: Check,
        deadline: float,
    ) -> None:
        self._deadline, self._open = deadline, True
        source, self._sink = os.pipe()

        def judges() -> Avoidability | None:
            with os.fdopen(source, "rb") as told:
                words = told.read()
            if not words:
                return None
            episode, references = pickle.loads(words)
            # places are known by identity
            episode.starts, episode.waited = loop.placed.starts, loop.placed.waited
            return check(episode, loop).judged(*references)

        try:
            self._fork = Fork(judges, 2 * deadline, keep=[source])
        finally:
            os.close(source)

    def judged(self, episode: Episode, *references: Reference | None) -> Avoidability | None:
        """``AvoidabilityCheck.judged`` of the violation; None if the fork failed."""
        self._open = False
        try:
            with os.fdopen(self._sink, "wb") as sink:
                pickle.dump((episode, references), sink, pickle.HIGHEST_PROTOCOL)
            return self._fork.awaited(self._deadline)
        except BranchError:
            return None
        except OSError:  # it died while it waited
            self._fork.kill()
            return None

    def close(self) -> None:
        """End the fork if it has judged nothing."""
        if self._open:
            self._open = False
            os.close(self._sink)
            self._fork.kill()


def begun(
    setup: Setup,
    agents: Sequence[Agent],
    seed: int,
    check: Check | None,
    deadline: float,
    **how: Any,
) -> tuple[EpisodeLoop, Checkpoint | None]:
    """An episode at its start, and a checkpoint of it where that pays.

    Args:
        check: makes the question whose answer a failure will need; None for an episode of which
            nothing will be asked.
        deadline: how long the answer may take [s].
        how: further arguments of ``EpisodeLoop``.
    """
    before = time.process_time()
    loop = EpisodeLoop(setup, agents, seed, **how)
    spent = time.process_time() - before
    if check is None or setup.ego.outside or not can_fork():
        return loop, None
    slow = setup.world.simulations.stood_by  # another one would be started
    if not slow and (spent < QUICK_S or spent < WORTH * cost_of_fork()):
        return loop, None
    return loop, Checkpoint(loop, check, deadline)
