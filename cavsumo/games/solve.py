"""Expectiminimax values and policies (seed, eq. 3), between certified bounds.

1. Decide whether the game is solvable; refuse it with a witness when it is not.
2. Start from the value of the pair of policies after a few sweeps from V = 0, made proper where it
  does not reach a goal (``plays``).
3. Approach the fixed point of the Bellman operator T (``approach``).
4. Solve the game once more with every reward lowered by a little e, and once with it raised: when
  the residuals are below e, the two solutions satisfy the inequalities of ``certificate``, so they
  enclose the value independently of the steps before. e follows from the required precision and the
  expected number of steps, as each step shifts the value by e.

A small change of V per iteration is not a stopping rule: where goals are approached slowly, V may
still be far from the value. Every loop is bounded; a solver that does not reach the precision
reports the bounds or the residual that it reached (``NotCertified``).
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from cavsumo.errors import CavsumoError
from cavsumo.games.approach import Tell, approach
from cavsumo.games.arena import arena
from cavsumo.games.certificate import Certificate, holds
from cavsumo.games.components import EPSILON
from cavsumo.games.flow import best_order
from cavsumo.games.model import Bools, Floats, Game, Ints
from cavsumo.games.pairs import coarseness
from cavsumo.games.plays import Play, made_proper, time_of, value_of
from cavsumo.games.readings import Reading
from cavsumo.games.regions import keeping
from cavsumo.games.rounding import noise_of
from cavsumo.games.simultaneous import Simultaneous
from cavsumo.games.solvable import Solvability, solvability
from cavsumo.games.turn_based import TurnBased

PRECISION = 1e-6
FIRST_SWEEPS = 4  # from V = 0
ATTEMPTS = 12  # at a certificate


class Unsolvable(CavsumoError):
    """The game is not solvable; ``verdict`` has the witness."""

    def __init__(self, game: Game, verdict: Solvability) -> None:
        self.verdict = verdict
        super().__init__(f"not solvable in reading {verdict.reading}: {verdict.reason(game)}")


class NotCertified(CavsumoError):
    """No bounds were proven in floats or within the time limit; the message has the progress."""


@dataclass(frozen=True, eq=False)
class Solution:
    """The bounds on a game's value, with their proof.

    Attributes:
        verdict: solvability and regions.
        certificate: the bounds and the policies that prove them. The tester's policy is the test:
            proper, and worth at least the lower bound against any ego.
        precision: the required one.
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
        """Whether the required precision was reached."""
        return self.width <= self.precision


def _silent(_: str, __: float) -> None:
    """Report nothing."""


def solve(
    game: Game,
    reading: Reading | str = Reading.A,
    precision: float = PRECISION,
    *,
    trim: bool = False,
    time_limit: float | None = None,
    tell: Tell = _silent,
) -> Solution:
    """Bounds on the value of every state, at most ``precision`` apart, with optimal policies.

    Args:
        precision: absolute. If floats are too coarse for it, the bounds are as close as floats
            allow (``Solution.precise``).
        trim: solve the solvable part: states from which no goal can be forced get -inf.
        time_limit: seconds after which to give up, checked between steps.
        tell: called with each step for a progress display.

    Raises:
        Unsolvable: the game is not strongly solvable in this reading.
        NotCertified: the bounds found could not be proven, or not within the time limit.
    """
    reading = Reading(reading)
    if not precision > 0:
        raise ValueError(f"precision must be positive, got {precision!r}")
    tell = _within(time_limit, tell)
    tell("where goals can be forced", np.inf)
    verdict = solvability(game, reading)
    if verdict.cycle is not None or (verdict.trap is not None and not trim):
        raise Unsolvable(game, verdict)
    inside = verdict.proper.inside
    tell("in which order values spread", np.inf)
    order = best_order(game, verdict.proper.layer, verdict.proper.moves)
    if not len(order):
        return Solution(verdict, _trivial(game, reading, inside), precision)
    kept = None if inside.all() else keeping(game, reading, inside)
    play = _play(game, reading, order, kept, verdict.proper.moves)
    certificate = _certified(game, verdict, play, _start(play), precision, tell)
    return Solution(verdict, certificate, precision)


def _within(limit: float | None, tell: Tell) -> Tell:
    """A ``tell`` that raises NotCertified when the time limit has passed."""
    if limit is None:
        return tell
    end = time.monotonic() + limit

    def told(doing: str, left: float) -> None:
        if time.monotonic() > end:
            how_far = f", residual {left:.1e}" if np.isfinite(left) else ""
            raise NotCertified(f"not solved within {limit:g} s: it was at {doing}{how_far}")
        tell(doing, left)

    return told


def _play(game: Game, reading: Reading, states: Ints, kept: Bools | None, moves: Bools) -> Play:
    """The states of a game, in the order of sweeps, in a reading."""
    if reading is Reading.B:
        return Simultaneous(game, states, kept, moves)
    return TurnBased(arena(game, reading, states, kept), moves)


def _trivial(game: Game, reading: Reading, inside: Bools) -> Certificate:
    """The solution of a game of goals and states from which none can be forced."""
    value, none = np.where(inside, 0.0, -np.inf), np.zeros(game.n_cells)
    return Certificate(reading, value, value, none, none)


def _start(play: Play) -> Floats:
    """Nearly the value of the pair of policies after a few sweeps, made proper."""
    value = np.zeros(play.arena.size + 1)
    none = np.zeros_like(value)
    for _ in range(FIRST_SWEEPS if play.sweeps else 0):
        play.sweep(value, none)
    _, pair = play.backup(value)
    proper = made_proper(play, pair, value)
    jump = value_of(play, proper, value, none, 0.1 * play.arena.scale, precise=False)
    return value if jump is None else jump


def _certified(
    game: Game, verdict: Solvability, play: Play, value: Floats, precision: float, tell: Tell
) -> Certificate:
    """Proven bounds, within the required precision if floats allow it."""
    none = np.zeros_like(value)
    scale = play.arena.scale
    value, pair, left = approach(play, value, none, 1e-4 * scale, "the value", tell)
    expected = time_of(play, made_proper(play, pair, value))
    steps = np.append(np.ones(play.arena.size), 0.0) if expected is None else expected
    if left > 1e-3 * scale + 64.0 * EPSILON * scale * float(steps.max()):
        raise NotCertified(
            f"no bounds could be proven: the Bellman equation was met up to {left:.1e} only, with "
            f"rewards up to {scale:.3g}"
        )
    noise = _noise(game, verdict.reading, play, value, left)
    return _closest(game, verdict, play, _Near(value, pair, steps, noise), precision, tell)


class _Near(NamedTuple):
    """The approximate value before there are bounds.

    Attributes:
        value: nearly V.
        pair: attains T V.
        steps: nearly the expected numbers of steps to a goal.
        noise: bound on the rounding error of an advantage, for each state.
    """

    value: Floats
    pair: Any
    steps: Floats
    noise: Floats


def _closest(
    game: Game, verdict: Solvability, play: Play, near: _Near, precision: float, tell: Tell
) -> Certificate:
    """Bounds from one e after another, until they hold and are close enough."""
    best, e = None, precision / (3.0 * float(near.steps.max()))
    for _ in range(ATTEMPTS):
        e = max(e, 1.25 * coarseness(near.value))
        found = _bounds(game, verdict, play, near, e, tell)
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
    """For each state a bound on the rounding error of an advantage that is exactly 0."""
    whole = np.zeros(game.n_states)
    whole[play.arena.states] = value[:-1]
    if reading is Reading.B:  # advantages cancel in a mixture
        most = noise_of(game, whole, np.inf, 24.0 * coarseness(value))
    else:
        most = noise_of(game, whole, left, 0.0)
    return np.append(most[play.arena.states], 0.0)


def _bounds(
    game: Game, verdict: Solvability, play: Play, near: _Near, e: float, tell: Tell
) -> Certificate:
    """The solutions of the game with rewards lowered and raised by e and some noise."""
    value, pair, steps, noise = near
    shift = np.append(np.maximum(e, noise[:-1]), 0.0)
    residual = max(0.5 * e, min(0.8 * e, coarseness(value)))
    low, low_pair, _ = approach(
        play, value - e * steps, -shift, residual, "lower bound", tell, near=pair, steps=steps
    )
    high, high_pair, _ = approach(
        play,
        low + 2.0 * e * steps,
        shift,
        residual,
        "upper bound",
        tell,
        near=low_pair,
        steps=steps,
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
