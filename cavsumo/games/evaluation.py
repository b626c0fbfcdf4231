"""The expected value of a policy profile (seed, eq. 1) and the probability of reaching a set of
states.

    V(pi, h) = sum over a of pi(h, a) sum over s' of T(s, a, s') [R(s, a, s') + V(pi, [h, a, s'])]

with V = 0 at goals and when the horizon is used up. R is the tester's reward; the ego's value is
-V. Over an infinite horizon V is the limit of the finite ones, which need not exist (``chains``).
Finite horizons take any policy; only stationary ones have an infinite horizon here.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from fractions import Fraction

import numpy as np

from cavsumo.games.chains import Chain, values
from cavsumo.games.model import Game
from cavsumo.games.policies import (
    History,
    Markovian,
    Number,
    Policy,
    Stationary,
    check_strategy,
    ego_actions,
    joint,
    tester_actions,
)

Fold = Callable[[History, Callable[[int, int, tuple[int, int]], Number]], Number]


def expected_value(
    game: Game, tester: Policy, ego: Policy, horizon: int, start: History | int | None = None
) -> Number:
    """V(pi, h) when ``horizon`` more actions are taken, from a history, a state or the initial one.

    Exact if the game and the strategies are rational. With policies that are neither stationary nor
    Markovian all histories are evaluated; their number grows exponentially.
    """

    def fold(history: History, later: Callable[[int, int, tuple[int, int]], Number]) -> Number:
        return _sum(
            weight * (_reward(game, cell) + _mean(game, cell, profile, later))
            for cell, profile, weight in _joint(game, history, tester, ego)
        )

    return _unfold(game, (tester, ego), fold, lambda _: None, horizon, start)


def reach_probability(
    game: Game,
    tester: Policy,
    ego: Policy,
    targets: Collection[int],
    steps: int,
    start: History | int | None = None,
) -> Number:
    """P(targets | h, pi, t): the probability of getting to a target within t = ``steps`` steps."""

    def fold(history: History, later: Callable[[int, int, tuple[int, int]], Number]) -> Number:
        return _sum(
            weight * _mean(game, cell, profile, later)
            for cell, profile, weight in _joint(game, history, tester, ego)
        )

    return _unfold(game, (tester, ego), fold, _arrived(targets), steps, start)


def least_reach_probability(
    game: Game, tester: Policy, steps: int, start: History | int | None = None
) -> Number:
    """The least P(G | h, pi1, pi2, t) over all policies of the ego: eq. 2 asks it to be 1."""
    goals = np.flatnonzero(game.goal).tolist()

    def fold(history: History, later: Callable[[int, int, tuple[int, int]], Number]) -> Number:
        state, strategy = history.state, tester.strategy(history)
        what = f"state {game.label(state)}: the tester's strategy"
        check_strategy(what, strategy, tester_actions(game, state))
        against: dict[int, Number] = {action: Fraction(0) for action in ego_actions(game, state)}
        for row in game.rows(state):
            a1 = int(game.tester_action[row])
            for cell in game.cells(row) if strategy.get(a1) else ():
                a2 = int(game.ego_action[cell])
                against[a2] += strategy[a1] * _mean(game, cell, (a1, a2), later)
        return min(against.values())

    return _unfold(game, (tester,), fold, _arrived(goals), steps, start)


def stationary_values(
    game: Game, tester: Stationary, ego: Stationary, *, exact: bool = False
) -> list[Number | None]:
    """V(pi, s) over an infinite horizon for every state; None where it is undefined.

    Args:
        exact: in rationals, of a game and strategies made of them; for small games.
    """
    rows: list[dict[int, Number]] = []
    rewards: list[Number] = []
    for state in range(game.n_states):
        row: dict[int, Number] = {}
        reward: Number = Fraction(0)
        if not game.goal[state]:
            for cell, _, weight in _joint(game, History((state,)), tester, ego):
                reward += weight * _reward(game, cell)
                for successor, p in _outcomes(game, cell):
                    row[successor] = row.get(successor, Fraction(0)) + weight * p
        rows.append(row)
        rewards.append(reward)
    return values(Chain(rows, rewards), exact)


def _joint(
    game: Game, history: History, tester: Policy, ego: Policy
) -> Iterator[tuple[int, tuple[int, int], Number]]:
    """The cells that are played after a history."""
    return joint(game, history.state, tester.strategy(history), ego.strategy(history))


def _outcomes(game: Game, cell: int) -> list[tuple[int, Number]]:
    """Successors with probabilities, rational where they are known to be."""
    span = range(int(game.outcome_start[cell]), int(game.outcome_start[cell + 1]))
    numbers = game.probability if game.exact is None else game.exact.probability
    return [(int(game.successor[k]), numbers[k]) for k in span]


def _reward(game: Game, cell: int) -> Number:
    """The expected reward of a cell."""
    return float(game.reward[cell]) if game.exact is None else game.exact.reward[cell]


def _mean(
    game: Game,
    cell: int,
    profile: tuple[int, int],
    later: Callable[[int, int, tuple[int, int]], Number],
) -> Number:
    """The mean of the later values over the outcomes of a cell."""
    return _sum(p * later(cell, s, profile) for s, p in _outcomes(game, cell))


def _sum(numbers: Iterable[Number]) -> Number:
    return sum(numbers, Fraction(0))


def _arrived(targets: Collection[int]) -> Callable[[int], Number | None]:
    """1 at a target, not decided elsewhere."""
    there = frozenset(targets)
    return lambda state: Fraction(1) if state in there else None


def _unfold(
    game: Game,
    policies: tuple[Policy, ...],
    fold: Fold,
    ends: Callable[[int], Number | None],
    steps: int,
    start: History | int | None,
) -> Number:
    """The fold over all continuations of a history, or over states if that suffices."""
    begin = game.initial if start is None else start
    history = begin if isinstance(begin, History) else History((begin,))
    if all(isinstance(policy, Stationary | Markovian) for policy in policies):
        return _backwards(game, fold, ends, steps, history)

    def number(history: History, left: int) -> Number:
        known = _known(game, ends, history.state, left)
        if known is not None:
            return known
        return fold(history, lambda _, s, profile: number(history.then(profile, s), left - 1))

    return number(history, steps)


def _known(
    game: Game, ends: Callable[[int], Number | None], state: int, left: int
) -> Number | None:
    """The value where the fold stops: at ends, at goals and beyond the horizon."""
    ended = ends(state)
    if ended is not None:
        return ended
    return Fraction(0) if game.goal[state] or left <= 0 else None


def _backwards(
    game: Game,
    fold: Fold,
    ends: Callable[[int], Number | None],
    steps: int,
    history: History,
) -> Number:
    """Dynamic programming from the horizon back; a history stands for its state and length."""

    def all_known(left: int) -> list[Number | None]:
        return [_known(game, ends, state, left) for state in range(game.n_states)]

    numbers: list[Number] = [known or Fraction(0) for known in all_known(0)]
    for left in range(1, steps + 1):
        length, before = history.step + steps - left, numbers

        def later(_: int, state: int, __: tuple[int, int], then: list[Number] = before) -> Number:
            return then[state]

        numbers = [
            fold(History((state,) * length), later) if known is None else known
            for state, known in enumerate(all_known(left))
        ]
    return numbers[history.state]
