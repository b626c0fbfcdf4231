"""The car of adaptive stress testing's crosswalk, as an ego (``model.crosswalk``).

It follows the nearest tester that it estimates to be on the road, and nobody else. Its filter and
its law are made for timesteps of 0.1 s. In a scripted test on a straight way it is moved as in the
source, the old speed moving it; elsewhere SUMO moves it by its new speed.
"""

from __future__ import annotations

import math

import numpy as np

from cavsumo.egos.base import EGOS, Acceleration, Command, Drive, Ego
from cavsumo.model.bodies import Body
from cavsumo.model.crosswalk import DESIRED_MPS, chosen_acceleration, filtered
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

Pair = np.ndarray[tuple[int], np.dtype[np.float64]]


@EGOS.register("crosswalk")
class CrosswalkEgo(Ego):
    """The car of adaptive stress testing: an alpha-beta filter and a variant of IDM."""

    sees_background = False
    depart_speed = DESIRED_MPS

    def reset(self, scene: Scene) -> None:
        self.scene = scene
        script = scene.script
        self.free = script is not None and not script.ego.way.legs
        self.known: dict[Body, tuple[Pair, Pair]] = {}

    def act(self, snapshot: Snapshot) -> Command:
        self.known = {state.body: self._estimate(state) for state in snapshot.testers}
        ego, along = snapshot.ego, self.scene.ego_progress(snapshot)
        laws = [
            float(chosen_acceleration(*map(np.asarray, (ego.v, place[0] - along, place[1], speed))))
            for place, (speed, _) in self.known.values()
        ]
        # The first measurement is that of the first timestep: until then it keeps its speed.
        a = min(laws) if laws and snapshot.step > 0 else 0.0
        return Drive(a, 0.0) if self.free else Acceleration(a)

    def _estimate(self, state: BodyState) -> tuple[Pair, Pair]:
        """The estimated place of a body, along the path and beside it, and its velocity."""
        here = self.scene.ego_path.project(state.x, state.y)
        measured = np.array([here.along, here.lateral])
        if state.body in self.known:
            return filtered(*self.known[state.body], measured)
        turn = state.o - self.scene.ego_path.at(here.along)[2]
        return measured, state.v * np.array([math.cos(turn), math.sin(turn)])
