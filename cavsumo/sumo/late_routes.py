"""A route file for a simulation that was started without it, to the same bits as with it.

SUMO opens its route files last when it starts, and then reads them piece by piece while the
simulation runs. While it reads it draws speed factors and random places, so a simulation that was
started for several seeds must not have read anything. Once it is seeded anew (``reseeding``), the
file is opened by SUMO's own function, and read before every timestep as SUMO does within it.

Flows with random departures draw from a generator of their own, which cannot be seeded again.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from cavsumo.sumo.native import Library
from cavsumo.sumo.recorded_demand import ENTERING, elements

FLOWS = frozenset({"flow", "personFlow", "containerFlow"})
READ_AT_START = ENTERING | {"calibrator"}  # in additional files


class LateRoutes:
    """The route file of a simulation that has made no timestep.

    Args:
        sumo: the module libsumo.
    """

    def __init__(self, sumo: Any, file: Path) -> None:
        self._time, self._library = sumo.simulation.getTime, Library(sumo)
        self._library.set_option("route-files", str(file))
        self._reader = self._library.open_routes()
        self.read()

    def read(self) -> None:
        """Read on where that is due; to be called before every timestep."""
        self._library.read_routes(self._reader, self._time())


def refusal(routes: Path | None, additional: Iterable[Path]) -> str:
    """The reason why the demand must be there when SUMO starts, as a clause; empty for none.

    Args:
        routes: the route file, if there is one.
        additional: SUMO's additional files.
    """
    try:
        for file in additional:
            if any(element.tag in READ_AT_START for element in elements(file)):
                return f"traffic enters from the additional file {str(file)!r}"
        for element in elements(routes) if routes is not None else ():
            if element.tag == "include":
                return f"the route file {str(routes)!r} includes others"
            if element.tag in FLOWS and _is_random(element):
                return f"flow {element.get('id', '')!r} has random departures"
    except (ElementTree.ParseError, OSError, ValueError, LookupError) as error:
        return f"the demand cannot be read: {error}"
    return ""


def _is_random(flow: Any) -> bool:
    """Whether the departures of a flow are drawn while the simulation runs."""
    return "probability" in flow.attrib or "(" in flow.get("period", "")
