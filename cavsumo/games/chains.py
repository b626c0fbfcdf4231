"""The total reward of a Markov chain over an infinite horizon.

The limit over n of E[r_1 + ... + r_n]: in a recurrent class it is plus or minus infinity by the
sign of the mean reward g. With g = 0 it exists if the stationary mean of every phase of the class
is 0 (a class of period 2 that earns +1, -1, +1, ... has none); then V = r + P V with mean 0 in the
stationary distribution. A state that may reach classes of both infinities has no value; nor has a
state that may reach a class without a limit, unless it also reaches an infinite class.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

Number = Fraction | float
TOLERANCE = 1e-11  # relative, by which floats count as 0


class Chain(NamedTuple):
    """A Markov chain with rewards.

    Attributes:
        rows: for each state its successors with probabilities; none at goals.
        reward: expected, of each state.
    """

    rows: Sequence[dict[int, Number]]
    reward: Sequence[Number]


def values(chain: Chain, exact: bool) -> list[Number | None]:
    """The total reward from each state, None where it is undefined."""
    n = len(chain.rows)
    found: list[Number | None] = [Fraction(0) if not row else None for row in chain.rows]
    signs = {(math.inf,): set[int](), (-math.inf,): set[int](), (None,): set[int]()}
    settled = {s for s in range(n) if not chain.rows[s]}
    for members in _recurrent(chain):
        result = _class_values(chain, members, exact)
        if isinstance(result, tuple):
            signs[result].update(members)
        else:
            settled.update(members)
            for state, value in zip(members, result, strict=True):
                found[state] = value
    up, down, none = (_leading_to(chain, targets) for targets in signs.values())
    finite = [s for s in range(n) if s not in up | down | none | settled]
    for state in up ^ down:
        found[state] = math.inf if state in up else -math.inf
    known = {s: number for s in settled if (number := found[s]) is not None}
    solved = _solve(
        [{s: p for s, p in chain.rows[i].items() if s not in known} for i in finite],
        [
            chain.reward[i]
            + sum((p * known[s] for s, p in chain.rows[i].items() if s in known), Fraction(0))
            for i in finite
        ],
        finite,
        exact,
    )
    for state, value in zip(finite, solved, strict=True):
        found[state] = value
    return found


def _recurrent(chain: Chain) -> list[list[int]]:
    """The recurrent classes that are not goals."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    n = len(chain.rows)
    edges = [(s, t) for s, row in enumerate(chain.rows) for t, p in row.items() if p]
    source, target = np.array(edges, dtype=np.int64).reshape(-1, 2).T
    graph = csr_matrix((np.ones(len(edges)), (source, target)), shape=(n, n))
    count, labels = connected_components(graph, directed=True, connection="strong")
    closed = np.ones(count, dtype=bool)
    closed[labels[source[labels[source] != labels[target]]]] = False
    classes: dict[int, list[int]] = {}
    for state in range(n):
        if closed[labels[state]] and chain.rows[state]:
            classes.setdefault(int(labels[state]), []).append(state)
    return list(classes.values())


def _leading_to(chain: Chain, targets: set[int]) -> set[int]:
    """The states from which a target can be reached, targets included."""
    if not targets:
        return set()
    before: dict[int, list[int]] = {}
    for state, row in enumerate(chain.rows):
        for successor, p in row.items():
            if p:
                before.setdefault(successor, []).append(state)
    found, waiting = set(targets), list(targets)
    while waiting:
        for state in before.get(waiting.pop(), []):
            if state not in found:
                found.add(state)
                waiting.append(state)
    return found


def _class_values(
    chain: Chain, members: list[int], exact: bool
) -> list[Number] | tuple[float | None]:
    """Values in a recurrent class, or its sign when they are infinite, (None,) when undefined."""
    weights = _stationary(chain, members, exact)
    phases = _phases(chain, members)
    earned = [Fraction(0)] * (max(phases) + 1)
    for state, weight, phase in zip(members, weights, phases, strict=True):
        earned[phase] += weight * chain.reward[state]  # type: ignore[assignment]
    scale = max(abs(float(chain.reward[s])) for s in members)
    mean = sum(earned)
    if not _zero(mean, scale, exact):
        return (math.inf if mean > 0 else -math.inf,)
    if not all(_zero(part, scale, exact) for part in earned):
        return (None,)
    first, rest = members[0], members[1:]
    relative = _solve(
        [{t: p for t, p in chain.rows[s].items() if t != first} for s in rest],
        [chain.reward[s] for s in rest],
        rest,
        exact,
    )
    shape: list[Number] = [Fraction(0), *relative]
    offset = sum((w * v for w, v in zip(weights, shape, strict=True)), Fraction(0))
    return [value - offset for value in shape]


def _zero(number: Number, scale: float, exact: bool) -> bool:
    return number == 0 if exact else abs(float(number)) <= TOLERANCE * scale


def _stationary(chain: Chain, members: list[int], exact: bool) -> list[Number]:
    """The stationary distribution of a recurrent class: expected visits between visits to one."""
    first, rest = members[0], members[1:]
    into: dict[int, dict[int, Number]] = {s: {} for s in rest}
    start: dict[int, Number] = {s: Fraction(0) for s in rest}
    for state in members:
        for successor, p in chain.rows[state].items():
            if successor == first:
                continue
            if state == first:
                start[successor] += p
            else:
                into[successor][state] = p
    visits = [Fraction(1), *_solve([into[s] for s in rest], list(start.values()), rest, exact)]
    total = sum(visits, Fraction(0))
    return [visit / total for visit in visits]


def _phases(chain: Chain, members: list[int]) -> list[int]:
    """The phase of each state of a recurrent class, 0 to period - 1."""
    depth, waiting, period = {members[0]: 0}, [members[0]], 0
    while waiting:
        state = waiting.pop()
        for successor, p in chain.rows[state].items():
            if not p:
                continue
            if successor in depth:
                period = math.gcd(period, depth[state] + 1 - depth[successor])
            else:
                depth[successor] = depth[state] + 1
                waiting.append(successor)
    return [depth[state] % period for state in members]


def _solve(
    rows: list[dict[int, Number]], right: Sequence[Number], names: list[int], exact: bool
) -> list[Number]:
    """x with x = right + rows x; the keys of the rows are names."""
    place = {name: i for i, name in enumerate(names)}
    if not names:
        return []
    if exact:
        return _eliminate([{place[s]: p for s, p in row.items()} for row in rows], list(right))
    from scipy.sparse import csr_matrix, identity
    from scipy.sparse.linalg import splu

    n = len(names)
    entries = [(i, place[s], float(p)) for i, row in enumerate(rows) for s, p in row.items()]
    i, j, p = (
        (np.array(column) for column in zip(*entries, strict=True)) if entries else ([], [], [])
    )
    system = identity(n, format="csc") - csr_matrix((p, (i, j)), shape=(n, n)).tocsc()
    solution: list[Number] = (
        splu(system.tocsc()).solve(np.array([float(b) for b in right])).tolist()
    )
    return solution


def _eliminate(rows: list[dict[int, Number]], right: list[Number]) -> list[Number]:
    """The same in rationals, by elimination without pivoting: I - P is an M-matrix."""
    n = len(rows)
    for k in range(n):
        stay = rows[k].pop(k, Fraction(0))
        rows[k] = {j: p / (1 - stay) for j, p in rows[k].items()}
        right[k] = right[k] / (1 - stay)
        for i in range(n):
            factor = rows[i].pop(k, None) if i != k else None
            if factor:
                right[i] += factor * right[k]
                for j, p in rows[k].items():
                    rows[i][j] = rows[i].get(j, Fraction(0)) + factor * p
    return right
