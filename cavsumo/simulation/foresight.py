"""The time that a human driver is short of, who sees a tester come: found without a rerun."""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.assertions.base import Judgement
from cavsumo.egos.reference.encounter import EVALUATION_S, encounter, lasting_conflict
from cavsumo.egos.reference.human import DELAY_S, FULL_MPS2, RISE_S
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

REACTION_S = EVALUATION_S + DELAY_S + RISE_S / 2  # until full braking, as if it came at once


def human_short(scene: Scene, history: Sequence[Snapshot], said: Judgement) -> float | None:
    """How much earlier a human driver had to see the tester of a test to stop before it [s].

    The driver perceives the risk as the human reference does, up to the trigger, or to the last
    snapshot of a test that was unfair, and then brakes. The tester need not be avoided by that: it
    may leave the way again, or walk on towards the driver. None for a test of no tester.
    """
    index = next((i for i, body in enumerate(scene.bodies) if body.id == said.tester), None)
    if index is None:
        return None
    end = history[-1].time if said.trigger_time is None else said.trigger_time
    seen = [s for s in history if s.time <= end + 1e-9]
    met = [encounter(scene, s, s.testers[index]) for s in seen]
    began = lasting_conflict(met, scene.dt)
    first = met[-1 if began is None else began]
    if first.speed <= 0.0:
        return 0.0
    needed = REACTION_S + first.speed / (2.0 * FULL_MPS2)
    return max(0.0, needed - max(0.0, first.gap) / first.speed)
