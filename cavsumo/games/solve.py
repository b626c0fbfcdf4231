"""Expectiminimax values and policies (seed, eq. 3), between certified bounds.

1. Decide whether the game is solvable; refuse it with a witness when it is not.
2. Start from a proper tester policy, the one by which the almost-sure region was found.
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
from cavsumo.games.certificate import Certificate, holds, rises
from cavsumo.games.components import EPSILON
from cavsumo.games.flow import best_order
from cavsumo.games.model import Bools, Floats, Game
from cavsumo.games.plays import Play, play_of, time_of, value_of
from cavsumo.games.readings import Reading
from cavsumo.games.regions import keeping
from cavsumo.games.solvable import Verdict, solvability

PRECISION = 1e-6
JUMPS = 400  # to the value of a pair, at most, in each of the three solutions
SWEEPS = 512  # between two jumps, at most
ATTEMPTS = 12  # at a certificate
NEAR = 100.0  # times the residual wanted, within which there are only jumps
Tell = Callable[[str, float], None]  # called with what is being done and the residual


class Unsolvable(CavsumoError):
    """The game is not solvable; ``verdict`` has the witness."""

    def __init__(self, game: Game, verdict: Verdict) -> None:
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

    verdict: Verdict
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


def _start(game: Game, verdict: Verdict, play: Play, tell: Tell) -> Floats:
    """Nearly the value of the tester policy by which the region was found, against its worst ego.

    In reading B: of the policy that mixes all moves by which states joined, against an ego that
    mixes all of its own.
    """
    scale = float(np.abs(play.arena.reward).max(initial=0.0)) or 1.0
    value = np.zeros(play.arena.size + 1)
    if verdict.reading is Reading.B:
        return value
    first = play_of(game, verdict.reading, play.arena.states, verdict.proper.moves)
    value, *_ = _approach(first, value, 0.0, 0.1 * scale, "a first policy", tell, jumps=8)
    return value


def _certified(
    game: Game, verdict: Verdict, play: Play, value: Floats, precision: float, tell: Tell
) -> Certificate:
    """Bounds that hold, as close as was asked for if floats allow it."""
    scale = float(np.abs(play.arena.reward).max(initial=0.0)) or 1.0
    value, pair, _ = _approach(play, value, 0.0, 1e-4 * scale, "the value", tell)
    time = time_of(play, pair)
    steps = np.append(np.ones(play.arena.size), 0.0) if time is None else time
    best, e = None, precision / (3.0 * float(steps.max()))
    for _ in range(ATTEMPTS):
        e = max(e, _coarseness(game, play, value))
        found = _bounds(game, verdict, play, value, steps, e, tell)
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


def _coarseness(game: Game, play: Play, value: Floats) -> float:
    """The least e for which bounds can be found and proven: some units of the last place."""
    whole = np.zeros(game.n_states)
    whole[play.arena.states] = value[:-1]
    _, error = rises(game, whole)
    return 4.0 * float(error.max(initial=0.0)) + 24.0 * EPSILON * float(np.abs(value).max())


def _bounds(
    game: Game,
    verdict: Verdict,
    play: Play,
    value: Floats,
    steps: Floats,
    e: float,
    tell: Tell,
) -> Certificate:
    """The solutions of the game with rewards lowered and raised by e."""
    low, low_pair, _ = _approach(play, value - e * steps, -e, 0.5 * e, "lower bound", tell)
    high, high_pair, _ = _approach(play, low + 2.0 * e * steps, e, 0.5 * e, "upper bound", tell)
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
    shift: float,
    residual: float,
    doing: str,
    tell: Tell,
    jumps: int = JUMPS,
) -> tuple[Floats, Any, float]:
    """V with |T V + shift - V| <= residual if it can be had, the pair that attains T V, the rest.

    Returns the best V that was met.
    """
    sweeps, before, stuck = play.sweeps, None, 0
    best: tuple[Floats, Any, float] = (value, None, np.inf)
    for _ in range(jumps):
        backed_up, pair = play.backup(value)
        backed_up[:-1] += shift
        left = float(np.abs(backed_up - value).max())
        tell(doing, left)
        stuck = 0 if left < 0.5 * best[2] else stuck + 1
        if left < best[2] or best[1] is None:
            best = (value.copy(), pair, left)
        if left <= residual or (stuck > 6 and left <= 3.0 * residual):
            break
        jump = value_of(play, pair, backed_up, shift, 0.25 * residual, _same(pair, before))
        before = pair
        if jump is None or stuck > 15:
            sweeps, stuck = min(SWEEPS, max(1, 2 * sweeps)), 0
        value = backed_up if jump is None else jump
        if jump is None or left > NEAR * residual:  # a sweep adds up rounding errors on its way
            for _ in range(sweeps):
                play.sweep(value, shift)
    return best


def _same(pair: Any, before: Any) -> bool:
    """Whether two pairs of policies of readings A and C are the same."""
    return isinstance(pair, np.ndarray) and before is not None and bool((pair == before).all())
