"""Episodes that are played back: the testers begin where they began and do what they did.

A record is made from an episode in memory (``simulation.playback``) or from its trace
(``results.recording``), and played by agents of this file, independently of the ego.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.errors import NoSuchAction
from cavsumo.model.bodies import NOOP, Action, Kind
from cavsumo.model.carriageway import StartRecord
from cavsumo.model.departures import Demand
from cavsumo.model.kinematics import steering_for_turn, wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

FARTHEST = 1e8  # m from the origin, and m/s, rad
Teams = Sequence[Sequence[int]]  # for each agent the indices of its bodies


class Hold(NamedTuple):
    """A timestep of a record behind which a body goes on when the ego is where it was then."""

    step: int
    along: float  # arc length of the ego's centre on its path [m]


@dataclass(frozen=True)
class Recorded:
    """Data that determine an episode when it is played back.

    Attributes:
        seed: of the episode.
        actions: for each timestep the action of each tester's body.
        starts: where each of them started; empty to draw the starts from the seed again.
        waited: where they waited for the ego to enter, if some were put elsewhere after that.
        departures: of the background; None for the scenario's own demand.
        approaches: types of the site's approaches, among which the starts' places are numbered.
        holds: of each tester, None for one that acts by the clock alone; empty if all do.
        stops: whether the episode ends with the actions, as that of a script did that stopped it.
    """

    seed: int
    actions: Sequence[Sequence[Action]]
    starts: Sequence[StartRecord] = ()
    waited: Sequence[StartRecord] = ()
    departures: Demand | None = None
    approaches: Sequence[str] = ()
    holds: Sequence[Hold | None] = ()
    stops: bool = False

    def memories(self, teams: Teams) -> tuple[dict[str, Any], ...]:
        """The knowledge of the agents that play it back, as plain data."""
        return tuple(
            {
                "starts": [self.starts[i] for i in team if self.starts],
                "waited": [self.waited[i] for i in team if self.waited],
                "actions": [[joint[i] for i in team] for joint in self.actions],
                **({"holds": [self.holds[i] for i in team]} if self.holds else {}),
                **({"stops": True} if self.stops else {}),
            }
            for team in teams
        )

    def agents(self, teams: Teams) -> list[RecordedAgent]:
        """The agents that play it back."""
        agents = [RecordedAgent() for _ in teams]
        for agent, memory in zip(agents, self.memories(teams), strict=True):
            agent.remember(memory)
        return agents


@AGENTS.register("recorded")
class RecordedAgent(Agent):
    """Begins and acts as it is told (``certify --open-loop``), then does nothing.

    It is told that as what it remembers, see ``Recorded.memories``.

    Attributes:
        ends: whether its bodies rest behind the end of the record (``Agent.rests``).
    """

    sees_background = False

    def __init__(self) -> None:
        self._actions: list[tuple[Action, ...]] = []
        self._done, self.ends = 0, False
        self._holds: list[Hold | None] = []
        self._stops = False

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        self._done = 0
        self._steps = [0] * len(self._holds)

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        if self._holds:
            return tuple(self._held(i, snapshot) for i in range(len(self._holds)))
        if self._done == len(self._actions):
            return (NOOP,) * len(self.owned)
        self._done += 1
        return self._actions[self._done - 1]

    def rests(self) -> bool:
        return self.ends and min(self._steps, default=self._done) >= len(self._actions)

    def stops(self) -> bool:
        return self._stops and self._done == len(self._actions)

    def _held(self, i: int, snapshot: Snapshot) -> Action:
        """The action of a body that waits for the ego."""
        step, hold = self._steps[i], self._holds[i]
        if hold is not None and step == hold.step and self._ego_before(hold, snapshot):
            return NOOP
        self._steps[i] += 1
        return self._actions[step][i] if step < len(self._actions) else NOOP

    def _ego_before(self, hold: Hold, snapshot: Snapshot) -> bool:
        """Whether the ego has yet to come to where a body goes on."""
        return self.scene.ego_progress(snapshot) < hold.along

    def recall(self) -> Any:
        return {
            "starts": self.recorded_starts,
            "waited": self.recorded_waits,
            "actions": self._actions,
            **({"holds": self._holds} if self._holds else {}),
            **({"stops": True} if self._stops else {}),
        }

    def check_memory(self, memory: Any, bodies: int) -> None:
        found = RecordedMemory.model_validate_json(json.dumps(memory))
        for start in (*found.starts, *found.waited):
            check_start(start)
        told = {len(found.starts), len(found.waited), len(found.holds)}
        numbers = told - {0} | {*map(len, found.actions)}
        if numbers - {bodies} or (found.waited and not found.starts):
            raise ValueError(f"starts and actions of other than {bodies} bodies")

    def remember(self, memory: Mapping[str, Any]) -> None:
        self.recorded_starts, self.recorded_waits = (
            [start_of(start) for start in memory[key]] for key in ("starts", "waited")
        )
        self._actions = [tuple(Action(*one) for one in joint) for joint in memory["actions"]]
        self._holds = [hold and Hold(*hold) for hold in memory.get("holds", ())]
        self._stops = memory.get("stops", False)


class RecordedMemory(BaseModel):
    """The knowledge of an agent that plays back, as it is read from a file."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    starts: list[StartRecord]
    waited: list[StartRecord]
    actions: list[list[Action]]
    holds: list[Hold | None] = []
    stops: bool = False


def check_start(start: StartRecord) -> None:
    """Raise ValueError for a start so far away that the body would leave what a trace can hold."""
    if not all(abs(number or 0.0) <= FARTHEST for number in (start.x, start.y, start.o, start.v)):
        raise ValueError(f"a start at {start.x:g}, {start.y:g}, expected at most {FARTHEST:g}")


def start_of(plain: Sequence[Any]) -> StartRecord:
    """A start from a list of its fields."""
    return StartRecord(*plain)._replace(edges=tuple(plain[-1]))


def action_between(
    kind: Kind, before: Sequence[float], after: Sequence[float], dt: float
) -> tuple[float, float]:
    """Throttle and steering that lead a body from one state (x, y, v, o) to the next (eqs 20-22).

    A speed at its limit comes from the effector at its limit, so that it is reproduced exactly; a
    turn below the rounding error is none.
    """
    _, _, v, o = before
    _, _, v_next, o_next = after
    throttle = (v_next - v) / dt
    if v_next <= kind.v_min:
        throttle = kind.throttle_min
    elif v_next >= kind.v_max:
        throttle = kind.throttle_max
    try:
        steering = steering_for_turn(v, wrap(o_next - o), kind.wheelbase, dt)
    except NoSuchAction:
        steering = 0.0
    return (
        max(kind.throttle_min, min(kind.throttle_max, throttle)),
        max(-kind.steering_max, min(kind.steering_max, steering)),
    )
