"""Where the testers of an episode start: drawn and, if need be, moved, or where a record says."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from cavsumo.agents.base import Agent
from cavsumo.errors import InputError
from cavsumo.model.bodies import Kind
from cavsumo.model.carriageway import Start, StartRecord
from cavsumo.model.geometry import wrap
from cavsumo.model.scenario.script import Programme
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.recorded_starts import recorded_start
from cavsumo.simulation.setup import Setup

Starts = tuple[Start, ...]


class Placed(NamedTuple):
    """Testers at the beginning of an episode.

    Attributes:
        starts: where they start.
        waited: where they waited for the ego to enter; empty if they start there.
        snapshot: the first one.
    """

    starts: Starts
    waited: Starts
    snapshot: Snapshot


def placed(
    setup: Setup,
    agents: Sequence[Agent],
    rng: np.random.Generator,
    reset: Callable[[Sequence[BodyState], Starts], Snapshot],
) -> Placed:
    """Place the testers and let the ego enter; consumes the generator unless a record is played.

    Args:
        reset: begins the episode with the testers' first states and starts.
    """
    starts = _told(setup, [agent.recorded_starts for agent in agents])
    waited = _told(setup, [agent.recorded_waits for agent in agents])
    if waited:
        reset(_states(setup, waited), waited)
        return Placed(starts, waited, setup.world.shift(tuple(_states(setup, starts))))
    script = setup.scenario.script
    if script is not None and not starts:
        starts = tuple(map(_scripted, script.testers))
    if starts:
        return Placed(starts, (), reset(_states(setup, starts), starts))
    kinds = [body.kind for body in setup.bodies]
    drawn = setup.site.draw(kinds, setup.world.ego_body.kind, setup.scenario.start_speed, rng)
    snapshot = reset(_states(setup, drawn), drawn)
    return _cleared(setup, drawn, snapshot, rng)


def _cleared(setup: Setup, drawn: Starts, snapshot: Snapshot, rng: np.random.Generator) -> Placed:
    """The testers on foot away from where others are as the ego enters.

    Traffic is there before the testers are drawn, and where it stands depends on the episode.
    """
    kinds = [body.kind for body in setup.bodies]
    near = [snapshot.ego.box, *(other.box for other in snapshot.background)]
    if not setup.site.blocked(kinds, drawn, near):
        return Placed(drawn, (), snapshot)
    taken = [snapshot.ego.box, *(BodyState(*raw).box for raw in setup.world.everybody())]
    starts = setup.site.cleared(kinds, drawn, taken, rng)
    return Placed(starts, drawn, setup.world.shift(tuple(_states(setup, starts))))


def _scripted(programme: Programme) -> Start:
    """Where a programmed body starts."""
    (x, y, o), v = programme.enters
    return Start(x, y, wrap(o), v=v)


def _told(setup: Setup, records: Sequence[Sequence[StartRecord]]) -> Starts:
    """The starts that agents know for their bodies; empty when they know none."""
    found = {
        body: recorded_start(setup.site, record)
        for team, own in zip(setup.teams, records, strict=True)
        for body, record in zip(team, own, strict=bool(own))
    }
    if found and len(found) != len(setup.bodies):
        raise InputError(
            f"starts of {len(found)} testers are recorded, expected {len(setup.bodies)}"
        )
    return tuple(found[body] for body in sorted(found))


def _states(setup: Setup, starts: Sequence[Start]) -> list[BodyState]:
    """The testers' first states."""
    wanted = setup.scenario.start_speed

    def speed(kind: Kind, start: Start) -> float:
        if start.v is not None:
            return start.v
        return kind.v_max if wanted is None else min(kind.v_max, wanted)

    return [
        BodyState(body, start.x, start.y, speed(body.kind, start), start.o)
        for body, start in zip(setup.bodies, starts, strict=True)
    ]
