"""The rewards R of the testers' game, a stochastic shortest path problem.

Reaching the goal (the precondition of an assertion) earns GOAL; time and time on the carriageway
cost. Nothing else earns or costs, not even an unfair episode.
"""

from __future__ import annotations

import math
from collections.abc import Container, Sequence

from cavsumo.assertions.base import Judgement
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

GOAL = 100.0
TIME_COST = 1.0  # per second and agent
ROAD_COST = 1.0  # per second that a body's centre is on the carriageway
Feedback = tuple[list[float], bool]  # each agent's reward for a timestep, and whether the game ends


class RewardMonitor:
    """The rewards of one episode.

    Attributes:
        cost: total time of the testers' bodies on the carriageway [s].
        total: the agents' rewards together, undiscounted.
    """

    def __init__(self, scene: Scene, teams: Sequence[Sequence[int]]) -> None:
        self.cost = self.total = 0.0
        self._dt, self._roads, self._teams = scene.dt, scene.roads, teams
        self._over = False
        self._names = {body.id for body in scene.bodies}
        # Whether a body is on the carriageway, the place of that check, and the distance from there
        # within which it cannot change.
        self._on_road = [False] * len(scene.bodies)
        self._known = [(math.inf, math.inf, 0.0)] * len(scene.bodies)
        self._seen: tuple[BodyState, ...] = ()
        self._waiting = [-self._dt * TIME_COST] * len(teams)  # with no body on the road

    def rewards(
        self, successor: Snapshot, judgements: Sequence[Judgement], cheats: Container[str] = ()
    ) -> Feedback | None:
        """Each agent's reward for a timestep and whether the game ends; None once it is over.

        ``cheats``: bodies that broke the rules of the world, which earn nothing at the goal.
        """
        testers, on_road = successor.testers, self._on_road
        if testers is not self._seen:
            self._seen = testers
            if self._roads is not None:
                for i, (_, here_x, here_y, _, _) in enumerate(testers):
                    x, y, room = self._known[i]
                    if math.hypot(here_x - x, here_y - y) >= room and (here_x, here_y) != (x, y):
                        on_road[i], room = self._roads.on_carriageway.at(here_x, here_y)
                        self._known[i] = here_x, here_y, room
        walking = True in on_road
        if walking:
            self.cost += self._dt * sum(on_road)
        if self._over:
            return None
        rewards = self._waiting.copy()
        if walking:
            for a, team in enumerate(self._teams):
                rewards[a] -= self._dt * ROAD_COST * sum([on_road[i] for i in team])
        for judgement in judgements:
            if judgement.tester in self._names:  # a body reached the goal or made it impossible
                self._over = True
                for a, team in enumerate(self._teams):
                    names = [testers[i].id for i in team]
                    fair = judgement.triggered and judgement.tester not in cheats
                    if fair and judgement.tester in names:
                        rewards[a] += GOAL
        self.total += math.fsum(rewards)
        return rewards, self._over

    def lost(self) -> Feedback | None:
        """The last reward when the ego has left: a dead end for every agent."""
        if self._over:
            return None
        self._over = True
        rewards = [-self._dt * TIME_COST for _ in self._teams]
        self.total += math.fsum(rewards)
        return rewards, True
