"""The space of the encounters of an exposure: how many numbers one has, and who plays which part.

Each body has as many coordinates, uniform on [0, 1] by chance, as there are names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cavsumo.agents.recorded import Teams
from cavsumo.model.bodies import Kind
from cavsumo.model.carriageway import Start
from cavsumo.network.recorded_starts import start_record
from cavsumo.network.site import Site
from cavsumo.probability.stratified import Cut, cuts_of
from cavsumo.probability.tree import Floats


@dataclass(frozen=True)
class EncounterSpace:
    """Encounters at a site.

    Attributes:
        site: where they are.
        kind: of the bodies.
        teams: for each agent the indices of its bodies.
        names: the coordinates of each body.
    """

    site: Site
    kind: Kind
    teams: Teams
    names: tuple[str, ...]

    @property
    def bodies(self) -> int:
        """The number of bodies."""
        return sum(map(len, self.teams))

    @property
    def dimension(self) -> int:
        """How many numbers a vector has."""
        return self.bodies * len(self.names)

    def drawn(self, vector: Floats) -> list[dict[str, float]]:
        """The coordinates of a vector by name, for each body."""
        parts = vector.reshape(self.bodies, len(self.names))
        return [dict(zip(self.names, map(float, part), strict=True)) for part in parts]

    def cuts_at(self, shares: Mapping[str, float]) -> tuple[Cut, ...]:
        """The cuts where behaviour changes at these shares, in the order of the coordinates."""
        return cuts_of(self.names * self.bodies, shares)

    def told(
        self, starts: Sequence[Start], called: str, behaviours: Sequence[Mapping[str, Any]]
    ) -> tuple[dict[str, Any], ...]:
        """For each agent the memory with starts and behaviours of its bodies, these so called."""
        return tuple(
            {
                "starts": [list(start_record(self.site, starts[i])) for i in team],
                called: [behaviours[i] for i in team],
            }
            for team in self.teams
        )
