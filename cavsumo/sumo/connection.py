"""SUMO's simulation, one for each episode: started for it, or begun in one that stands by.

A simulation that stands by has been started, and nothing else. In forks of its process it becomes
the simulations of many episodes, with the same bits as if each had been started.

It calls SUMO through given functions, so that ``world`` stays the one boundary.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

from cavsumo.egos.base import Ego
from cavsumo.errors import SimulationError
from cavsumo.model.departures import Attributes, Demand
from cavsumo.model.scenario import Scenario
from cavsumo.network.site import Site
from cavsumo.sumo.calls import direct
from cavsumo.sumo.late_routes import LateRoutes, refusal
from cavsumo.sumo.native import Library, keep_xml
from cavsumo.sumo.options import OPTIONS
from cavsumo.sumo.recorded_demand import route_file, types_told
from cavsumo.sumo.reseeding import reseed
from cavsumo.sumo.vehicle_types import type_file

STANDING_BY_SEED = 1  # of no episode: all generators are seeded anew


class Simulations:
    """The simulations of a scenario, one at a time.

    Args:
        sumo: SUMO's functions.
        folder: where files for SUMO may be written.

    Attributes:
        routes: the file of the background demand, None for empty roads.
        stood_by: whether the present one had stood by, so that another start costs much more.
    """

    def __init__(self, sumo: Any, scenario: Scenario, site: Site, ego: Ego, folder: Path) -> None:
        self._sumo, self._scenario, self._site = sumo, scenario, site
        self._step = direct(sumo.simulation, "step")
        keep_xml(sumo)
        self._types = folder / "types.add.xml"
        self._types.write_text(type_file(scenario, ego), encoding="utf-8")
        self._stands_by = self.stood_by = False
        self._late: LateRoutes | None = None
        self._recorded = folder / "recorded.rou.xml"  # departures that are played back
        self._net, self.routes = scenario.net_file, scenario.routes_file
        if site.demand is not None:
            self.routes = folder / "traffic.rou.xml"
            self.routes.write_text(site.demand, encoding="utf-8")

    def stand_by(self) -> None:
        """Start SUMO for the next episode, before its seed is known."""
        self._sumo.close()
        self._sumo.start(self.command(STANDING_BY_SEED, None))
        # SUMO makes tables of all walking areas and of all edges when they are first asked for.
        self._sumo.person.getIDList()
        self._sumo.simulation.convertRoad(0.0, 0.0)
        self._stands_by = True

    def lose(self) -> None:
        """Note that somebody else has started a simulation in this process meanwhile."""
        self._stands_by = False

    @cached_property
    def stand_by_refusal(self) -> str:
        """The reason why no simulation can stand by, as a clause; empty if one can."""
        if not Library(self._sumo).complete:
            return "this build of libsumo cannot seed a running simulation"
        return refusal(self.routes, self._scenario.additional_files)

    def begin(self, seed: int, demand: Demand | None = None) -> None:
        """Start SUMO, unless it stands by (``World.reset``).

        ``demand``: recorded departures in place of the scenario's demand.
        """
        routes = self.routes
        if demand is not None:
            routes = self._recorded
            routes.write_text(route_file(demand), encoding="utf-8")
        self.stood_by, self._stands_by, self._late = self._stands_by, False, None
        if self.stood_by:
            reseed(self._sumo, seed)
            if routes is not None:
                self._late = LateRoutes(self._sumo, routes)
        else:
            self._sumo.close()
            self._sumo.start(self.command(seed, routes))
        self.set_light()
        route = self._site.route
        first = 0 if demand is None or demand.ego is None else demand.ego.edge
        self._sumo.route.add("cavsumo_ego", list(route.edges[first:]))
        self._sumo.route.add("cavsumo_tester", [route.edges[0]])

    def advance(self) -> None:
        """One timestep of SUMO."""
        if self._late is not None:
            self._late.read()
        self._step(0.0)

    def set_light(self) -> None:
        """Set the first traffic light on the ego's route to its required phase."""
        start, lights = self._site.light, self._sumo.trafficlight
        if start is None:
            return
        program = lights.getProgram(start.light)
        if program != start.program:
            raise SimulationError(
                f"signal: traffic light {start.light!r} runs program {program!r}, not the "
                f"network's {start.program!r}"
            )
        lights.setPhase(start.light, start.phase)
        lights.setPhaseDuration(start.light, start.left)

    @cached_property
    def types_told(self) -> dict[str, Attributes] | None:
        """The vehicle types of the demand; None when departures would not tell all of it."""
        return types_told(self.routes, self._scenario.additional_files)

    def command(self, seed: int, routes: Path | None) -> list[str]:
        """The command line of SUMO; ``routes``: the route file, None for none."""
        scenario = self._scenario
        more = [*scenario.additional_files, self._types]
        files = ["-n", str(self._net), "-a", ",".join(str(f) for f in more)]
        if routes is not None:
            files += ["-r", str(routes)]
        options = [word for k, v in OPTIONS.items() for word in (f"--{k}", v)]
        clock = ["--step-length", f"{scenario.step_length:g}", "--seed", str(seed % 2**31)]
        return ["sumo", *files, *options, *clock]
