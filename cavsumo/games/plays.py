"""The three readings behind one interface: sweep, back up, value a pair of policies.

``solve`` is the same in every reading; the backup of a state and the form of a pair of policies
differ (``turn_based``, ``simultaneous``). Values have a last entry, 0, for the goals.

A pair of policies is *proper* when it reaches a goal from every state with probability 1. In a
finite chain this depends on its graph alone: a goal can be reached from every state. Only the
values of proper pairs are computed, because only their systems are regular. An improper pair is
made proper first: in the states that cannot reach a goal the tester plays the policy by which the
almost-sure region was found. This suffices: no play can then stay among those states, because that
policy is proper, and from the other states a goal is reached without passing through them.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from cavsumo.games.arena import Arena
from cavsumo.games.model import Bools, Floats, Game
from cavsumo.games.pairs import pair_value
from cavsumo.games.reach import reaching


class Play(Protocol):
    """A game in one reading, ready to be solved.

    Attributes:
        arena: the game laid out.
        sweeps: how many come before each jump to the value of a pair.
    """

    arena: Arena
    sweeps: int

    @property
    def first(self) -> Any:
        """A proper policy of the tester, held against any ego."""

    def sweep(self, value: Floats, shift: Floats) -> None:
        """V <- T V + shift, in place, from the goals outward."""

    def backup(self, value: Floats) -> tuple[Floats, Any]:
        """T V - V and the pair of policies that attains T V."""

    def reply(self, held: Any, value: Floats) -> tuple[Floats, Any]:
        """The same where the tester holds a policy and only the ego chooses."""

    def improved(self, held: Any, value: Floats, margin: float) -> Any:
        """The policy that is better by more than a margin where there is one, else the held one."""

    def held_first(self, held: Any, where: Bools) -> Any:
        """The held policy, but ``first`` in some states."""

    def pair_first(self, pair: Any, value: Floats, where: Bools) -> Any:
        """The pair, but in some states the tester plays ``first``."""

    def system(self, pair: Any) -> tuple[Any, Floats]:
        """Transitions between states and rewards under a pair; the last state is the goals'."""

    def tester(self, game: Game, pair: Any, value: Floats) -> Floats:
        """The tester's part of a pair as weights of the game's cells (``certificate``)."""

    def ego(self, game: Game, pair: Any, value: Floats) -> Floats:
        """The ego's part."""


def stranded(play: Play, pair: Any) -> Bools:
    """The states from which a pair of policies cannot get to a goal."""
    transitions, _ = play.system(pair)
    return ~reaching(transitions, play.arena.fast)[:-1]


def made_proper(play: Play, pair: Any, value: Floats) -> Any:
    """The pair, with the tester's proper policy in the states that cannot get to a goal."""
    lost = stranded(play, pair)
    return play.pair_first(pair, value, lost) if lost.any() else pair


def value_of(
    play: Play,
    pair: Any,
    start: Floats,
    shift: Floats,
    residual: float,
    precise: bool,
    steps: Floats | None = None,
) -> Floats | None:
    """The value of a proper pair with rewards raised by the ``shift`` of their state.

    None when it is not found accurately enough.
    """
    transitions, reward = play.system(pair)
    fast = play.arena.fast
    return pair_value(
        transitions, reward + shift, start, residual, precise=precise, fast=fast, steps=steps
    )


def time_of(play: Play, pair: Any) -> Floats | None:
    """Nearly the expected number of steps to a goal under a proper pair, None if not found."""
    transitions, _ = play.system(pair)
    ones = np.append(np.ones(play.arena.size), 0.0)
    found = pair_value(transitions, ones, ones, 1e-2, fast=play.arena.fast)
    return None if found is None or (found[:-1] < 0.9).any() else found
