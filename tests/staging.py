"""Scripted episodes in real SUMO: the ego and the testers do at each moment what a test says."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cavsumo.agents.base import Agent
from cavsumo.assertions.base import Judgement
from cavsumo.egos.base import Acceleration, Command, Drive, Ego
from cavsumo.model.bodies import Action, Kind, clamped
from cavsumo.model.carriageway import Start
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.site import Site
from cavsumo.simulation.episode import Episode
from cavsumo.simulation.loop import play
from cavsumo.simulation.setup import make_setup

Speed = Callable[[Snapshot], float | Drive]  # the speed that the ego wants [m/s], or how it steers
Act = Callable[[Snapshot, BodyState], tuple[float, float]]  # a body's speed [m/s] and steering


class Scripted(Ego):
    """Drives at the speed that a function says, as fast as its limits let it come there."""

    depart_speed = 8.0

    def __init__(self, speed: Speed, start: float, decel: float) -> None:
        self.speed, self.depart_speed, self.decel = speed, start, decel

    def act(self, snapshot: Snapshot) -> Command:
        said = self.speed(snapshot)
        if isinstance(said, Drive):
            return said
        wanted = (said - snapshot.ego.v) / self.dt
        return Acceleration(max(-self.decel, min(3.0, wanted)))

    def reset(self, scene: Scene) -> None:
        self.dt = scene.dt


class Puppet(Agent):
    """Moves its bodies at the speed and steering that a function says."""

    def __init__(self, act: Act) -> None:
        self.act = act

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        return tuple(self._action(snapshot, body) for body in self.own(snapshot))

    def _action(self, snapshot: Snapshot, body: BodyState) -> Action:
        speed, steering = self.act(snapshot, body)
        return clamped(Action((speed - body.v) / self.scene.dt, steering), body.body.kind)


@dataclass(frozen=True)
class Placed(Site):
    """A site whose testers start where they are put."""

    places: tuple[Start, ...] = ()

    def draw(
        self, kinds: Sequence[Kind], ego: Kind, start_speed: float | None, rng: np.random.Generator
    ) -> tuple[Start, ...]:
        return self.places


@dataclass
class Stage:
    """A network on which episodes are scripted."""

    plan: BatchPlan
    site: Site

    def beside(self, along: float, aside: float, turn: float, v: float = 0.0) -> Start:
        """A start beside the ego's path, so far to its left, turned so much against it."""
        x, y, o = self.site.route.path.at(along)
        place = x - aside * math.sin(o), y + aside * math.cos(o)
        return Start(*place, math.remainder(o + turn, math.tau), v=v)

    def play(
        self,
        name: str,
        ego: Speed,
        *,
        places: Sequence[Start],
        testers: Act = lambda snapshot, body: (0.0, 0.0),
        start: float = 8.0,
        decel: float = 9.0,
        kind: str = "pedestrian",
        end: float = 60.0,
        **params: bool | float,
    ) -> tuple[Judgement, Episode]:
        """One episode: what the assertions, named with blanks between, say, and what happened."""
        names = tuple(name.split())
        site = Placed(
            **{f.name: getattr(self.site, f.name) for f in dataclasses.fields(Site)},
            places=tuple(places),
        )
        settings = {
            "testers": len(places),
            "assertions": names,
            "assertion_params": params,
            "kind": kind,
            "end": end,
        }
        scenario = self.plan.scenario.model_copy(update=settings)
        setup = make_setup(scenario, site, Scripted(ego, start, decel))
        agents = [Puppet(testers) for _ in setup.teams]
        try:
            episode = play(setup, agents, 1)
        finally:
            setup.close()
        return episode.judgement, episode
