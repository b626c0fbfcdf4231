"""Agents, an ego and assertions of a user's that keep state, and a batch of them."""

from __future__ import annotations

from typing import Any

import cavsumo
from cavsumo import Results


class Sprinter(cavsumo.Agent):
    """Walks faster from decision to decision, which no later episode may notice."""

    def __init__(self, pace: float = 1.0) -> None:
        self.pace, self.decisions = pace, 0

    def choose_action(self, snapshot: Any) -> tuple[cavsumo.Action, ...]:
        self.decisions += 1
        throttle = min(1.4, self.pace * self.decisions / 100)
        return tuple(cavsumo.Action(throttle, 0.0) for _ in self.own(snapshot))


class Counting(cavsumo.Agent):
    """A learner: it walks faster from lesson to lesson."""

    learns = True

    def __init__(self) -> None:
        self.steps = 0

    def choose_action(self, snapshot: Any) -> tuple[cavsumo.Action, ...]:
        self.steps += 1
        return tuple(cavsumo.Action(min(1.4, self.steps / 100), 0.0) for _ in self.own(snapshot))

    def recall(self) -> int:
        return self.steps

    def remember(self, memory: int) -> None:
        self.steps = memory


class Tiring:
    """An ego that drives slower from answer to answer."""

    depart_speed = 6.0

    def __init__(self, speed: float = 6.0) -> None:
        self.speed, self.answers = speed, 0

    def act(self, snapshot: Any) -> cavsumo.Acceleration:
        self.answers += 1
        wanted = self.speed - 0.01 * self.answers
        return cavsumo.Acceleration(max(-4.0, min(2.0, wanted - snapshot.ego.v)))


class Patient:
    """An assertion whose margin shrinks from snapshot to snapshot."""

    def __init__(self) -> None:
        self.seen = 0

    def observe(self, snapshot: Any) -> float:
        self.seen += 1
        return 1000.0 - self.seen


def apart(snapshot: Any) -> float | None:
    """The ego keeps below 50 m/s."""
    return 50.0 - float(snapshot.ego.v) if snapshot.time > 1.0 else None


def of_objects(**more: Any) -> Results:
    """A batch of them."""
    return cavsumo.run(
        "pedestrians",
        routes="none",
        agents=[Sprinter(2.0), Counting(), "timing"],
        ego=Tiring(),
        assertions=[apart, Patient(), "reaction-zone"],
        runs=2,
        testers=2,
        end=4.0,
        trace="all",
        **more,
    )


# The source of an object, for names of it in other sessions.
DEFINED = """
LIMIT = {limit}
def half(x):
    return x / 2
class Careful:
    def __init__(self, speed=3.0):
        self.speed = speed
    def act(self, snapshot):
        return half(LIMIT) if snapshot in {{"one", "two", "three", "four"}} else self.speed
"""
