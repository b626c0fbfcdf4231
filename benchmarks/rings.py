"""Games of any size by rule: pedestrians who want to cross before a car on a ring road.

The ring has L columns. The car is at column x with speed v in 1..3, the pedestrians walk across it
at columns 0 (and g), lateral position y in 0..4, the lane is y = 2. Moves may fail: those of each
pedestrian with probability 1/10, the car's acceleration with 1/5; then x' = x + v (the old speed)
mod L. A pedestrian on the lane within the car's braking distance (0, 1, 3 columns at v = 1, 2, 3)
costs 25 and all go back to y = 0; else a step costs 1 and 1 more for each with 1 <= y <= 3. Goals:
some pedestrian is on the lane in the next v columns beyond the braking distance, none within it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cavsumo.games.build import from_arrays
from cavsumo.games.model import Game

BRAKING = np.array([0, 0, 1, 3])


def two_pedestrians(length: int, gap: int) -> Game:
    """The game of two pedestrians against the car: 75 L states, 9 x 3 actions, 8 outcomes.

    State ((x * 3 + v - 1) * 5 + y1) * 5 + y2; tester action 3 (m1 + 1) + m2 + 1; ego action a + 1.
    """
    successor, reward = _two(length, gap)
    s = np.arange(length * 75)
    lateral = (s // 5 % 5, s % 5)
    crossed, reached = _zones(length, (0, gap), s // 75, s // 25 % 3 + 1, lateral)
    chance = [(0.1 if k & 4 else 0.9) * (0.1 if k & 2 else 0.9) * (0.2 if k & 1 else 0.8)
              for k in range(8)]  # fmt: skip
    initial = ((length // 2 * 3 + 1) * 5) * 5  # the car half a round away at medium speed
    return _game(reached & ~crossed, successor, np.array(chance), reward, initial)


def successors_of_two(length: int, gap: int) -> Any:
    """The successor of each state, pair of actions and chance event, shape (75 L, 9, 3, 8)."""
    return _two(length, gap)[0]


def _two(length: int, gap: int) -> tuple[Any, Any]:
    """Successors and rewards of ``two_pedestrians``; bits of the chance event: who fails."""
    s, a1, a2, k = np.ix_(np.arange(length * 75), np.arange(9), np.arange(3), np.arange(8))
    x, v, y1, y2 = s // 75, s // 25 % 3 + 1, s // 5 % 5, s % 5
    moved_1 = np.where(k & 4, y1, np.clip(y1 + a1 // 3 - 1, 0, 4))
    moved_2 = np.where(k & 2, y2, np.clip(y2 + a1 % 3 - 1, 0, 4))
    faster = np.where(k & 1, v, np.clip(v + a2 - 1, 1, 3))
    there = np.broadcast_arrays((x + v) % length, faster, moved_1, moved_2)
    late, _ = _zones(length, (0, gap), there[0], there[1], there[2:])
    reward = np.where(late, -25.0, -1.0 - _walking(there[2]) - _walking(there[3]))
    first, second = (np.where(late, 0, y) for y in there[2:])
    return ((there[0] * 3 + there[1] - 1) * 5 + first) * 5 + second, reward


def one_pedestrian(length: int) -> Game:
    """An MDP: one pedestrian with five moves against a car of random speed: 15 L states.

    State (x * 3 + v - 1) * 5 + y; action m + 2; the car's acceleration is -1, 0 or 1 with equal
    probability, and a move is made in full, by one less, or not at all.
    """
    s, a1, _, k = np.ix_(np.arange(length * 15), np.arange(5), np.arange(1), np.arange(9))
    x, v, y = s // 15, s // 5 % 3 + 1, s % 5
    move = np.sign(a1 - 2) * np.maximum(0, np.abs(a1 - 2) - k // 3)
    there = np.broadcast_arrays((x + v) % length, np.clip(v + k % 3 - 1, 1, 3),
                                np.clip(y + move, 0, 4))  # fmt: skip
    late, _ = _zones(length, (0,), there[0], there[1], there[2:])
    reward = np.where(late, -25.0, -1.0 - _walking(there[2]))
    successor = (there[0] * 3 + there[1] - 1) * 5 + np.where(late, 0, there[2])
    flat = [part.ravel() for part in (x, v, y)]
    crossed, reached = _zones(length, (0,), flat[0], flat[1], flat[2:])
    chance = np.repeat([0.8, 0.15, 0.05], 3) / 3.0
    return _game(reached & ~crossed, successor, chance, reward, 0)


def _zones(length: int, columns: tuple[int, ...], x: Any, v: Any, lateral: Any) -> Any:
    """Whether somebody is on the lane within the braking distance; within the next v columns."""
    late, near = np.zeros(x.shape, dtype=bool), np.zeros(x.shape, dtype=bool)
    for column, y in zip(columns, lateral, strict=True):
        ahead = (column - x) % length
        late |= (y == 2) & (ahead <= BRAKING[v])
        near |= (y == 2) & (BRAKING[v] < ahead) & (ahead <= BRAKING[v] + v)
    return late, near


def _walking(y: Any) -> Any:
    """1 where a pedestrian is on the road."""
    return ((y >= 1) & (y <= 3)).astype(float)


def _game(goal: Any, successor: Any, chance: Any, reward: Any, initial: int) -> Game:
    """The game of dense arrays of shape (states, tester, ego, outcomes); same successors merge."""
    from scipy.sparse import csr_matrix

    n, many, wide, outcomes = successor.shape
    live = np.flatnonzero(~goal)
    cells = len(live) * many * wide
    start = np.arange(cells + 1) * outcomes
    to = successor[live].reshape(-1).astype(np.int32)
    matrix = csr_matrix((np.tile(chance, cells), to, start), shape=(cells, n))
    matrix.sum_duplicates()
    rows = np.where(goal, 0, many)
    return from_arrays(
        goal,
        np.concatenate(([0], np.cumsum(rows))),
        np.arange(len(live) * many + 1) * wide,
        matrix.indptr,
        matrix.indices,
        matrix.data,
        (reward[live].reshape(cells, outcomes) * chance).sum(axis=1),
        initial=initial,
    )
