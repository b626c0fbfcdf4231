"""Bounds on the value that can be checked without knowing how they were found.

With V = 0 at goals and q(c) = r(c) + sum over s' of T(c, s') V(s') for each cell c, a *lower*
bound L comes with a policy of the tester, an *upper* bound U with one of the ego, such that in
every state

    A:  q_L(c) >= L(s)  for every cell c of the tester's row;
        sum over c of ego(c) q_U(c) <= U(s)  for every row (the ego's reply to it)
    B:  sum of tester(c) q_L(c) >= L(s)  for every ego action;
        sum of ego(c) q_U(c) <= U(s)  for every tester action
    C:  sum of tester(c) q_L(c) >= L(s)  for every ego action (the tester's reply to it);
        q_U(c) <= U(s)  for every cell c of the ego's action

If every end component has negative gain (``components``), these inequalities give L <= V <= U,
and the tester's policy is proper and earns at least L against any ego: iterate the first one; a
play that never reached a goal would earn at least -constant, against the gain. All inequalities are
checked in floats with a margin for every rounding error or, on request, exactly in rationals.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from cavsumo.games.components import EPSILON
from cavsumo.games.model import Bools, Floats, Game, GameError, Ints
from cavsumo.games.readings import Reading
from cavsumo.games.rounding import advantages_of

ROOM = 64 * EPSILON  # by which the weights of a policy may miss 1


@dataclass(frozen=True, eq=False)
class Certificate:
    """Bounds with the policies that prove them.

    Attributes:
        reading: of the game.
        lower, upper: bounds on the value, shape (n,), 0 at goals, -inf where none can be forced.
        tester: for each cell the probability of its tester action, given what the tester knows
            (the state, in reading C the ego's action too).
        ego: for each cell the probability of its ego action, given what the ego knows (the state,
            in reading A the tester's action too).
    """

    reading: Reading
    lower: Floats
    upper: Floats
    tester: Floats
    ego: Floats


def holds(game: Game, certificate: Certificate) -> bool:
    """Whether the inequalities hold for any rounding."""
    kept = _kept(game, certificate)
    return (
        _policies(game, certificate, kept)
        and lower_holds(game, certificate.reading, certificate.lower, certificate.tester)
        and upper_holds(game, certificate.reading, certificate.upper, certificate.ego, kept)
    )


def lower_holds(game: Game, reading: Reading, lower: Floats, tester: Floats) -> bool:
    """Whether a lower bound is proven by a policy of the tester."""
    if not game.n_cells:
        return True
    if reading is Reading.A:
        return bool((_least(game, lower, np.flatnonzero(tester > 0), 1.0) >= 0).all())
    order, start, _ = game.replies
    inside = np.isfinite(lower[game.cell_state[order[start[:-1]]]])
    weights = tester[order]
    used = np.flatnonzero(weights > 0)
    gain = _least(game, lower, order[used], 1.0)
    return bool((_mixed(weights, used, gain, start)[inside] >= 0).all())


def upper_holds(game: Game, reading: Reading, upper: Floats, ego: Floats, kept: Bools) -> bool:
    """Whether an upper bound is proven by a policy of the ego.

    Cells that are not ``kept`` may lead out of the region where goals can be forced; the ego can
    make them arbitrarily bad.
    """
    if not game.n_cells:
        return True
    if reading is Reading.C:
        return bool((_least(game, upper, np.flatnonzero((ego > 0) & kept), -1.0) >= 0).all())
    used, start = np.flatnonzero(ego > 0), game.cell_start
    gain = _least(game, upper, used, -1.0)
    return bool((_mixed(ego, used, gain, start)[kept[start[:-1]]] >= 0).all())


def _least(game: Game, value: Floats, cells: Ints, sign: float) -> Floats:
    """The advantages of cells, with a sign, lowered by the largest rounding error."""
    advantage, error = advantages_of(game, value, cells)
    return sign * advantage - error


def _mixed(weights: Floats, used: Ints, gain: Floats, start: Ints) -> Floats:
    """Sums of weights times gains over the parts, lowered by the largest rounding error.

    Args:
        weights: of each entry of the parts.
        used: the entries with a positive weight, ascending.
        gain: of those.
        start: where the parts begin.
    """
    if len(used) == len(start) - 1 and (weights[used] == 1.0).all():
        in_turn = (start[:-1] <= used) & (used < start[1:])
        if in_turn.all():  # one in each part
            return gain
    product = np.zeros(len(weights))
    product[used] = weights[used] * gain
    total = np.add.reduceat(product, start[:-1])
    room = (np.diff(start) + 4) * EPSILON * np.add.reduceat(np.abs(product), start[:-1])
    return total - np.where(np.maximum.reduceat(weights, start[:-1]) == 1.0, 0.0, room)


def _kept(game: Game, certificate: Certificate) -> Bools:
    """The cells by which the tester stays where the bounds are finite."""
    from cavsumo.games.regions import keeping

    inside = np.isfinite(certificate.lower)
    if inside.all():
        return np.ones(game.n_cells, dtype=bool)
    return keeping(game, certificate.reading, inside)


def _policies(game: Game, certificate: Certificate, kept: Bools) -> bool:
    """Whether the weights are policies that use only the knowledge that the reading gives."""
    reading, tester, ego = certificate.reading, certificate.tester, certificate.ego
    inside = np.isfinite(certificate.lower)
    if not game.n_cells:
        return True
    if reading is Reading.A and game.fast:
        return _rows_and_answers(game, tester, ego, kept, inside)
    if (tester < 0).any() or (ego < 0).any() or (tester[~kept] > 0).any():
        return False
    good = _by_row(game, tester, inside) if reading is not Reading.C else True
    good &= _by_group(game, ego, inside) if reading is not Reading.A else True
    if reading is Reading.C:
        order, start, _ = game.replies
        state = game.cell_state[order[start[:-1]]]
        good &= _one(np.add.reduceat(tester[order], start[:-1])[inside[state]])
    if reading is Reading.A:
        rows = kept[game.cell_start[:-1]]
        good &= bool(((tester == 0.0) | (tester == 1.0)).all())
        good &= _one(np.add.reduceat(ego, game.cell_start[:-1])[rows])
    return bool(good)


def _rows_and_answers(game: Game, tester: Floats, ego: Floats, kept: Bools, inside: Bools) -> bool:
    """``_policies`` in reading A by a compiled loop."""
    from cavsumo.games.compiled import weights

    total = np.zeros(game.n_states)
    parts = game.cell_start, game.row_state, tester, ego, kept
    good = bool(weights.of_rows(*parts, total, ROOM))
    return good and _one(total[inside & ~game.goal])


def _by_row(game: Game, tester: Floats, inside: Bools) -> bool:
    """The tester's weights are those of rows and sum to 1 in each state."""
    rows = tester[game.cell_start[:-1]]
    total = np.bincount(game.row_state, rows, game.n_states)
    same = (np.repeat(rows, np.diff(game.cell_start)) == tester).all()
    return bool(same) and _one(total[inside & ~game.goal])


def _by_group(game: Game, ego: Floats, inside: Bools) -> bool:
    """The ego's weights are those of its actions and sum to 1 in each state."""
    order, start, _ = game.replies
    weights = ego[order[start[:-1]]]
    state = game.cell_state[order[start[:-1]]]
    total = np.bincount(state, weights, game.n_states)
    same = (np.repeat(weights, np.diff(start)) == ego[order]).all()
    return bool(same) and _one(total[inside & ~game.goal])


def _one(sums: Any) -> bool:
    """Whether all are 1 up to rounding; the checks treat them as divided by their sum."""
    return bool((np.abs(sums - 1.0) <= ROOM).all())


def holds_exactly(game: Game, certificate: Certificate) -> bool:
    """Whether the inequalities hold in rational arithmetic; for small games.

    Raises:
        GameError: the game's numbers are not known as rationals.
    """
    if game.exact is None:
        raise GameError("an exact check needs a game built from rationals")
    kept = _kept(game, certificate)
    if not _policies(game, certificate, kept):
        return False
    reading = certificate.reading
    low, high = _exact_worth(game, certificate.lower), _exact_worth(game, certificate.upper)
    by_row = [np.arange(a, b) for a, b in pairwise(game.cell_start)]
    if reading is not Reading.A:
        order, start, _ = game.replies
        by_group = [order[a:b] for a, b in pairwise(start)]
    single = [np.array([c]) for c in range(game.n_cells)]
    testers = single if reading is Reading.A else by_group
    egos = single if reading is Reading.C else by_row
    return all(
        _exact_mean(cells, certificate.tester, low) >= Fraction(certificate.lower[state])
        for cells, state in _judged(game, testers, certificate.tester, certificate.lower)
    ) and all(
        _exact_mean(cells, certificate.ego, high) <= Fraction(certificate.upper[state])
        for cells, state in _judged(game, egos, certificate.ego, certificate.upper)
        if kept[cells].all()
    )


def _judged(
    game: Game, parts: list[Ints], weights: Floats, bound: Floats
) -> list[tuple[Ints, int]]:
    """The parts in which a policy plays and the bound is finite, each with its state."""
    found = [(cells, int(game.cell_state[cells[0]])) for cells in parts]
    return [
        (cells, state)
        for cells, state in found
        if (weights[cells] > 0).any() and bound[state] > -np.inf
    ]


def _exact_mean(cells: Ints, weights: Floats, q: list[Fraction]) -> Fraction:
    """The mean of q over cells."""
    shares = {int(c): Fraction(float(weights[c])) for c in cells if weights[c] > 0}
    return sum((w * q[c] for c, w in shares.items()), Fraction(0)) / sum(shares.values())


def _exact_worth(game: Game, value: Floats) -> list[Fraction]:
    """q of every cell in rationals; 0 stands for -inf, which no used cell leads to."""
    assert game.exact is not None
    v = [Fraction(float(x)) if np.isfinite(x) else Fraction(0) for x in value]
    found = []
    for cell in range(game.n_cells):
        span = range(int(game.outcome_start[cell]), int(game.outcome_start[cell + 1]))
        mean = sum((game.exact.probability[k] * v[game.successor[k]] for k in span), Fraction(0))
        found.append(game.exact.reward[cell] + mean)
    return found
