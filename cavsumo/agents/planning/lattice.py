"""The game on the lattice of ``rules``, as sparse arrays.

States are 0, the goal (a body in the reaction zone that never was in the braking zone), MISSED,
SPOILT, those of a body that stands in the strip and waits for the ego (gap, speed), and those of
one on its way there (gap, speed, distance left, pace). All of them lie in order of the gap, which
shrinks with every step, so a play never comes back to a state.

Actions of the tester: 0 stand (or brake), 1 walk on. Actions of the ego: the change of its speed.
Within an interval both accelerations are constant, so the time at which the body's front touches
the strip, and the zones at that time, are computed exactly. A body that enters the strip before the
reaction zone stands there: the reaction zone of an ego that never stops must reach it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cavsumo.agents.planning.rules import Rules
from cavsumo.games import Game, from_arrays

GOAL, MISSED, SPOILT, FIRST = range(4)
PRICES = {MISSED: 1.0, SPOILT: 2.0}
ROUNDING = 1e-9
Array = Any  # of numpy, whose shapes and types change from line to line here


@dataclass(frozen=True)
class Steps:
    """The result of a step from every state under every pair of actions."""

    successor: Array
    reward: Array


def build(rules: Rules, *, trapped: bool) -> Game:
    """The game of some rules.

    Args:
        trapped: a missed test stays missed, to compute from where the goal can be forced; otherwise
            it ends at its price, so that every state has a value.
    """
    gaps, speeds, lefts, paces = rules.shape
    standing, walking = _standing(rules), _walking(rules)
    egos = standing.successor.shape[-1]
    ends = [MISSED, SPOILT] if trapped else [GOAL, GOAL]
    costs = [0.0, 0.0] if trapped else [-PRICES[MISSED], -PRICES[SPOILT]]
    waits, walks = gaps * speeds, gaps * speeds * lefts * paces
    rows = np.concatenate([[0, 1, 1], np.ones(waits, int), np.full(walks, 2)])
    cells = np.concatenate([[1, 1], np.full(waits + 2 * walks, egos)])
    successor = np.concatenate([ends, standing.successor.ravel(), walking.successor.ravel()])
    reward = np.concatenate([costs, standing.reward.ravel(), walking.reward.ravel()])
    goal = np.zeros(len(rows), dtype=bool)
    goal[GOAL] = True
    return from_arrays(
        goal,
        _starts(rows),
        _starts(cells),
        np.arange(len(successor) + 1),
        successor,
        np.ones(len(successor)),
        reward,
        name="a walking tester against an ego",
    )


def _starts(counts: Array) -> Array:
    return np.concatenate([[0], np.cumsum(counts)])


def _ego(rules: Rules, gap: Array, speed: Array) -> tuple[Array, ...]:
    """Gap and speed after an interval, by number, and the acceleration, for every ego action."""
    change = np.arange(-rules.brake, rules.accelerate + 1)
    after = np.clip(speed[..., None] + change, 0, rules.speeds - 1)
    driven = rules.advance * (speed[..., None] + after + 2)
    accel = (after - speed[..., None]) * rules.speed_step / rules.interval
    return gap[..., None] - driven, after, accel


def slack(rules: Rules, gap: Array, v: Array) -> Array:
    """Distance of the braking zone from the body [m]."""
    return gap - (0.5 * v * v / rules.max_decel if rules.max_decel else 0.0)


def _of(rules: Rules, gap: Array, speed: Array) -> tuple[Array, Array]:
    """Gap and speed in metres and m/s."""
    return (gap + 1) * rules.gap_step, (speed + 1) * rules.speed_step


def _standing(rules: Rules) -> Steps:
    """A body that stands in the strip, with the zones still to come."""
    gaps, speeds, *_ = rules.shape
    gap, speed = np.meshgrid(np.arange(gaps), np.arange(speeds), indexing="ij")
    next_gap, next_speed, _ = _ego(rules, gap, speed)
    room, v = _of(rules, next_gap, next_speed)
    there = slack(rules, room, v) <= rules.reaction_time * v + ROUNDING
    here, now = _of(rules, gap, speed)
    late = slack(rules, here, now) - rules.reaction_time * now  # how far the reaction zone is
    share = np.clip(late[..., None] / np.maximum(here[..., None] - room, ROUNDING), 0.0, 1.0)
    waits = FIRST + np.clip(next_gap, 0, None) * speeds + next_speed
    return Steps(
        np.where(there | (next_gap < 0), GOAL, waits),
        -rules.price * rules.interval * np.where(there, share, 1.0),
    )


def _walking(rules: Rules) -> Steps:
    """A body on its way to the strip."""
    axes = [np.arange(n) for n in rules.shape]
    gap, speed, left, pace = np.meshgrid(*axes, indexing="ij")
    found = [_walk(rules, gap, speed, left, pace, change) for change in (-1, 1)]
    return Steps(
        np.stack([f.successor for f in found], axis=-2),
        np.stack([f.reward for f in found], axis=-2),
    )


def _walk(rules: Rules, gap: Array, speed: Array, left: Array, pace: Array, change: int) -> Steps:
    """One action of the tester: the change of its pace."""
    gaps, speeds, _, paces = rules.shape
    after = np.clip(pace + change, 0, paces - 1)
    next_left = left - (pace + after)
    next_gap, next_speed, accel = _ego(rules, gap, speed)
    here, v = _of(rules, gap, speed)
    entry = _entry(rules, (left + 1) * rules.left_step, pace, after)
    t = np.minimum(entry, rules.interval)[..., None]
    now = v[..., None] + accel * t
    room = slack(rules, here[..., None] - (v[..., None] + now) / 2 * t, now)
    enters = np.broadcast_to((entry <= rules.interval + ROUNDING)[..., None], room.shape)
    end, end_v = _of(rules, next_gap, next_speed)
    end_room = slack(rules, end, end_v)
    waits = FIRST + np.clip(next_gap, 0, None) * speeds + next_speed
    walks = FIRST + gaps * speeds + _number(rules, next_gap, next_speed, next_left, after)
    reaction = rules.reaction_time
    arrived = (room <= reaction * now) | (end_room <= reaction * end_v) | (next_gap < 0)
    entered = np.where(room <= ROUNDING, SPOILT, np.where(arrived, GOAL, waits))
    out = np.where((end_room <= ROUNDING) | (next_gap < 0), MISSED, walks)
    early = np.clip(room - reaction * now, 0.0, None) / np.maximum(now, ROUNDING)
    stood = np.minimum(early, rules.interval - t)
    return Steps(
        np.where(enters, entered, out),
        np.where(enters & (room > ROUNDING), -rules.price * stood, 0.0),
    )


def _entry(rules: Rules, left: Array, pace: Array, after: Array) -> Array:
    """Time at which the body's front touches the strip, infinite if never [s]."""
    unit = rules.walk_accel * rules.interval
    w, a = pace * unit, (after - pace) * unit / rules.interval
    root = np.sqrt(np.maximum(w * w + 2.0 * a * left, 0.0))
    reached = (w + after * unit) / 2 * rules.interval >= left - ROUNDING
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(reached, 2.0 * left / (w + root), np.inf)


def _number(rules: Rules, gap: Array, speed: Array, left: Array, pace: Array) -> Array:
    """The number of a walking state among these; arbitrary for other states."""
    _, speeds, lefts, paces = rules.shape
    gap, left = np.clip(gap, 0, None), np.clip(left, 0, None)
    return ((gap * speeds + speed) * lefts + left[..., None]) * paces + pace[..., None]
