"""A tester that learns how the ego drives, and plays the best response to it.

It counts when the ego changes its acceleration and to which value (``planning.opponent``), solves
the decision process that follows from the counts (``planning.solving``), and in every timestep
takes the action with the larger value from the true state: to walk, or to stand. First it explores,
with walks at random times; then it plays, and solves again at intervals.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cavsumo.agents.avoidance import Avoidance
from cavsumo.agents.base import AGENTS, Agent, learner_of
from cavsumo.agents.planning.coordinates import Coordinates, Relative
from cavsumo.agents.planning.grid import (
    ZETAS,
    States,
    braking,
    scale,
)
from cavsumo.agents.planning.moves import (
    STAND,
    WALK,
    Aim,
    Prices,
)
from cavsumo.agents.planning.opponent import (
    AccelerationReader,
    Counts,
    acceleration_class,
    situation,
)
from cavsumo.agents.planning.response import Plan
from cavsumo.agents.triggers import Timing, time_to_walk
from cavsumo.agents.walking import ApproachKerb, CrossingWalk, walk
from cavsumo.model.bodies import NOOP, Action, Kind
from cavsumo.model.checks import choice, number, truth, whole
from cavsumo.model.documents import json_of, read_text
from cavsumo.model.kinematics import wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

MODEL_DT = 0.1  # timestep of the model, unless those of the scenario are longer [s]
AIMS = ("preventable", "violation", "test")
NOTICE_STEP_S, LONGEST_NOTICE_S = 0.5, 2.5  # a plan for each step; seen longer is seen in time
EXPLORED_AIMS = (0.3, 1.3)  # part of the reaction zone into which exploring walks step
INDIFFERENT = 0.02  # a move is kept unless another is better by this
OFF_THE_LANE_S = 1.1  # a body that stands farther away does not stop the ego
SLOW_MPS = 0.5  # a body that goes back brakes to this speed before turning
BACK = 2  # to where it waited, when there is nothing to be had; the model knows nothing of it
KNOWN = "best-response"


@lru_cache(maxsize=16)
def _planned(counts: str, dt: float, aim: Aim) -> Plan:
    """The plan for counts as text; agents of one process share it."""
    from cavsumo.agents.planning.solving import best_response

    return best_response(Counts.of(json.loads(counts)), dt, aim)


@AGENTS.register(KNOWN)
class BestResponseAgent(Agent):
    """Counts how the ego drives, solves the game against that ego, and plays the solution."""

    sees_background = False
    drives = False
    FILES = ("model",)

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "aim": "'preventable' violation of the assertion, any 'violation', or 'test': its "
        "precondition",
        "model": "manifest of an earlier batch, or a JSON file, with the counts to begin with",
        "learn": "false to play what is known without counting on",
        "explore": "episodes with walks timed at random before the first plan",
        "replan": "episodes after which the plan is made anew",
        "missed": "price of an episode without a test; a test that the ego passed costs 1",
        "unfair": "price of an unfair episode",
        "unpreventable": "price of a violation that a human driver would not have prevented either",
        "confidence": "of sets around the counts, from which the ego picks the worst; 0 for none",
        "run_up_m": "distance to the carriageway at which it waits [m]",
    }

    def __init__(
        self,
        aim: str = "preventable",
        model: str | None = None,
        learn: bool = True,
        explore: int = 60,
        replan: int = 60,
        missed: float = 1.0,
        unfair: float = 2.0,
        unpreventable: float = 1.0,
        confidence: float = 0.0,
        run_up_m: float = 0.8,
    ) -> None:
        prices = Prices(
            missed=number("missed", missed, 0.0, 100.0),
            unfair=number("unfair", unfair, 0.0, 100.0),
            unpreventable=number("unpreventable", unpreventable, 0.0, 100.0),
        )
        trust = number("confidence", confidence, 0.0, 0.999999)
        self.aim = Aim(choice("aim", aim, AIMS) != "test", prices, trust or None)
        self.prevents = aim == "preventable"
        self.learn = self.learns = truth("learn", learn)
        self.explore = int(number("explore", explore, 0))
        self.replan = int(number("replan", replan, 1))
        self.run_up_m = number("run_up_m", run_up_m, 0.0, 10.0)
        self.counts, self.episodes, self.planned = Counts(), 0, ""
        if model is not None:
            self.counts = load_counts(Path(model))
            self.planned = json.dumps(self.counts.plain(), sort_keys=True)
        elif not self.learn:
            raise ValueError("learn=false plays a model: name its file, model=FILE")

    def recall(self) -> Any:
        return {
            "episodes": self.episodes,
            "counts": self.counts.plain(),
            "planned": json.loads(self.planned or "null"),
        }

    def remember(self, memory: Any) -> None:
        self.episodes = whole("episodes", memory["episodes"])
        self.counts = Counts.of(memory["counts"])
        self.planned = json.dumps(memory["planned"], sort_keys=True) if memory["planned"] else ""

    def check_memory(self, memory: Any, bodies: int) -> None:
        self.remember(memory)
        if memory["planned"] is not None:
            Counts.of(memory["planned"])

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        if self.learn:
            played = self.episodes - self.explore
            if played >= 0 and played % self.replan == 0:
                self.planned = json.dumps(self.counts.plain(), sort_keys=True)
            self.episodes += 1
        self._every = max(1, round(MODEL_DT / scene.dt))
        self.watch = AccelerationReader(scene.dt * self._every)
        self.coordinates = [Coordinates(scene, i) for i in range(len(scene.bodies))]
        self._bodies = [PlannedBody(self, i) for i in self.owned]
        self._told: tuple[int, int, int] | None = None

    def plan(self, index: int) -> Plan | None:
        """The plan of a body; None while the agent explores."""
        if not self.planned:
            return None
        notice = notice_of(self.coordinates[index]) if self.prevents else None
        aim = dataclasses.replace(self.aim, notice=notice)
        return _planned(self.planned, self.watch.dt, aim)

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        if snapshot.step % self._every == 0:
            self._look(snapshot)
        return tuple(
            body.action(snapshot, state)
            for body, state in zip(self._bodies, self.own(snapshot), strict=True)
        )

    def _look(self, snapshot: Snapshot) -> None:
        """Observe the ego's last decision, and count it in its situation."""
        if not snapshot.sees_ego:
            self.watch, self._told = AccelerationReader(self.watch.dt), None
            return
        watch, held = self.watch, self.watch.held
        watch.see(snapshot.ego.v)
        if not self.learn:
            return
        if watch.changed is not None and self._told is not None:
            self.counts.add(self._told, held, watch.acceleration, changed=watch.changed)
        self._told = self._situation(snapshot)

    def _situation(self, snapshot: Snapshot) -> tuple[int, int, int]:
        """The situation of the ego: that of the body for which it must brake hardest."""
        worst, need = (math.inf, math.inf), 0.0
        for coordinates in self.coordinates:
            here = coordinates(snapshot)
            if (
                here is None
                or here.gap < 0.0
                or here.left < -coordinates.kind.length - self.scene.ego.kind.width
            ):
                continue
            entry = entry_time(coordinates.kind, here, self.scene.dt)
            needed = here.v / (here.gap + 0.05)
            if entry < 1.15 and needed >= need:
                worst, need = (entry, here.gap), needed
        return situation(*worst, snapshot.ego.v)


def notice_of(coordinates: Coordinates) -> float | None:
    """For how long a body that walks across can be seen on the road before the ego's strip [s].

    In steps, of which each needs a plan of its own; None for a body without a way across.
    """
    met = coordinates.meeting
    if met is None:
        return None
    seen = (met.strip - met.way.enter) / coordinates.kind.v_max
    return min(LONGEST_NOTICE_S, max(0.0, round(seen / NOTICE_STEP_S) * NOTICE_STEP_S))


def entry_time(kind: Kind, here: Relative, dt: float) -> float:
    """Time until a body that walks from now on enters the ego's strip, negative since then [s].

    A body that gains speed is half a timestep late: its position uses the old speed.
    """
    if here.left <= 0.0:
        return here.left / kind.v_max
    return time_to_walk(kind, here.walk, here.left) + dt / 2.0 * (1.0 - here.walk / kind.v_max)


class PlannedBody:
    """One body of the agent: waits before the kerb, walks, may stop before the lane and go back."""

    def __init__(self, agent: BestResponseAgent, index: int) -> None:
        self.agent, self.scene, self.index = agent, agent.scene, index
        self.coordinates = agent.coordinates[index]
        self.crossing = CrossingWalk(agent.scene)
        clearance, self.explores = agent.run_up_m, None
        self.plan = agent.plan(index)
        if self.plan is None:
            clearance *= agent.rng.random()
            self.explores = Timing(agent.scene, index, agent.rng.uniform(*EXPLORED_AIMS))
        self.waiting = ApproachKerb(agent.scene, index, clearance)
        self.avoidance = Avoidance(agent.scene, index)
        self.begun, self.last = False, STAND

    def action(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action, out of the way of others."""
        wanted = self._wanted(snapshot, state)
        if self.crossing.active and self.last == WALK:
            return self.avoidance.across(snapshot, state, wanted, self.crossing.heading)
        return self.avoidance.along(snapshot, state, wanted)

    def _wanted(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action if no body is in the way."""
        if self.begun and not self.crossing.active:
            return NOOP  # it has arrived on the other side
        move = self.last = self._move(snapshot, state)
        if not self.begun:
            self.begun = move == WALK and self.crossing.begin(state)
            return self.crossing.action(state) if self.begun else self.waiting.action(state)
        if move == WALK:
            return self.crossing.action(state)
        brakes = move == STAND or (state.v > SLOW_MPS and not self._faces_back(state))
        if brakes or self.crossing.crossing is None:
            return walk(state, state.o, 0.0, self.scene.dt)
        back = self.crossing.crossing.heading + math.pi
        return walk(state, back, state.body.kind.v_max, self.scene.dt)

    def _faces_back(self, state: BodyState) -> bool:
        """Whether it has turned away from the road that it set out to cross."""
        way = self.crossing.crossing
        return way is not None and abs(wrap(way.heading - state.o)) > math.pi / 2

    def _move(self, snapshot: Snapshot, state: BodyState) -> int:
        """STAND, WALK or BACK."""
        if self.explores is not None:
            walks = self.begun or (snapshot.sees_ego and self.explores(snapshot, state))
            return WALK if walks else STAND
        here = self.coordinates(snapshot)
        if here is None:
            return STAND
        if here.left <= 0.0:
            return WALK
        here = here._replace(gap=here.gap + self._aside(state))
        plan, kind = self.plan, self.coordinates.kind
        assert plan is not None
        entry = entry_time(kind, here, self.scene.dt) / plan.grid.dt
        if entry <= plan.grid.committed:
            return self._committed(here, kind)
        return self._best(plan, here, entry)

    def _committed(self, here: Relative, kind: Kind) -> int:
        """Whether the body is nearer than decisions are planned, so that it completes its move."""
        if not self.begun:
            return STAND
        room = here.walk * (here.walk / (-2.0 * kind.throttle_min) + self.scene.dt)
        if self.last == WALK or (here.left <= room and abs(here.turn) < math.pi / 2):
            return WALK
        return BACK

    def _best(self, plan: Plan, here: Relative, entry: float) -> int:
        """The move with the largest value. Farther away the ages shift along."""
        grid, watch, gap = plan.grid, self.agent.watch, here.gap
        zeta = (gap - here.v * entry * grid.dt - braking(here.v)) / float(scale(here.v))
        if not ZETAS[0] < zeta < ZETAS[-1]:
            return BACK if entry < grid.before else STAND
        held = min(watch.held, grid.ages - 1)
        if entry > grid.before:  # as it will be when the body is that near
            gap -= here.v * (entry - grid.before) * grid.dt
            held = (watch.held + round(entry - grid.before)) % grid.ages
            entry = float(grid.before)
        ones = np.ones(2)
        states = States(ones * entry, ones * gap, ones * here.v, np.full(2, held))
        which = np.full(2, acceleration_class(watch.acceleration))
        backup = plan.back_up(states, np.array([STAND, WALK]), ones * watch.acceleration, which)
        worth = backup.worth
        if worth.max() < INDIFFERENT - plan.aim.prices.missed:  # nothing to be had
            return STAND if entry * grid.dt > OFF_THE_LANE_S else BACK
        worth[WALK if self.last == WALK else STAND] += INDIFFERENT
        return int(np.argmax(worth))

    def _aside(self, state: BodyState) -> float:
        """Offset of a body from its way along the ego's path, after its turns [m]."""
        met = self.coordinates.meeting
        assert met is not None
        heading = met.way.heading
        lateral = (state.y - met.way.y) * math.cos(heading)
        lateral -= (state.x - met.way.x) * math.sin(heading)
        return lateral * math.sin(self.scene.ego_path.at(met.along)[2] - heading)


def load_counts(file: Path) -> Counts:
    """Counts from a JSON file or the manifest of a batch; ValueError when it has none."""
    text = read_text(file, "model", ValueError)
    try:
        data = json_of(text)
        if "learned" in data:
            data = learner_of(data["learned"], KNOWN)[0]
        return Counts.of(data["counts"])
    except (ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError) as error:
        raise ValueError(
            f"model {str(file)!r}: expected the manifest of a batch with {KNOWN}, or a JSON object "
            "with its 'counts'"
        ) from error
