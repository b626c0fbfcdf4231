"""A scenario set up in this process: world, ego, assertions and the testers' bodies."""

from __future__ import annotations

from dataclasses import dataclass

from cavsumo.agents.casting import teams, tester_bodies
from cavsumo.assertions.base import Assertion
from cavsumo.assertions.specs import assertions_of
from cavsumo.egos.base import Ego, Mission
from cavsumo.egos.specs import ego_of
from cavsumo.model.bodies import Body
from cavsumo.model.scenario import Scenario
from cavsumo.network.site import Site
from cavsumo.sumo.world import World


@dataclass(frozen=True)
class Setup:
    """The objects that episodes of one scenario share.

    Attributes:
        scenario: what is simulated.
        world, site, ego, assertions: as built from it.
        teams: the agents' bodies: for each agent the indices of those it owns.
        bodies: the testers' bodies.
    """

    scenario: Scenario
    world: World
    site: Site
    ego: Ego
    assertions: tuple[Assertion, ...]
    teams: tuple[tuple[int, ...], ...]
    bodies: tuple[Body, ...]

    @property
    def mission(self) -> Mission:
        """The data that the ego has before its first episode."""
        site, route, dt = self.site, self.site.route, self.world.dt
        script = self.scenario.script
        return Mission(
            site.net,
            route.edges,
            route.path,
            site.lights,
            dt,
            self.scenario.end,
            crossings=site.marked,
            surroundings=site.surroundings,
            approach_speed=None if script is None else script.ego.speed_mps,
        )

    def close(self) -> None:
        """End the ego and the simulation."""
        self.ego.close()
        self.world.close()


def make_setup(scenario: Scenario, site: Site, ego: Ego | None = None) -> Setup:
    """The setup of a scenario, with an ego of its own unless one is given."""
    ego = ego or ego_of(scenario)
    return Setup(
        scenario=scenario,
        world=World(scenario, site, ego),
        site=site,
        ego=ego,
        assertions=assertions_of(scenario),
        teams=teams(scenario),
        bodies=tester_bodies(scenario),
    )
