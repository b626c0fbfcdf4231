"""Games from Python: from arrays, from a list of transitions, from a function.

Outcomes of a cell that lead to the same state are merged; probabilities whose sum differs from 1 by
rounding are divided by it. Integers, fractions and decimal strings are kept as rationals beside the
floats (``Game.exact``), so that small games can be checked without rounding.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Collection, Hashable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from cavsumo.errors import shown
from cavsumo.games.model import SUM_TOLERANCE, Bools, Exact, Floats, Game, GameError, Ints, check

Number = int | float | Fraction | str
Outcome = tuple[int, Number, Number]  # successor, probability, reward
Transition = tuple[int, int, int, Sequence[Outcome]]  # state, tester action, ego action, outcomes


def from_arrays(
    goal: Bools,
    row_start: Ints,
    cell_start: Ints,
    outcome_start: Ints,
    successor: Ints,
    probability: Floats,
    reward: Floats,
    *,
    initial: int = 0,
    tester_action: Ints | None = None,
    ego_action: Ints | None = None,
    name: str = "",
) -> Game:
    """A game from nested arrays (``model``); large games are built this way.

    Args:
        reward: of each outcome, or expected, of each cell: told apart by the length.
        tester_action, ego_action: default: the number of the row in its state, the cell in its row.

    Raises:
        GameError: the arrays do not define a game.
    """
    row_start, cell_start, outcome_start = (
        np.asarray(start, dtype=np.int64) for start in (row_start, cell_start, outcome_start)
    )
    _check_nesting(goal, row_start, cell_start, outcome_start, len(successor))
    probability, reward = np.asarray(probability, float), np.asarray(reward, float)
    cells = len(outcome_start) - 1
    if len(reward) not in (cells, len(successor)) or len(probability) != len(successor):
        raise GameError(f"reward: expected {cells} numbers, one a cell, or one an outcome")
    each = reward if len(reward) == len(successor) != cells else None
    if each is not None:
        reward = np.add.reduceat(probability * each, outcome_start[:-1])
    game = Game(
        goal=np.asarray(goal, dtype=bool),
        row_start=row_start,
        cell_start=cell_start,
        outcome_start=outcome_start,
        successor=np.asarray(successor, dtype=np.int32),
        probability=probability,
        reward=reward,
        tester_action=_numbered(row_start) if tester_action is None else tester_action,
        ego_action=_numbered(cell_start) if ego_action is None else ego_action,
        initial=initial,
        outcome_reward=each,
        name=name,
    )
    return check(game)


def _check_nesting(goal: Any, rows: Ints, cells: Ints, outcomes: Ints, end: int) -> None:
    """Each level of the arrays covers the next."""
    for key, start, length, last in (
        ("row_start", rows, len(goal), len(cells) - 1),
        ("cell_start", cells, int(rows[-1]), len(outcomes) - 1),
        ("outcome_start", outcomes, int(cells[-1]), end),
    ):
        if len(start) != length + 1 or start[0] != 0 or start[-1] != last:
            raise GameError(f"{key}: expected {length + 1} numbers from 0 to {last}")
        if (np.diff(start) < 0).any():
            raise GameError(f"{key}: expected numbers that never fall")


def _numbered(start: Ints) -> Ints:
    """0, 1, ... within each part."""
    length = np.diff(start)
    return np.arange(int(start[-1])) - np.repeat(start[:-1], length)


def from_transitions(
    n_states: int,
    goal: Collection[int],
    transitions: Iterable[Transition],
    *,
    initial: int = 0,
    name: str = "",
    labels: tuple[Any, ...] | None = None,
) -> Game:
    """A game from a list of (state, tester action, ego action, [(next, probability, reward)]).

    Raises:
        GameError: naming state and actions, and what was expected.
    """
    goals = set(goal)
    for state in sorted(goals):
        if not 0 <= state < n_states:
            raise GameError(f"goal: expected states below {n_states}, got {state}")
    table: dict[tuple[int, int, int], dict[int, tuple[Fraction, Fraction]]] = {}
    for state, tester, ego, outcomes in transitions:
        place = f"state {state}, tester action {tester}, ego action {ego}"
        if not 0 <= state < n_states:
            raise GameError(f"{place}: expected a state below {n_states}")
        if (state, tester, ego) in table:
            raise GameError(f"{place}: given twice")
        merged = _merged(place, n_states, outcomes)
        if state not in goals:
            table[state, tester, ego] = merged
        elif set(merged) != {state} or merged[state][1] != 0:
            raise GameError(f"{place}: a goal is absorbing with reward 0")
    served = goals | {state for state, *_ in table}
    if len(served) < n_states:
        idle = next(state for state in range(n_states) if state not in served)
        raise GameError(f"state {idle}: expected at least one action, as it is no goal")
    return check(_from_table(n_states, goals, table, initial, name, labels))


def _merged(
    place: str, n_states: int, outcomes: Sequence[Outcome]
) -> dict[int, tuple[Fraction, Fraction]]:
    """Probability and mean reward of each successor, as rationals that sum to 1."""
    found: dict[int, tuple[Fraction, Fraction]] = {}
    for successor, probability, reward in outcomes:
        p, r = _rational(place, "probability", probability), _rational(place, "reward", reward)
        if not 0 <= successor < n_states:
            raise GameError(f"{place}: expected successors below {n_states}, got {successor}")
        if p < 0:
            raise GameError(f"{place}: expected a probability of at least 0, got {probability}")
        if p:
            before, sum_ = found.get(successor, (Fraction(0), Fraction(0)))
            found[successor] = (before + p, sum_ + p * r)
    total = sum((p for p, _ in found.values()), Fraction(0))
    if abs(total - 1) > SUM_TOLERANCE:
        raise GameError(f"{place}: expected probabilities that sum to 1, got {float(total):.12g}")
    return {s: (p / total, weighted / p) for s, (p, weighted) in found.items()}


def _rational(place: str, what: str, value: Any) -> Fraction:
    """A number as a rational; strings may hold "1/3"."""
    try:
        return rational(value)
    except ValueError:
        raise GameError(
            f'{place}: expected a {what} such as 0.25 or "1/4", got {shown(value)}'
        ) from None


def rational(value: Any) -> Fraction:
    """A number, or a string such as "0.25" or "1/4", exactly; ValueError for what no float holds.

    Exponents are looked at before: the digits of 1e999999999 would fill the memory.
    """
    if isinstance(value, bool) or (isinstance(value, str) and _LARGE_EXPONENT.search(value)):
        raise ValueError(f"{shown(value)} is no number")
    try:
        number = Fraction(value)
        float(number)  # too large: OverflowError
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        raise ValueError(f"{shown(value)} is no number") from None
    return number


_LARGE_EXPONENT = re.compile(r"[eE][+-]?0*[1-9]\d{3}")


def _from_table(
    n_states: int,
    goals: set[int],
    table: Mapping[tuple[int, int, int], Mapping[int, tuple[Fraction, Fraction]]],
    initial: int,
    name: str,
    labels: tuple[Any, ...] | None,
) -> Game:
    """The arrays of a table of merged outcomes."""
    keys = sorted(table)
    rows = sorted({key[:2] for key in keys})
    outcomes = [(s, *table[key][s]) for key in keys for s in sorted(table[key])]
    sizes = [len(table[key]) for key in keys]
    exact_reward = tuple(sum((p * r for p, r in table[key].values()), Fraction(0)) for key in keys)
    goal = np.zeros(n_states, dtype=bool)
    goal[sorted(goals)] = True
    numbers = {row: i for i, row in enumerate(rows)}
    return Game(
        goal=goal,
        row_start=_starts([row[0] for row in rows], n_states),
        cell_start=_starts([numbers[key[:2]] for key in keys], len(rows)),
        outcome_start=np.concatenate(([0], np.cumsum(np.array(sizes, dtype=np.int64)))),
        successor=np.array([o[0] for o in outcomes], dtype=np.int32),
        probability=np.array([float(o[1]) for o in outcomes]),
        reward=np.array([float(r) for r in exact_reward]),
        tester_action=np.array([row[1] for row in rows], dtype=np.int64),
        ego_action=np.array([key[2] for key in keys], dtype=np.int64),
        initial=initial,
        outcome_reward=np.array([float(o[2]) for o in outcomes]),
        exact=Exact(tuple(o[1] for o in outcomes), exact_reward),
        labels=labels,
        name=name,
    )


def _starts(owners: Sequence[int], count: int) -> Ints:
    """Where the parts of each owner begin in a sorted list of owners."""
    return np.searchsorted(np.array(owners, dtype=np.int64), np.arange(count + 1))


def from_callable(
    initial: Hashable,
    actions: Callable[[Any], tuple[Sequence[Any], Sequence[Any]]],
    step: Callable[[Any, Any, Any], Iterable[tuple[Hashable, Number, Number]]],
    is_goal: Callable[[Any], bool],
    *,
    name: str = "",
    limit: int = 1_000_000,
) -> Game:
    """The game of all states that can be reached from the initial one.

    Args:
        actions: the actions of tester and ego in a state; the game's are their numbers.
        step: (state, tester action, ego action) to outcomes (next, probability, reward).
        limit: on the number of states.

    Raises:
        GameError: more states than the limit, or invalid outcomes.
    """
    number: dict[Hashable, int] = {initial: 0}
    waiting, transitions, goals = deque([initial]), [], []
    while waiting:
        state = waiting.popleft()
        if is_goal(state):
            goals.append(number[state])
            continue
        first, second = actions(state)
        for i, tester in enumerate(first):
            for j, ego in enumerate(second):
                outcomes = []
                for successor, p, r in step(state, tester, ego):
                    if successor not in number:
                        number[successor] = len(number)
                        waiting.append(successor)
                    outcomes.append((number[successor], p, r))
                transitions.append((number[state], i, j, outcomes))
        if len(number) > limit:
            raise GameError(f"more than {limit} states can be reached")
    return from_transitions(len(number), goals, transitions, name=name, labels=tuple(number))
