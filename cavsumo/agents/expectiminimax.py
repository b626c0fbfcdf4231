"""The game-playing tester: a solved game decides whether and when to step onto the road.

It predicts for every episode whether its test can be forced, and for which egos.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from cavsumo.agents.avoidance import Avoidance
from cavsumo.agents.base import AGENTS, NOT_FORCEABLE, SURE, UNDECIDED, Agent, Forecast
from cavsumo.agents.body_policy import BodyPolicy
from cavsumo.agents.lookahead import succeeds
from cavsumo.agents.planning.classes import EGO_CLASSES
from cavsumo.agents.planning.coordinates import Coordinates
from cavsumo.agents.planning.forceability import ConstantSpeed, Forceability, Free, Unaware
from cavsumo.agents.planning.rules import Rules, against_any, against_constant
from cavsumo.agents.planning.solved import solved
from cavsumo.agents.triggers import MAX_DECEL, REACTION_TIME
from cavsumo.model.bodies import PEDESTRIAN, Action, Kind
from cavsumo.model.checks import choice, number
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

NEAR_M, FAR_M = 3.0, 6.0  # how far from the strip the tables begin: of free and of constant egos
# Headings of ways that are tried at once if the straight one takes too long, off the way across
# [rad].
ESCAPES = tuple(math.radians(sign * turn) for turn in range(5, 75, 5) for sign in (1, -1))
TURNING_S = 0.5  # no more is gained by turning less at first


@AGENTS.register("expectiminimax")
class ExpectiminimaxAgent(Agent):
    """Plays the optimal policy of a stochastic shortest path game, with a forecast."""

    sees_background = False
    drives = False

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "against": "class of egos: " + "; ".join(f"{n}: {t}" for n, t in EGO_CLASSES.items()),
        "price_per_s": "price of standing in the ego's way before its reaction zone arrives, where "
        "a missed test costs 1 [1/s]",
        "grid_s": "step of the lattice in time against a constant ego, at most [s]",
        "top": "the speed that an ego of the other classes never exceeds [m/s]",
        "accel": "its largest acceleration [m/s2], rounded up to 9 / n",
    }

    def __init__(
        self,
        against: str = "constant",
        price_per_s: float = 0.01,
        grid_s: float = 0.05,
        top: float = 13.89,
        accel: float = 4.5,
    ) -> None:
        self.against = choice("against", against, tuple(EGO_CLASSES))
        self.promise = f"egos of class {self.against}"
        self.price = number("price_per_s", price_per_s, 1e-6, 1.0)
        self.grid = number("grid_s", grid_s, 0.01, 0.25)
        self.top = number("top", top, 0.5, 60.0)
        self.accel = number("accel", accel, 1.0, MAX_DECEL)

    def check_bodies(self, kind: Kind, bodies: int) -> None:
        if kind != PEDESTRIAN:
            raise ValueError(f"its game is that of a {PEDESTRIAN.name}, got {kind.name}")

    def prepare(self) -> None:
        for rules in self._rules():
            solved(rules)

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        self._forceabilities = {i: self._forceabilities_of(i) for i in owned}
        self.policies = [BodyPolicy(scene, i, self._forceabilities[i]) for i in owned]
        self.avoidances = [Avoidance(scene, i) for i in owned]
        self.team = self.policies
        self.leader: BodyPolicy | None = None

    def forecast(self, snapshot: Snapshot) -> Forecast:
        where = {i: Coordinates(self.scene, i)(snapshot) for i in self.owned}
        forceabilities = {i: self._forceabilities[i][0] for i in self.owned}
        worth = [forceabilities[i].worth(here) for i, here in where.items() if here is not None]
        best = max(worth, default=-1.0)
        if self.against == "constant":
            return Forecast(self._simulated_ahead(snapshot), best)
        if any(here is not None and forceabilities[i].sure(here) for i, here in where.items()):
            return Forecast(SURE, best)
        if any(here is not None and forceabilities[i].possible(here) for i, here in where.items()):
            return Forecast(UNDECIDED, best)
        return Forecast(NOT_FORCEABLE, best)

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        states = self.own(snapshot)
        bodies = list(zip(self.policies, self.avoidances, states, strict=True))
        chosen = [
            None if t.going else avoidance.along(snapshot, state, t.idle(snapshot))
            for t, avoidance, state in bodies
        ]
        if snapshot.sees_ego:
            self._send(snapshot, chosen)
        return tuple(
            idle
            if idle is not None and not t.going
            else avoidance.across(snapshot, state, t.go(snapshot), t.heading)
            for (t, avoidance, state), idle in zip(bodies, chosen, strict=True)
        )

    @classmethod
    def coordinate(cls, agents: Sequence[Agent], rng: np.random.Generator) -> None:
        mine = [agent for agent in agents if isinstance(agent, ExpectiminimaxAgent)]
        team = [policy for agent in mine for policy in agent.policies]
        for agent in mine:
            agent.team = team

    def _send(self, snapshot: Snapshot, idle: Sequence[Action | None]) -> None:
        """Let one body start, if it is time and no other is on its way to a test.

        A body that is not sure to succeed waits while another is.
        """
        if any(t.going and not t.lost(snapshot) for t in self.team):
            return
        if self.leader is not None and self.leader.lost(snapshot):
            self.leader = None
        gain, n = 0.0, 0
        for i, (policy, action) in enumerate(zip(self.policies, idle, strict=True)):
            if action is not None and self.leader in (None, policy):
                gain, n = max((gain, n), (policy.due(snapshot, action), -i))
        if gain >= 1.0 or (gain > 0.0 and not any(t.sure(snapshot) for t in self.team)):
            self.policies[-n].going = True

    def _simulated_ahead(self, snapshot: Snapshot) -> str:
        """The verdict of episodes simulated ahead; the agent takes the way that succeeds."""
        scene = self.scene
        for n, i in enumerate(self.owned):
            for turn in (None, *self._escapes(snapshot, i)):
                if succeeds(scene, snapshot, BodyPolicy(scene, i, self._forceabilities[i], turn)):
                    self._lead(n, turn)
                    return SURE
        return NOT_FORCEABLE

    def _escapes(self, snapshot: Snapshot, index: int) -> tuple[float, ...]:
        """Oblique ways to try [rad]: none if the straight one is late by more than the best of them
        gains.

        On a way at phi to the straight one a body at speed w gains d tan(phi) of the ego's way and
        loses d (1 / cos(phi) - 1) / w of its time: at best d / w (1 - sqrt(1 - (w / v)^2)).
        """
        forceability, here = (
            self._forceabilities[index][-1],
            Coordinates(self.scene, index)(snapshot),
        )
        if here is None or here.left <= 0.0 or here.gap <= 0.0:
            return ()
        w, v = forceability.kind.v_max, here.v
        if v > w:
            gain = here.left / w * (1.0 - math.sqrt(1.0 - (w / v) ** 2))
            t, _, _ = forceability.walked(here, 0.0)
            late = t - here.gap / v + 0.5 * v / forceability.max_decel
            if late > gain + TURNING_S:
                return ()
        return ESCAPES

    def _lead(self, n: int, escape: float | None) -> None:
        """Let one body play alone as long as it can reach a test."""
        self.leader = self.policies[n]
        self.leader.escape, self.leader.going = escape, escape is not None

    def _rules(self) -> list[Rules]:
        """The games it plays, that of its class first."""
        constant = against_constant(PEDESTRIAN, REACTION_TIME, FAR_M, self.price, self.grid)
        if self.against == "constant":
            return [constant]
        free = against_any(
            PEDESTRIAN,
            max_decel=MAX_DECEL,
            reaction_time=REACTION_TIME,
            top=self.top,
            accel=self.accel,
            left_max=NEAR_M,
            price=self.price,
        )
        return [free, constant]

    def _forceabilities_of(self, index: int) -> tuple[Forceability, ...]:
        """The forceabilities of one body, those of its class first."""
        scene, tables = self.scene, [solved(rules) for rules in self._rules()]
        kind = scene.bodies[index].kind
        found: list[Forceability] = [ConstantSpeed(kind, tables[-1], MAX_DECEL, scene.dt)]
        met = Coordinates(scene, index).meeting
        if self.against == "any":
            found.insert(0, Free(kind, tables[0], MAX_DECEL, scene.dt))
        elif self.against == "unaware":
            kerb = met.strip - met.way.enter + kind.length / 2 if met else 0.0
            found.insert(0, Unaware(kind, tables[0], MAX_DECEL, scene.dt, kerb))
        return tuple(found)
