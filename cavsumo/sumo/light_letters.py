"""The letters of the traffic lights that snapshots show."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import chain

import libsumo

from cavsumo.network.site import Site
from cavsumo.sumo.calls import direct

Letters = tuple[tuple[str, ...], tuple[str, ...]]  # for the ego, for pedestrians at crossings


class LightLetters:
    """Reads the lights on the ego's path and at its crossings.

    Each light is asked once a timestep, however many of its links matter, and letters are looked up
    again only when some light has changed.
    """

    def __init__(self, site: Site) -> None:
        self._links = [(light.id, light.link) for light in site.lights]
        self._walks = [crossing.light for crossing in site.marked]
        self._names = sorted({name for name, _ in chain(self._links, filter(None, self._walks))})
        self._ask: Callable[[str], str] = direct(libsumo.trafficlight, "getRedYellowGreenState")
        self._shown: list[str] | None = None
        self._letters: Letters = (), ()

    def read(self) -> Letters:
        """The letters at this moment."""
        shown = list(map(self._ask, self._names))
        if shown != self._shown:
            self._shown, self._letters = shown, self._look_up(zip(self._names, shown, strict=True))
        return self._letters

    def _look_up(self, states: Iterable[tuple[str, str]]) -> Letters:
        """The letters of the links that matter."""
        shown = dict(states)
        return (
            tuple(shown[name][link] for name, link in self._links),
            tuple(shown[walk[0]][walk[1]] if walk else "" for walk in self._walks),
        )
