"""Algorithm 5 of the seed: testers elect which one of them crosses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.agents.programmed import IDLE_DOC, MANOEUVRE_DOC, ProgrammedAgent
from cavsumo.agents.triggers import distance_ahead, ego_distance
from cavsumo.model.checks import choice, number
from cavsumo.model.snapshot import BodyState, Snapshot


@AGENTS.register("election")
class ElectionAgent(ProgrammedAgent):
    """Algorithm 5: of the bodies near the ego, only the elected one crosses.

    CAV-Gym elects the nearest by unsigned distance, those behind the ego included, which loses
    more tests the more pedestrians there are; the default rule elects the nearest ahead.
    """

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "distance_m": "a body nearer to the ego than this votes to cross [m]",
        "rule": "elect the nearest body 'ahead' of the ego, or the nearest 'unsigned' (CAV-Gym)",
        "idle": IDLE_DOC,
        "manoeuvre": MANOEUVRE_DOC,
    }

    def __init__(
        self,
        distance_m: float = 34.0,
        rule: str = "ahead",
        idle: str = "pavement",
        manoeuvre: str = "auto",
    ) -> None:
        super().__init__(idle, manoeuvre)
        self.distance_m = number("distance_m", distance_m, 0.0)
        self.rule = choice("rule", rule, ("ahead", "unsigned"))

    @classmethod
    def coordinate(cls, agents: Sequence[Agent], rng: np.random.Generator) -> None:
        members = [a for a in agents if isinstance(a, ElectionAgent)]
        coordinator = Coordinator(members, rng)
        for agent in members:
            agent.coordinator = coordinator

    coordinator: Coordinator

    def starts(self, i: int, snapshot: Snapshot, state: BodyState) -> bool:
        return self.coordinator.elected(snapshot) == self.owned[i]

    def vote(self, snapshot: Snapshot, state: BodyState) -> float | None:
        """The distance with which a body stands for election, None when it does not."""
        if ego_distance(snapshot, state) >= self.distance_m or not snapshot.sees_ego:
            return None
        if self.rule == "unsigned":
            return ego_distance(snapshot, state)
        ahead = distance_ahead(snapshot, state)
        return ahead if ahead > 0.0 else None

    def crossing_bodies(self, snapshot: Snapshot) -> list[int]:
        """The owned bodies that are crossing and have not arrived."""
        return [
            j
            for j, b in zip(self.owned, self.behaviours, strict=True)
            if b.active and not b.over(snapshot.testers[j])
        ]


class Coordinator:
    """The seed's coordinator c: one election a timestep, none while the winner crosses.

    With a sensor there is one for each agent, by its own view; they may disagree.
    """

    def __init__(self, agents: Sequence[ElectionAgent], rng: np.random.Generator) -> None:
        self.agents, self.rng = agents, rng
        self._seen: Snapshot | None = None
        self._winner: int | None = None

    def elected(self, snapshot: Snapshot) -> int | None:
        """The index of the body elected in this timestep, ties drawn; None without a winner."""
        if snapshot is not self._seen:
            self._seen = snapshot
            self._winner = self._elect(snapshot)
        return self._winner

    def _elect(self, snapshot: Snapshot) -> int | None:
        if any(agent.crossing_bodies(snapshot) for agent in self.agents):
            return None
        votes = [
            (vote, j)
            for agent in self.agents
            for j in agent.owned
            if (vote := agent.vote(snapshot, snapshot.testers[j])) is not None
        ]
        if not votes:
            return None
        best = min(votes)[0]
        winners = [j for vote, j in votes if vote == best]
        return winners[0] if len(winners) == 1 else int(self.rng.choice(winners))
