"""Loops of ``regions`` (attractors), ``segments``, ``arena`` (cells laid out) and ``reach``."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def spread(  # type: ignore[no-untyped-def]
    entering, cells, cell_step, cell_lacking, cell_group,
    group_step, group_lacking, group_state, layer, state_lacking,
):  # fmt: skip
    """Each state that has joined counts down what leads to it; first come, first served."""
    joined = np.empty(len(layer), dtype=np.int64)
    count = 0
    for s in range(len(layer)):
        if layer[s] == 0:
            joined[count] = s
            count += 1
    done = 0
    while done < count:
        s = joined[done]
        done += 1
        step = layer[s] + 1
        for k in range(entering[s], entering[s + 1]):
            c = cells[k]
            cell_lacking[c] -= 1
            if cell_lacking[c] != 0:
                continue
            cell_step[c] = step
            g = cell_group[c]
            group_lacking[g] -= 1
            if group_lacking[g] != 0:
                continue
            group_step[g] = step
            t = group_state[g]
            state_lacking[t] -= 1
            if state_lacking[t] == 0:
                layer[t] = step
                joined[count] = t
                count += 1


@njit(cache=True, nogil=True)
def spans(start, which):  # type: ignore[no-untyped-def]
    """The concatenated ranges start[w] : start[w + 1]."""
    total = 0
    for w in which:
        total += start[w + 1] - start[w]
    found = np.empty(total, dtype=np.int64)
    i = 0
    for w in which:
        for k in range(start[w], start[w + 1]):
            found[i] = k
            i += 1
    return found


@njit(cache=True, nogil=True)
def gathered(start, successor, probability, which, number):  # type: ignore[no-untyped-def]
    """The outcomes of the cells ``which``, successors renumbered, and where each cell's begin."""
    begin = np.zeros(len(which) + 1, dtype=np.int64)
    for i, c in enumerate(which):
        begin[i + 1] = begin[i] + start[c + 1] - start[c]
    to, chance = np.empty(begin[-1], np.int32), np.empty(begin[-1])
    i = 0
    for c in which:
        for k in range(start[c], start[c + 1]):
            to[i] = number[successor[k]]
            chance[i] = probability[k]
            i += 1
    return begin, to, chance


@njit(cache=True, nogil=True)
def reaching(start, column):  # type: ignore[no-untyped-def]
    """As ``reach.reaching``: from the last state backward, over the entries in each column."""
    n = len(start) - 1
    begin = np.zeros(n + 1, dtype=np.int64)
    for k in range(start[n]):
        begin[column[k] + 1] += 1
    for s in range(n):
        begin[s + 1] += begin[s]
    place = begin[:-1].copy()
    source = np.empty(start[n], dtype=np.int32)
    for s in range(n):
        for k in range(start[s], start[s + 1]):
            source[place[column[k]]] = s
            place[column[k]] += 1
    found = np.zeros(n, dtype=np.bool_)
    waiting = np.empty(n, dtype=np.int64)
    found[n - 1] = True
    waiting[0], count, done = n - 1, 1, 0
    while done < count:
        s = waiting[done]
        done += 1
        for k in range(begin[s], begin[s + 1]):
            t = source[k]
            if not found[t]:
                found[t] = True
                waiting[count] = t
                count += 1
    return found
