"""SUMO's simulation: one for each episode, or one for several episodes.

It calls SUMO through given functions, so that ``world`` stays the one boundary.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

from cavsumo.egos.base import Ego
from cavsumo.errors import SimulationError
from cavsumo.model.departures import Attributes, Demand
from cavsumo.model.scenario import Scenario, Simulation
from cavsumo.network.site import Site
from cavsumo.sumo.calls import direct
from cavsumo.sumo.demand import BEYOND_S, Departures, Lights, cleared, noted, types_only
from cavsumo.sumo.options import OPTIONS
from cavsumo.sumo.recorded_demand import route_file, types_told
from cavsumo.sumo.vehicle_types import type_file


class Simulations:
    """The simulations of a scenario, one at a time.

    Args:
        sumo: SUMO's functions.
        folder: where files for SUMO may be written.

    Attributes:
        routes: the file of the background demand, None for empty roads.
    """

    def __init__(self, sumo: Any, scenario: Scenario, site: Site, ego: Ego, folder: Path) -> None:
        self._sumo, self._scenario, self._site = sumo, scenario, site
        self._step = direct(sumo.simulation, "step")
        self._types = folder / "types.add.xml"
        self._types.write_text(type_file(scenario, ego), encoding="utf-8")
        self._kept = folder / "kept.add.xml"  # what stays of the demand when we send it ourselves
        self._recorded = folder / "recorded.rou.xml"  # departures that are played back
        self._net, self.routes = scenario.net_file, scenario.routes_file
        if site.demand is not None:
            self.routes = folder / "traffic.rou.xml"
            self.routes.write_text(site.demand, encoding="utf-8")
        self._demand: Demand | None = None
        self._departures: Departures | None = None

    def begin(self, seed: int, simulation: Simulation, demand: Demand | None = None) -> None:
        """Start SUMO, or put it back to how it was when it started (``World.reset``).

        ``demand``: recorded departures in place of the scenario's demand, in a simulation of their
        own.
        """
        if simulation == "same" and self._departures is not None:
            cleared(self._sumo)
            self._lights.restore()
            self._departures.begin()
            return
        self._departures = None
        self._sumo.close()
        if simulation == "own":
            routes = self.routes
            if demand is not None:
                routes = self._recorded
                routes.write_text(route_file(demand), encoding="utf-8")
            self._sumo.start(self.command(seed, routes))
            self.set_light()
        else:
            self._start_shared(seed)
        route = self._site.route
        self._sumo.route.add("cavsumo_ego", list(route.edges))
        self._sumo.route.add("cavsumo_tester", [route.edges[0]])

    def advance(self) -> None:
        """One timestep of SUMO."""
        if self._departures is not None:
            self._departures.send()
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
        """The command line of SUMO; without routes the types of a demand that is sent by us."""
        scenario = self._scenario
        more = [*scenario.additional_files, self._types]
        if routes is None and self._kept.exists():
            more.append(self._kept)
        files = ["-n", str(self._net), "-a", ",".join(str(f) for f in more)]
        if routes is not None:
            files += ["-r", str(routes)]
        options = [word for k, v in OPTIONS.items() for word in (f"--{k}", v)]
        clock = ["--step-length", f"{scenario.step_length:g}", "--seed", str(seed % 2**31)]
        return ["sumo", *files, *options, *clock]

    def _start_shared(self, seed: int) -> None:
        """Start SUMO without the demand, which each episode then sends by itself."""
        if self._demand is None:
            self._demand = self._noted()
        self._sumo.start(self.command(seed, None))
        self.set_light()
        self._lights = Lights(self._sumo)
        self._departures = Departures(self._sumo, self._demand, self._scenario.step_length)

    def _noted(self) -> Demand:
        """The demand, as SUMO carries it out without ego and testers."""
        if self.routes is None:
            return Demand()
        self._kept.write_text(types_only(self.routes), encoding="utf-8")
        self._sumo.start(self.command(1, self.routes))
        demand = noted(self._sumo, self._scenario.end + BEYOND_S)
        self._sumo.close()
        return demand
