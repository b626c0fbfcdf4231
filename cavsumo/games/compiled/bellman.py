"""The Bellman operator of readings A and C, as in ``backups``.

Gauss-Seidel goes state by state here instead of block by block. In each loop ``sign`` is 1 where
groups are maximised and their cells minimised, -1 the other way round.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from cavsumo.games.arena import Arena
from cavsumo.games.model import Floats, Ints
from cavsumo.games.readings import Reading


def sweep(arena: Arena, value: Floats, shift: Floats) -> None:
    """One Gauss-Seidel sweep of V <- T V + shift in place."""
    _sweep(*_parts(arena), value, shift)


@njit(cache=True, nogil=True)
def _sweep(sign, states, groups, cells, successor, probability, reward, value, shift):  # type: ignore[no-untyped-def]
    for s in range(len(states) - 1):
        best = -math.inf
        for g in range(states[s], states[s + 1]):
            least = math.inf
            for c in range(groups[g], groups[g + 1]):
                q = reward[c]
                for k in range(cells[c], cells[c + 1]):
                    q += probability[k] * value[successor[k]]
                least = min(least, sign * q)
                if least <= best:
                    break
            best = max(best, least)
        value[s] = sign * best + shift[s]


def _parts(arena: Arena) -> tuple[object, ...]:
    """The arrays over which the loops iterate."""
    return (
        -1.0 if arena.reading is Reading.C else 1.0,
        arena.state_group,
        arena.group_cell,
        arena.cell_outcome,
        arena.successor,
        arena.probability,
        arena.reward,
    )


def backup(arena: Arena, value: Floats) -> tuple[Floats, Ints]:
    """T V - V, with its 0 for the goals, and for each state the cell that attains T V."""
    advantage = np.zeros(arena.size + 1)
    chosen = np.zeros(arena.size, dtype=np.int64)
    _backup(*_parts(arena), value, advantage, chosen)
    return advantage, chosen


@njit(cache=True, nogil=True)
def _backup(sign, states, groups, cells, successor, probability, reward, value, out, chosen):  # type: ignore[no-untyped-def]
    for s in range(len(states) - 1):
        best, taken = -math.inf, 0
        for g in range(states[s], states[s + 1]):
            least, answer = math.inf, 0
            for c in range(groups[g], groups[g + 1]):
                advantage = 0.0
                for k in range(cells[c], cells[c + 1]):
                    advantage += probability[k] * (value[successor[k]] - value[s])
                advantage = sign * (advantage + reward[c])
                if advantage < least:
                    least, answer = advantage, c
                if least <= best:
                    break
            if least > best:
                best, taken = least, answer
        out[s] = sign * best
        chosen[s] = taken


def answers(arena: Arena, value: Floats) -> Ints:
    """For each group the cell that the answering player takes."""
    chosen = np.empty(len(arena.group_cell) - 1, dtype=np.int64)
    _answers(*_parts(arena), value, chosen)
    return chosen


@njit(cache=True, nogil=True)
def _answers(sign, states, groups, cells, successor, probability, reward, value, chosen):  # type: ignore[no-untyped-def]
    for s in range(len(states) - 1):
        for g in range(states[s], states[s + 1]):
            least = math.inf
            for c in range(groups[g], groups[g + 1]):
                advantage = 0.0
                for k in range(cells[c], cells[c + 1]):
                    advantage += probability[k] * (value[successor[k]] - value[s])
                advantage = sign * (advantage + reward[c])
                if advantage < least:
                    least, chosen[g] = advantage, c
