"""Histories, strategies and policies (seed, section 2.1).

A strategy is a mapping from actions to positive probabilities that sum to 1, a policy assigns to
every history the strategy that its player follows. A history of length t holds t states and t - 1
action profiles, so its last state is decided at decision-step t.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple, Protocol

import numpy as np

from cavsumo.games.model import Game, GameError

Number = Fraction | float
Strategy = Mapping[int, Number]
TESTER, EGO = 1, 2


class History(NamedTuple):
    """A finite execution that ends in a state.

    Attributes:
        states: s_1, ..., s_t.
        profiles: (tester action, ego action) between them.
    """

    states: tuple[int, ...]
    profiles: tuple[tuple[int, int], ...] = ()

    @property
    def state(self) -> int:
        """The state that it ends in."""
        return self.states[-1]

    @property
    def step(self) -> int:
        """Its length t, which is the decision-step."""
        return len(self.states)

    def then(self, profile: tuple[int, int], state: int) -> History:
        """The history one step longer."""
        return History((*self.states, state), (*self.profiles, profile))


class Policy(Protocol):
    """The strategy of a player in every history."""

    def strategy(self, history: History) -> Strategy:
        """The distribution over the player's actions."""


@dataclass(frozen=True)
class Stationary:
    """A policy that depends on the state alone.

    Attributes:
        table: the strategy in each state that is not a goal.
    """

    table: Mapping[int, Strategy]

    def strategy(self, history: History) -> Strategy:
        """See ``Policy``."""
        return self.table[history.state]


@dataclass(frozen=True)
class Markovian:
    """A policy that depends on the state and the decision-step.

    Attributes:
        decide: (state, decision-step from 1) to a strategy.
    """

    decide: Callable[[int, int], Strategy]

    def strategy(self, history: History) -> Strategy:
        """See ``Policy``."""
        return self.decide(history.state, history.step)


@dataclass(frozen=True)
class HistoryDependent:
    """A policy that may depend on the whole history.

    Attributes:
        decide: a history to a strategy.
    """

    decide: Callable[[History], Strategy]

    def strategy(self, history: History) -> Strategy:
        """See ``Policy``."""
        return self.decide(history)


def pure(choices: Mapping[int, int]) -> Stationary:
    """The stationary pure policy that plays one action in each state."""
    return Stationary({state: {action: Fraction(1)} for state, action in choices.items()})


def uniform(game: Game, player: int) -> Stationary:
    """The stationary policy of a player that plays all actions alike."""
    table = {}
    for state in np.flatnonzero(~game.goal).tolist():
        actions = tester_actions(game, state) if player == TESTER else ego_actions(game, state)
        table[state] = {action: Fraction(1, len(actions)) for action in actions}
    return Stationary(table)


def tester_actions(game: Game, state: int) -> list[int]:
    """The tester's actions in a state, in the order of the rows."""
    return [int(game.tester_action[row]) for row in game.rows(state)]


def ego_actions(game: Game, state: int) -> list[int]:
    """The ego's actions in a state, in the order of the first row's cells."""
    return [int(game.ego_action[cell]) for cell in game.cells(game.rows(state)[0])]


def joint(
    game: Game, state: int, tester: Strategy, ego: Strategy
) -> Iterator[tuple[int, tuple[int, int], Number]]:
    """The cells of a state that are played: cell, profile, probability pi(h, a).

    Raises:
        GameError: an invalid strategy, or one with an action that the state does not have.
    """
    for player, strategy, actions in (
        ("tester", tester, tester_actions(game, state)),
        ("ego", ego, ego_actions(game, state)),
    ):
        check_strategy(f"state {game.label(state)}: the {player}'s strategy", strategy, actions)
    for row in game.rows(state):
        a1 = int(game.tester_action[row])
        for cell in game.cells(row) if tester.get(a1) else ():
            a2 = int(game.ego_action[cell])
            if ego.get(a2):
                yield cell, (a1, a2), tester[a1] * ego[a2]


def check_strategy(what: str, strategy: Strategy, actions: Sequence[int]) -> None:
    """GameError unless a strategy is a distribution over the actions."""
    unknown = [action for action in strategy if action not in actions]
    if unknown:
        raise GameError(f"{what} plays {unknown[0]}, which is no action there; valid: {actions}")
    weights = list(strategy.values())
    if any(weight < 0 for weight in weights) or abs(float(sum(weights)) - 1.0) > 1e-9:
        raise GameError(f"{what} is no distribution: {dict(strategy)}")


def histories(game: Game, length: int, start: int | None = None) -> Iterator[History]:
    """All histories of a length, from a state or from every state; goals stay and play nothing."""
    starts = range(game.n_states) if start is None else [start]
    waiting = [History((state,)) for state in starts]
    while waiting:
        history = waiting.pop()
        if history.step == length:
            yield history
            continue
        for row in game.rows(history.state):
            for cell in game.cells(row):
                profile = (int(game.tester_action[row]), int(game.ego_action[cell]))
                waiting += [history.then(profile, s) for s, *_ in game.outcomes(cell)]


def is_pure(game: Game, policy: Policy, steps: int = 3) -> bool:
    """Whether one action is certain in every history of up to ``steps`` states.

    For a stationary policy that is every history.
    """
    return all(
        sum(1 for weight in strategy.values() if weight) == 1
        for _, strategy in _decisions(game, policy, steps)
    )


def is_markovian(game: Game, policy: Policy, steps: int = 3) -> bool:
    """Whether histories of up to ``steps`` states with the same last state and length agree."""
    return isinstance(policy, Stationary | Markovian) or _agree(
        (((h.state, h.step), strategy) for h, strategy in _decisions(game, policy, steps))
    )


def is_stationary(game: Game, policy: Policy, steps: int = 3) -> bool:
    """Whether histories of up to ``steps`` states that end in the same state agree."""
    return isinstance(policy, Stationary) or _agree(
        ((h.state, strategy) for h, strategy in _decisions(game, policy, steps))
    )


def _decisions(game: Game, policy: Policy, steps: int) -> Iterator[tuple[History, Strategy]]:
    """The histories of up to ``steps`` states that end in a state with a decision."""
    for length in range(1, 2 if isinstance(policy, Stationary) else steps + 1):
        for history in histories(game, length):
            if not game.goal[history.state]:
                yield history, policy.strategy(history)


def _agree(decisions: Iterator[tuple[Any, Strategy]]) -> bool:
    """Whether equal keys always come with equal strategies."""
    seen: dict[Any, dict[int, Number]] = {}
    for key, strategy in decisions:
        played = {action: weight for action, weight in strategy.items() if weight}
        if seen.setdefault(key, played) != played:
            return False
    return True


class Execution(NamedTuple):
    """One play of the game.

    Attributes:
        history: states and profiles.
        rewards: of the tester, one a step.
    """

    history: History
    rewards: tuple[float, ...]


def execute(
    game: Game,
    tester: Policy,
    ego: Policy,
    rng: np.random.Generator,
    *,
    start: int | None = None,
    steps: int = 10_000,
) -> Execution:
    """Play from a state (default: the initial one) to a goal, for at most ``steps`` steps."""
    history = History((game.initial if start is None else start,))
    rewards: list[float] = []
    while not game.goal[history.state] and len(rewards) < steps:
        played = list(joint(game, history.state, tester.strategy(history), ego.strategy(history)))
        cell, profile, _ = played[_draw(rng, [float(p) for *_, p in played])]
        outcomes = list(game.outcomes(cell))
        state, _, reward = outcomes[_draw(rng, [p for _, p, _ in outcomes])]
        history = history.then(profile, state)
        rewards.append(reward)
    return Execution(history, tuple(rewards))


def _draw(rng: np.random.Generator, weights: list[float]) -> int:
    """An index with probability proportional to its weight; one draw."""
    total = np.cumsum(weights)
    return int(np.searchsorted(total, rng.random() * total[-1], side="right"))
