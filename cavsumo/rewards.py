"""What the tester spends and earns: the reward R of the seed's game, as a shortest path problem.

Reaching the goal (the precondition of an assertion) is worth GOAL; time and time on the
carriageway cost. Everything else, an unfair episode included, is worth nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.assertions.base import Judgement
from cavsumo.scene import Scene
from cavsumo.snapshot import BodyState, Snapshot

GOAL = 100.0
TIME_COST = 1.0  # per second and agent
ROAD_COST = 1.0  # per second that a body's centre is on the carriageway


class Ledger:
    """The account of one episode.

    Attributes:
        cost: time that the testers' bodies spent on the carriageway, together [s].
        total: the agents' rewards together, undiscounted.
    """

    def __init__(self, scene: Scene, teams: Sequence[Sequence[int]]) -> None:
        self.cost = self.total = 0.0
        self._dt, self._roads, self._teams = scene.dt, scene.roads, teams
        self._over = False
        # Whether a body is on the carriageway, and how far it may still walk before that can
        # change; asking the map is dear, so it is asked no earlier.
        self._on_road = [False] * len(scene.bodies)
        self._leeway = [0.0] * len(scene.bodies)

    def rewards(
        self, successor: Snapshot, judgements: Sequence[Judgement]
    ) -> tuple[list[float], bool] | None:
        """Each agent's reward for a timestep and whether the game ends; None once it is over."""
        testers, on_road = successor.testers, self._on_road
        for i, body in enumerate(testers):
            if body.v > 0.0 or self._leeway[i] <= 0.0:
                self._look_up(i, body)
        if any(on_road):
            self.cost += self._dt * sum(on_road)
        if self._over:
            return None
        rewards = [-self._dt * TIME_COST] * len(self._teams)
        if any(on_road):
            for a, team in enumerate(self._teams):
                rewards[a] -= self._dt * ROAD_COST * sum([on_road[i] for i in team])
        for judgement in judgements:
            if judgement.tester:  # somebody reached the goal, or spoilt it
                self._over = True
                for a, team in enumerate(self._teams):
                    if judgement.triggered and judgement.tester in [testers[i].id for i in team]:
                        rewards[a] += GOAL
        self.total += sum(rewards)
        return rewards, self._over

    def lost(self) -> tuple[list[float], bool] | None:
        """The last reward when the ego got away: a dead end for every agent."""
        if self._over:
            return None
        self._over = True
        rewards = [-self._dt * TIME_COST for _ in self._teams]
        self.total += sum(rewards)
        return rewards, True

    def _look_up(self, i: int, body: BodyState) -> None:
        """Note whether a moving body's centre is on the carriageway."""
        self._leeway[i] -= body.body.kind.v_max * self._dt
        if self._roads is not None and self._leeway[i] <= 0.0:
            self._on_road[i] = self._roads.contains(body.x, body.y)
            self._leeway[i] = max(1e-3, self._roads.edge_distance(body.x, body.y))
