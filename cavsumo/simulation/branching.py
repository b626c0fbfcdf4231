"""Branches of a running episode: how it would continue with others, while it stays as it is.

A branch is played in a fork of this process, which has SUMO's whole state and that of all agents;
it is exact, and costs no prefix. Where a process cannot be forked, the branch is played here: with
copies of agents, ego and assertions, and in a new simulation, to which the world tells again what
it told the first one; afterwards the same brings the episode's own simulation back. The results are
the same.

``saveState`` of SUMO is no way to branch: what it restores differs.
"""

from __future__ import annotations

import copy
import random
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from cavsumo.agents.base import Agent
from cavsumo.egos.base import Ego
from cavsumo.errors import BranchError, CavsumoError, SimulationError
from cavsumo.model.forks import can_fork, forked
from cavsumo.simulation.episode import Episode, Joint
from cavsumo.simulation.loop import EpisodeLoop
from cavsumo.simulation.playback import doing

DEADLINE_S = 60.0
AT_ONCE = 2  # children at the same time


@dataclass(frozen=True)
class Continuation:
    """How a branch differs from the episode that it leaves; by default not at all.

    Attributes:
        agents: testers' agents in place of those so far, one for each team.
        actions: for each timestep the actions of all agents, in place of agents; nothing is done
            after the last.
        ego: a controller in place of the ego, with the same box.
        seed: of all random numbers from now on, SUMO's too; None for those that would have
            followed.
        steps: timesteps to play at most; None to play to the end of the episode.
        record: keep the snapshots and actions of the whole episode.
    """

    agents: Sequence[Agent] | None = None
    actions: Sequence[Joint] | None = None
    ego: Ego | None = None
    seed: int | None = None
    steps: int | None = None
    record: bool = False


def branch(
    loop: EpisodeLoop,
    continuation: Continuation,
    *,
    deadline: float = DEADLINE_S,
    fork: bool = True,
) -> Episode:
    """The record of a branch; the episode itself stays as it is.

    Args:
        deadline: how long it may take [s].
        fork: play it in a fork where that is possible.

    Raises BranchError if the branch is refused, raises an error, dies or takes too long.
    """
    (found,) = branches(loop, [continuation], deadline=deadline, fork=fork)
    if isinstance(found, BranchError):
        raise found
    return found


def branches(
    loop: EpisodeLoop,
    continuations: Iterable[Continuation],
    *,
    at_once: int = AT_ONCE,
    deadline: float = DEADLINE_S,
    fork: bool = True,
) -> Iterator[Episode | BranchError]:
    """The record of each branch, or its error, in their order; the episode must not go on before.

    Args:
        at_once: forks that play at the same time, at most.
        deadline, fork: as in ``branch``.
    """
    told = tuple(continuations)
    for one in told:
        refuse(loop, one)
    if fork and can_fork():
        works = (_work(loop, one) for one in told)
        found = forked(works, at_once=at_once, deadline=deadline)
    else:
        found = _replayed(loop, told, deadline)
    with closing(found):
        for one_found in found:
            if isinstance(one_found, Episode):  # its places are known by identity
                one_found.starts, one_found.waited = loop.placed.starts, loop.placed.waited
            yield one_found


def _work(loop: EpisodeLoop, continuation: Continuation) -> Callable[[], Episode]:
    """A branch, to be played in a fork."""
    return lambda: _played(loop, continuation)


def _played(loop: EpisodeLoop, how: Continuation, ends: float = np.inf) -> Episode:
    """Play an episode on as told; it becomes another one.

    ``ends``: when it is due, on the clock of ``time.monotonic`` [s].
    """
    agents: Sequence[Agent] | None = how.agents
    if how.actions is not None:
        agents = doing(how.actions, len(loop.setup.teams))
    try:
        loop.hand_over(agents, how.ego, how.seed, record=how.record)
        last = np.inf if how.steps is None else loop.snapshot.step + how.steps
        while not loop.over and loop.snapshot.step < last:
            if time.monotonic() > ends:
                raise BranchError("a branch gave no result in time")
            loop.step()
        return loop.finished()
    finally:
        if how.ego is not None:
            how.ego.close()


def refuse(loop: EpisodeLoop, how: Continuation) -> None:
    """Raise BranchError with a sentence if an episode cannot continue so."""
    setup = loop.setup
    if loop.over:
        raise BranchError("the episode is over: nothing can follow in a branch")
    if loop.replaced:
        raise BranchError("another episode has begun in the simulation: nothing is left to branch")
    if setup.ego.outside or (how.ego is not None and how.ego.outside):
        raise BranchError(
            "an ego outside of this process (exec:, tcp:) has one conversation, which a branch "
            "would share; branch with an ego in Python or of SUMO"
        )
    if how.agents is not None and how.actions is not None:
        raise BranchError("a branch has either agents or actions of its own")
    if how.agents is not None and len(how.agents) != len(setup.teams):
        raise BranchError(f"a branch needs {len(setup.teams)} agents, got {len(how.agents)}")
    if how.ego is not None and type(how.ego).act is Ego.act:
        raise BranchError("SUMO drives an ego from its start: a branch cannot hand it over to SUMO")
    if how.ego is not None and how.ego.kind != setup.world.ego_body.kind:
        raise BranchError("the ego of a branch must have the box and limits of the one it replaces")


# Without a fork


def _replayed(
    loop: EpisodeLoop, continuations: Iterable[Continuation], deadline: float
) -> Generator[Episode | BranchError]:
    """Branches played here, after which the episode's own simulation is brought back."""
    told = loop.setup.world.told
    try:
        for how in continuations:
            with _own_numbers():
                found = _on_a_copy(loop, how, told, time.monotonic() + deadline)
            yield found
    finally:
        _again(loop, told)


def _on_a_copy(
    loop: EpisodeLoop, how: Continuation, told: int, ends: float
) -> Episode | BranchError:
    """A branch played by copies in a new simulation."""
    try:
        other, own = copy.deepcopy((loop, how), _shared(loop))
        _again(loop, told)
        return _played(other, own, ends)
    except CavsumoError as error:
        return BranchError(str(error))
    except Exception as error:
        return BranchError(f"defect: {error!r}")


def _again(loop: EpisodeLoop, told: int) -> None:
    """Bring the simulation of an episode to where the episode is."""
    if loop.setup.world.again(told) != loop.snapshot:
        raise SimulationError("the simulation of the same episode, begun again, is another one")


@contextmanager
def _own_numbers() -> Iterator[None]:
    """Leave the random numbers of Python and numpy, which users' code may draw, as they are."""
    python, old_numpy = random.getstate(), np.random.get_state()
    try:
        yield
    finally:
        random.setstate(python)
        np.random.set_state(old_numpy)


def _shared(loop: EpisodeLoop) -> dict[int, Any]:
    """The objects that a copy of an episode shares with it: the world, and what never changes."""
    setup, scene = loop.setup, loop.scene
    states = [state for seen in loop.history for state in (seen.ego, *seen.testers)]
    constant = [
        *(setup.world, setup.site, setup.scenario, setup.teams, setup.bodies, *setup.bodies),
        *(scene.ego, scene.ego_path, scene.starts, scene.roads, scene.lights, scene.crossings),
        *(scene.limits, scene.ground),
    ]
    snapshots = [*loop.history, loop.snapshot, *(seen.testers for seen in loop.history)]
    return {id(one): one for one in (*constant, *states, *snapshots)}
