"""When an episode ends."""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.agents.base import Agent
from cavsumo.model.left_behind import LeftBehind
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot
from cavsumo.simulation.setup import Setup

# An episode whose verdict is open at the horizon may run on for this long [s].
OVERTIME_S = 15.0


def over(setup: Setup, snapshot: Snapshot) -> bool:
    """The terminator psi: every assertion decided, or the horizon with none pending."""
    for assertion in setup.assertions:
        if not assertion.decided:
            break
    else:
        return True
    left = setup.scenario.end - snapshot.time
    if left > 1e-9:
        return False
    return left < -OVERTIME_S or not any(a.pending for a in setup.assertions)


def all_behind(
    setup: Setup, agents: Sequence[Agent], behind: LeftBehind, snapshot: Snapshot
) -> bool:
    """Whether nobody can meet the ego any more, so that no verdict can change.

    Every tester stands behind the ego for good, and the agents promise that it stays there.
    """
    return (
        all(agent.rests() for agent in agents)
        and all(a.about_testers and not a.pending for a in setup.assertions)
        and all(body.v == 0.0 and behind(snapshot, body) for body in snapshot.testers)
    )


def at_end(scene: Scene, snapshot: Snapshot) -> bool:
    """Whether a freely driving ego has reached the end of its path."""
    ego, path = snapshot.ego, scene.ego_path
    return path.project(ego.x, ego.y).along >= path.length - ego.body.kind.length / 2
