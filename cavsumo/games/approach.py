"""Approaching the fixed point of T V + shift by jumps and, where these stall, by strategy
iteration.

*Jumps* go to the value of the pair of policies that attains T V (Newton's method, policy iteration
on both players at once), with sweeps between them. They are fast but may cycle. Then *strategy
iteration* takes over for a round (Hoffman and Karp 1966; Patek and Bertsekas 1999 for stochastic
shortest paths): the tester holds a proper policy, the ego's best reply is computed by policy
iteration in a decision process in which all its policies are proper, and the tester's policy is
improved where that raises the value. From a proper policy every improved one is proper: if V <= r +
P V held for every reply and some reply kept the play from the goals, the mean of r in that
recurrent class would be at least 0, against the assumption that every end component without goals
has a negative gain. So V rises to the value, in finitely many steps in readings A and C. Where
rounding, or a shift that outweighs a gain, breaks that, states fall back to the proper policy that
is known from the graph.

Only values of proper pairs are computed (``plays``), and everything is bounded: jumps, policies,
replies; each takes time in proportion to the game's outcomes, except direct solutions of at most
``pairs.FALLBACK`` states.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from cavsumo.games.model import Floats
from cavsumo.games.plays import Play, made_proper, stranded, value_of

TURNS = 12  # of jumps and of policies, in turn
JUMPS = 60  # to the value of a pair, at most, in a turn
SWEEPS = 64  # where a pair's value is not found
PATIENCE = 4  # jumps in a row that do not halve the residual, before policies are held
POLICIES = 8  # of the tester, in a turn
REPLIES = 100  # of the ego to each, at most
NEAR = 100.0  # times the residual wanted, within which there are only jumps
Tell = Callable[[str, float], None]  # called with the current step and the residual


class Approximation(NamedTuple):
    """The best approximation found.

    Attributes:
        value: V, with its last entry 0.
        pair: attains T V.
        left: the largest |T V + shift - V|.
    """

    value: Floats
    pair: Any
    left: float


def approach(
    play: Play,
    value: Floats,
    shift: Floats,
    residual: float,
    doing: str,
    tell: Tell,
    *,
    near: Any = None,
    steps: Floats | None = None,
) -> Approximation:
    """V with |T V + shift - V| <= residual if possible.

    ``near`` is the pair that V is nearly the value of, if one is known: then there are no sweeps,
    as a sweep adds up rounding errors on its way. ``steps``: as in ``pairs``.
    """
    best = _by_jumps(play, value, shift, residual, doing, tell, near, steps)
    if best.left <= 3.0 * residual:
        return best
    held = play.improved(play.first, best.value, residual)  # any guess
    for _ in range(TURNS):
        found, better = _by_policies(play, held, best.value, shift, residual, doing, tell)
        best = min(best, found, key=lambda one: one.left)
        if better is None or best.left <= 3.0 * residual:
            break
        held = better
        again = _by_jumps(play, found.value, shift, residual, doing, tell, found.pair, steps)
        best = min(best, again, key=lambda one: one.left)
        if best.left <= 3.0 * residual:
            break
    return best


def _by_jumps(
    play: Play,
    value: Floats,
    shift: Floats,
    residual: float,
    doing: str,
    tell: Tell,
    near: Any,
    steps: Floats | None,
) -> Approximation:
    """Jump until the residual is small, or no longer halves."""
    sweeps, before, stuck = play.sweeps if near is None else 0, near, 0
    best = Approximation(value, None, np.inf)
    for _ in range(JUMPS):
        advantage, pair = play.backup(value)
        advantage += shift
        left = float(np.abs(advantage).max())
        tell(doing, left)
        stuck = 0 if left < 0.5 * best.left else stuck + 1
        if left < best.left or best.pair is None:
            best = Approximation(value.copy(), pair, left)
        if left <= residual or stuck > PATIENCE:
            break
        proper = made_proper(play, pair, value)
        same = _same(proper, before)
        jump = value_of(play, proper, value, shift, 0.25 * residual, same, steps)
        before = proper
        value = value + advantage if jump is None else jump
        if jump is None or left > NEAR * residual:
            for _ in range(SWEEPS if jump is None else sweeps):
                play.sweep(value, shift)
    return best


def _same(pair: Any, before: Any) -> bool:
    """Whether two pairs of policies of readings A and C are the same."""
    return isinstance(pair, np.ndarray) and before is not None and bool((pair == before).all())


def _by_policies(
    play: Play, held: Any, value: Floats, shift: Floats, residual: float, doing: str, tell: Tell
) -> tuple[Approximation, Any]:
    """Some steps of strategy iteration: the best approximation, and the policy to continue with.

    The policy is None if no policy is better, or a value was not found.
    """
    best = Approximation(value, None, np.inf)
    for _ in range(POLICIES):
        found = _worst(play, held, value, shift, residual)
        if found is None:  # the way to a goal is too long for floats
            found = _worst(play, play.first, value, shift, residual)
        if found is None:
            return best, None
        value, held = found
        advantage, pair = play.backup(value)
        left = float(np.abs(advantage + shift).max())
        tell(doing, left)
        if left < best.left:
            best = Approximation(value.copy(), pair, left)
        better = play.improved(held, value, 0.25 * residual)
        if left <= residual or np.array_equal(better, held):
            return best, None
        held = better
    return best, held


def _worst(
    play: Play, held: Any, value: Floats, shift: Floats, residual: float
) -> tuple[Floats, Any] | None:
    """The value of the tester's policy against its worst ego, and the policy, made proper.

    None when a value is not found.
    """
    before = None
    for _ in range(REPLIES):
        advantage, pair = play.reply(held, value)
        if before is not None and float((advantage + shift).min()) >= -0.25 * residual:
            break
        lost = stranded(play, pair)
        if lost.any():  # then also where it was proper before, the ego may have found a way
            held, before = play.held_first(held, lost), None
            continue
        found = value_of(play, pair, value, shift, 0.1 * residual, True)
        if found is None:
            return None
        value, before = found, pair
    return value, held
