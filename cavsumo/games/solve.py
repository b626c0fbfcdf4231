"""Expectiminimax values and policies (seed, eq. 3), between certified bounds.

1. Decide whether the game is solvable; refuse it with a witness when it is not.
2. Start from the pair of policies that a few sweeps from V = 0 come to; where that pair does not
   reach a goal, from a proper tester policy, the one by which the almost-sure region was found.
3. Repeat: a Gauss-Seidel sweep of the Bellman operator T, then jump to the value of the pair of
   policies that attains it (policy iteration on both players at once). Where a pair has no value
   or nothing improves, more sweeps come between jumps: value iteration converges from anywhere.
4. Solve the game once more with every reward lowered by a little e, and once with it raised: when
   the residuals are below e, the two solutions satisfy the inequalities of ``certificate``, so
   they enclose the value whatever happened before. e follows from the precision that is asked
   for and the expected number of steps, as each step shifts the value by e.

Nothing relies on a small change of V per iteration: where goals are approached slowly, that says
nothing about how far V is from the value.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from cavsumo.errors import CavsumoError
from cavsumo.games.certificate import Certificate, advantages_of, holds
from cavsumo.games.flow import best_order
from cavsumo.games.model import Bools, Floats, Game
from cavsumo.games.pairs import coarseness
from cavsumo.games.plays import Play, play_of, time_of, value_of
from cavsumo.games.readings import Reading
from cavsumo.games.regions import keeping
from cavsumo.games.solvable import Solvability, solvability

PRECISION = 1e-6
FIRST_SWEEPS = 4  # from V = 0
JUMPS = 400  # to the value of a pair, at most, in each of the three solutions
SWEEPS = 512  # between two jumps, at most
PATIENCE = 4  # jumps in a row that do not halve the residual, before there are more sweeps
ATTEMPTS = 12  # at a certificate
NEAR = 100.0  # times the residual wanted, within which there are only jumps
Tell = Callable[[str, float], None]  # called with what is being done and the residual


class Unsolvable(CavsumoError):
    """The game is not solvable; ``verdict`` has the witness."""

    def __init__(self, game: Game, verdict: Solvability) -> None:
        self.verdict = verdict
        super().__init__(f"not solvable in reading {verdict.reading}: {verdict.reason(game)}")


class NotCertified(CavsumoError):
    """No bounds could be proven in floating point."""


@dataclass(frozen=True, eq=False)
class Solution:
    """What is known of a game's value.

    Attributes:
        verdict: solvability and regions.
        certificate: the bounds and the policies that prove them. The tester's policy is the test:
            proper, and worth at least the lower bound against any ego.
        precision: which was asked for.
    """

    verdict: Solvability
    certificate: Certificate
    precision: float

    @property
    def lower(self) -> Floats:
        """Lower bound on the value of each state; -inf where no goal can be forced."""
        return self.certificate.lower

    @property
    def upper(self) -> Floats:
        """Upper bound."""
        return self.certificate.upper

    @property
    def width(self) -> float:
        """The largest difference between the bounds."""
        inside = np.isfinite(self.lower)
        return float((self.upper[inside] - self.lower[inside]).max(initial=0.0))

    @property
    def precise(self) -> bool:
        """Whether the precision asked for was reached."""
        return self.width <= self.precision


def _silent(_: str, __: float) -> None:
    """Tell nobody."""


def solve(
    game: Game,
    reading: Reading | str = Reading.A,
    precision: float = PRECISION,
    *,
    trim: bool = False,
    tell: Tell = _silent,
) -> Solution:
    """Bounds on the value of every state, at most ``precision`` apart, with optimal policies.

    Args:
        precision: absolute. Where floats are too coarse for it the bounds are as close as they
            allow (``Solution.precise``).
        trim: solve what can be solved: states from which no goal can be forced get -inf.
        tell: called now and then.

    Raises:
        Unsolvable: the game is not strongly solvable in this reading.
        NotCertified: the bounds found could not be proven.
    """
    reading = Reading(reading)
    if not precision > 0:
        raise ValueError(f"precision must be positive, got {precision!r}")
    tell("where goals can be forced", np.inf)
    verdict = solvability(game, reading)
    if verdict.cycle is not None or (verdict.trap is not None and not trim):
        raise Unsolvable(game, verdict)
    inside = verdict.proper.inside
    kept = None if inside.all() else keeping(game, reading, inside)
    tell("in which order values spread", np.inf)
    order = best_order(game, verdict.proper.layer, verdict.proper.moves)
    play = play_of(game, reading, order, kept)
    if not play.arena.size:
        return Solution(verdict, _trivial(game, reading, inside), precision)
    value = _start(game, verdict, play, tell)
    certificate = _certified(game, verdict, play, value, precision, tell)
    return Solution(verdict, certificate, precision)


def _trivial(game: Game, reading: Reading, inside: Bools) -> Certificate:
    """Nothing but goals, and perhaps states from which none can be forced."""
    value, none = np.where(inside, 0.0, -np.inf), np.zeros(game.n_cells)
    return Certificate(reading, value, value, none, none)


def _start(game: Game, verdict: Solvability, play: Play, tell: Tell) -> Floats:
    """The value of the pair of policies that a few sweeps come to, where that reaches a goal.

    Else nearly the value of the tester policy by which the region was found, against its worst ego.
    In reading B: 0.
    """
    value = np.zeros(play.arena.size + 1)
    if verdict.reading is Reading.B:
        return value
    none, scale = np.zeros_like(value), _scale(play)
    for _ in range(FIRST_SWEEPS):
        play.sweep(value, none)
    _, pair = play.backup(value)
    jump = value_of(play, pair, value, none, 0.1 * scale, precise=False)
    if jump is not None:
        return jump
    first = play_of(game, verdict.reading, play.arena.states, verdict.proper.moves)
    value, *_ = _approach(first, none, none, 0.1 * scale, "a first policy", tell, jumps=8)
    return value


def _scale(play: Play) -> float:
    """The size of rewards."""
    return float(np.abs(play.arena.reward).max(initial=0.0)) or 1.0


def _certified(
    game: Game, verdict: Solvability, play: Play, value: Floats, precision: float, tell: Tell
) -> Certificate:
    """Bounds that hold, as close as was asked for if floats allow it."""
    none = np.zeros_like(value)
    value, pair, left = _approach(play, value, none, 1e-4 * _scale(play), "the value", tell)
    time = time_of(play, pair)
    steps = np.append(np.ones(play.arena.size), 0.0) if time is None else time
    noise = _noise(game, verdict.reading, play, value, left)
    best, e = None, precision / (3.0 * float(steps.max()))
    for _ in range(ATTEMPTS):
        e = max(e, 1.25 * coarseness(value))
        found = _bounds(game, verdict, play, value, pair, steps, e, noise, tell)
        tell("checking the bounds", np.inf)
        width = _width(found) if holds(game, found) else np.inf
        if width <= precision:
            return found
        if width < np.inf and (best is None or width < _width(best)):
            best = found
        elif best is not None:
            break
        e *= 0.5 * precision / width if width < np.inf else 8.0
    if best is None:
        raise NotCertified("no bounds could be proven: the values are too large for floats")
    return best


def _width(found: Certificate) -> float:
    """The largest difference between the bounds."""
    inside = np.isfinite(found.lower)
    return float((found.upper[inside] - found.lower[inside]).max(initial=0.0))


def _noise(game: Game, reading: Reading, play: Play, value: Floats, left: float) -> Floats:
    """For each state how far rounding may take an advantage that ought to be 0, with room to spare.

    Most cells that matter lead to states of nearly the same value; only those that do not, such as
    an accident that throws far back, need more room than a unit of the last place.
    """
    whole = np.zeros(game.n_states)
    whole[play.arena.states] = value[:-1]
    advantage, error = advantages_of(game, whole)
    error *= 4.0
    near = np.flatnonzero(np.abs(advantage) <= 2.0 * (error + left))
    if reading is Reading.B:  # advantages cancel in a mixture
        near = np.arange(game.n_cells)
        error += 24.0 * coarseness(value)
    most = np.zeros(game.n_states)
    np.maximum.at(most, game.cell_state[near], error[near])
    return np.append(most[play.arena.states], 0.0)


def _bounds(
    game: Game,
    verdict: Solvability,
    play: Play,
    value: Floats,
    pair: Any,
    steps: Floats,
    e: float,
    noise: Floats,
    tell: Tell,
) -> Certificate:
    """The solutions of the game with rewards lowered and raised by e and some noise."""
    shift = np.append(np.maximum(e, noise[:-1]), 0.0)
    residual = max(0.5 * e, min(0.8 * e, coarseness(value)))
    low, low_pair, _ = _approach(
        play, value - e * steps, -shift, residual, "lower bound", tell, near=pair
    )
    high, high_pair, _ = _approach(
        play, low + 2.0 * e * steps, shift, residual, "upper bound", tell, near=low_pair
    )
    lower, upper = (np.where(verdict.proper.inside, 0.0, -np.inf) for _ in range(2))
    lower[play.arena.states], upper[play.arena.states] = low[:-1], high[:-1]
    return Certificate(
        verdict.reading,
        lower,
        upper,
        play.tester(game, low_pair, low),
        play.ego(game, high_pair, high),
    )


def _approach(
    play: Play,
    value: Floats,
    shift: Floats,
    residual: float,
    doing: str,
    tell: Tell,
    *,
    near: Any = None,
    jumps: int = JUMPS,
) -> tuple[Floats, Any, float]:
    """V with |T V + shift - V| <= residual if it can be had, the pair that attains T V, the rest.

    ``near`` is the pair that V is nearly the value of, if one is known: then there are no sweeps
    unless jumps do not help, as a sweep adds up rounding errors on its way. Returns the best V that
    was met.
    """
    sweeps, before, stuck = play.sweeps if near is None else 0, near, 0
    best: tuple[Floats, Any, float] = (value, None, np.inf)
    for _ in range(jumps):
        advantage, pair = play.backup(value)
        advantage += shift
        left = float(np.abs(advantage).max())
        tell(doing, left)
        stuck = 0 if left < 0.5 * best[2] else stuck + 1
        if left < best[2] or best[1] is None:
            best = (value.copy(), pair, left)
        if left <= residual or (stuck > 6 and left <= 3.0 * residual):
            break
        jump = value_of(play, pair, value, shift, 0.25 * residual, _same(pair, before))
        before = pair
        if jump is None or stuck > PATIENCE:
            sweeps, stuck = min(SWEEPS, max(1, 2 * sweeps)), 0
        value = value + advantage if jump is None else jump
        if jump is None or left > NEAR * residual:
            for _ in range(sweeps):
                play.sweep(value, shift)
    return best


def _same(pair: Any, before: Any) -> bool:
    """Whether two pairs of policies of readings A and C are the same."""
    return isinstance(pair, np.ndarray) and before is not None and bool((pair == before).all())
