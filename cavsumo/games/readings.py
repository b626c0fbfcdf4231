"""The three readings of an SSP game: the order of the players' choices.

A: the tester commits first, to a pure choice, and the ego answers: max over a1 of min over a2.
   The tree of the seed's Figure 2, and the only reading whose tests hold against any ego.
B: both choose at once, with mixed strategies: a matrix game in each state.
C: the ego commits first: min over a2 of max over a1. An optimistic bound.

Always V_A <= V_B <= V_C (``docs/games.md``).
"""

from __future__ import annotations

from enum import StrEnum


class Reading(StrEnum):
    """A reading of the game."""

    A = "A"
    B = "B"
    C = "C"

    @property
    def order(self) -> str:
        """The order of moves in words."""
        return {
            "A": "the tester commits first",
            "B": "both choose at once",
            "C": "the ego commits first",
        }[self.value]
