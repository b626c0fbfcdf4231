"""Whether a game is solvable, with a witness if it is not.

A game is *strongly* solvable in a reading if (1) from every state the tester has a policy that is
proper (reaches a goal almost surely against any ego) and (2) every play that never does earns
minus infinity: every end component has negative gain. Then the Bellman operator has exactly one
fixed point. The seed's own definition demands less than (2): for each improper policy there is
*some* ego that makes it earn minus infinity (``proper.literally_solvable``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cavsumo.games.components import EPSILON, end_components, gain
from cavsumo.games.model import Bools, Game, Ints
from cavsumo.games.readings import Reading
from cavsumo.games.regions import Region, almost_sure_region, sure_region

NAMED = 12  # states in a message


@dataclass(frozen=True, eq=False)
class Trap:
    """States from which no tester policy reaches a goal almost surely.

    Attributes:
        states: those in which the ego can keep the play away from every goal for ever.
        lost: all states without a proper policy; from those that are not in ``states`` every
            attempt to reach a goal may lead into ``states``.
    """

    states: Ints
    lost: Ints


@dataclass(frozen=True, eq=False)
class Cycle:
    """A play for ever that does not cost infinitely much.

    Attributes:
        states: which it visits.
        cells: which it uses.
        gain: its mean reward per step; never proven negative.
    """

    states: Ints
    cells: Ints
    gain: float


@dataclass(frozen=True, eq=False)
class Solvability:
    """Whether a game is strongly solvable.

    Attributes:
        reading: of the game.
        proper: where the tester can force a goal almost surely.
        sure: where it can force one within a known number of steps.
        trap: why not (1); None when (1) holds.
        cycle: why not (2); None when (2) holds.
    """

    reading: Reading
    proper: Region
    sure: Region
    trap: Trap | None
    cycle: Cycle | None

    @property
    def solvable(self) -> bool:
        """Whether both conditions hold."""
        return self.trap is None and self.cycle is None

    def reason(self, game: Game) -> str:
        """Why the game is not solvable, in words; "" when it is."""
        reasons = []
        if self.trap is not None:
            reasons.append(_trap_in_words(game, self.trap, self.reading))
        if self.cycle is not None:
            reasons.append(_cycle_in_words(game, self.cycle))
        return "; ".join(reasons)


def solvability(game: Game, reading: Reading = Reading.A) -> Solvability:
    """Decide whether a game is strongly solvable, with a witness when it is not."""
    proper, sure = almost_sure_region(game, reading), sure_region(game, reading)
    trap = None
    if not proper.inside.all():
        trap = Trap(np.flatnonzero(proper.outside), np.flatnonzero(~proper.inside))
    return Solvability(reading, proper, sure, trap, free_cycle(game))


def free_cycle(game: Game) -> Cycle | None:
    """An end component whose gain is not negative, if there is one.

    If no reward is positive, its rewards are all 0, which the graph alone decides.
    """
    if not game.n_cells:
        return None
    negative = game.reward < -8.0 * EPSILON * game.magnitude
    if negative.all():
        return None
    if (game.reward <= 0).all():
        kept: Bools | None = ~negative
        found = end_components(game, kept)
        return _cycle(game, found[0].cells, 0.0) if found else None
    for component in end_components(game):
        if not negative[component.cells].all():
            best = gain(game, component)
            if not best.at_most < 0:
                return _cycle(game, best.cells, best.value)
    return None


def _cycle(game: Game, cells: Ints, value: float) -> Cycle:
    return Cycle(np.unique(game.cell_state[cells]), cells, value)


def _trap_in_words(game: Game, trap: Trap, reading: Reading) -> str:
    """The trap described in a sentence."""
    words = f"in {_states(game, trap.states)} the ego can keep the play from every goal for ever"
    if reading is not Reading.C:
        words += f" ({reading.order})"
    more = np.setdiff1d(trap.lost, trap.states)
    if len(more):
        words += f", and from {_states(game, more)} the tester cannot exclude getting there"
    return words


def _cycle_in_words(game: Game, cycle: Cycle) -> str:
    """The cycle described in a sentence."""
    moves = [
        f"{game.label(int(game.cell_state[c]))}: {game.tester_action[game.cell_row[c]]}, "
        f"{game.ego_action[c]}"
        for c in cycle.cells[:NAMED].tolist()
    ]
    more = ", ..." if len(cycle.cells) > NAMED else ""
    earns = "costs nothing" if abs(cycle.gain) < 1e-9 else f"earns {cycle.gain:.6g} a step"
    return (
        f"in {_states(game, cycle.states)} a play can go on for ever that {earns} "
        f"(state: actions of tester, ego; {'; '.join(moves)}{more})"
    )


def _states(game: Game, states: Ints) -> str:
    """A few states by name, the rest by number."""
    names = ", ".join(game.label(int(s)) for s in states[:NAMED])
    more = f" and {len(states) - NAMED} more" if len(states) > NAMED else ""
    return f"state{'' if len(states) == 1 else 's'} {names}{more}"
