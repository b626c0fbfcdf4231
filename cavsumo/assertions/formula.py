"""A temporal-logic formula as an assertion: it keeps the signals of an episode and evaluates them.

A rule ``always (p => q)`` is triggered when p first holds, any other formula in every episode. A
rule that a single timestep can violate is evaluated at each timestep, and decided by the first
violation. Any other is evaluated once a second and at the end: it is violated at the first timestep
after which no continuation of the episode could satisfy it, which is found exactly.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from cavsumo.assertions.base import HELD, VIOLATED, Assertion, Judgement
from cavsumo.assertions.contacts import Contact
from cavsumo.assertions.formulas import SIGNALS, Moment, NoNumber, Rule, View, robustness
from cavsumo.assertions.formulas.nodes import TruthNode
from cavsumo.assertions.formulas.semantics import Bounds
from cavsumo.errors import AssertionFault
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

CHECK_S = 1.0  # interval of evaluations of a formula that a single timestep cannot decide


class FormulaAssertion(Assertion):
    """A formula of the user, from the scenario file or the command line."""

    def __init__(self, rule: Rule) -> None:
        self.name = rule.name  # type: ignore[misc]  # registered ones have theirs on the class
        self.rule = rule
        self.unconditional = rule.occasion is None
        self.sees_background = any(SIGNALS[name].sees_background for name in rule.signals)
        self._every = max(1, round(CHECK_S / rule.dt))

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self._values: dict[str, list[float]] = {name: [] for name in self.rule.signals}
        self._speeds: list[float] = []  # of the ego
        self._times: list[float] = []
        self._before: Snapshot | None = None
        self._margin = math.inf  # the smallest so far
        if self.rule.occasion is None:
            self.judgement = Judgement(self.name, HELD, trigger_time=0.0)

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        if self.decided:
            return
        moment = Moment(self.scene, self._before or snapshot, snapshot)
        for name, values in self._values.items():
            values.append(SIGNALS[name].value(moment))
        self._times.append(snapshot.time)
        self._speeds.append(snapshot.ego.v)
        self._before = snapshot
        if self.rule.lasting is not None:
            self._judge_timestep(self.rule.lasting)
        elif (len(self._times) - 1) % self._every == 0:
            self._judge(closed=False)

    def conclude(self) -> None:
        if self.decided or not self._times:
            return
        if self.rule.lasting is None:
            self._judge(closed=True)
        elif self.judgement.triggered:
            self.judgement = dataclasses.replace(self.judgement, robustness=self._margin)

    # A timestep alone

    def _judge_timestep(self, lasting: TruthNode) -> None:
        """Evaluate the last timestep for a rule that a single timestep can violate."""
        last, occasion = len(self._times) - 1, self.rule.occasion
        alone = partial(self._robustness, first=last)
        triggered = occasion is None or alone(occasion.precondition).least[0] > 0.0
        if triggered and not self.judgement.triggered:
            self._trigger(last)
        self._margin = min(self._margin, float(alone(lasting).greatest[0]))
        if self._margin < 0.0:
            self._violate(last, self._margin)

    # The whole trace

    def _judge(self, closed: bool) -> None:
        """Verdict over the timesteps seen so far."""
        bounds = self._robustness(self.rule.whole, closed=closed)
        self._look_for_trigger(closed)
        if bounds.greatest[0] < 0.0:
            self._find_violation(float(bounds.greatest[0]))
        elif bounds.least[0] > 0.0 and not closed:  # no continuation can violate it
            self._hold(float(bounds.least[0]))
            self.decided, self.pending = True, False
        elif closed:
            self._hold(float(bounds.greatest[0]))
        else:
            self.pending = self._open()

    def _look_for_trigger(self, closed: bool) -> None:
        """Note the first timestep at which the precondition holds for certain."""
        occasion = self.rule.occasion
        if occasion is None or self.judgement.triggered:
            return
        end = None if occasion.last is None else occasion.last + 1
        held = self._robustness(occasion.precondition, closed=closed).least > 0.0
        when = np.flatnonzero(held[occasion.first : end])
        if len(when):
            self._trigger(occasion.first + int(when[0]))

    def _open(self) -> bool:
        """Whether the rule is triggered and the time limit of its consequence has not passed."""
        occasion = self.rule.occasion
        if occasion is None or not self.judgement.triggered:
            return False
        end = None if occasion.last is None else occasion.last + 1
        asked = self._robustness(occasion.precondition).least > 0.0
        least, greatest = self._robustness(occasion.consequence, closed=True)
        waiting = asked & (least < 0.0) & (greatest > 0.0)
        return bool(waiting[occasion.first : end].any())

    def _find_violation(self, margin: float) -> None:
        """The first timestep after which no continuation could satisfy the formula; the last if
        none.

        The greatest robustness never rises as a trace goes on, so the interval is halved.
        """
        low, high, found = 0, len(self._times), margin
        while high - low > 1:
            n = (low + high) // 2
            here = float(self._robustness(self.rule.whole, last=n).greatest[0])
            if here < 0.0:
                high, found = n, here
            else:
                low = n
        self._violate(high - 1, found)

    def _hold(self, margin: float) -> None:
        """Note the robustness of a formula that was not violated, if it was triggered."""
        if self.judgement.verdict == HELD:
            self.judgement = dataclasses.replace(self.judgement, robustness=margin)

    # Both

    def _trigger(self, step: int) -> None:
        self.judgement = Judgement(
            self.name, HELD, trigger_time=self._times[step], ego_speed=self._speeds[step]
        )

    def _violate(self, step: int, margin: float) -> None:
        self.judgement = Judgement(
            self.name,
            VIOLATED,
            trigger_time=self.judgement.trigger_time,
            violation_time=self._times[step],
            ego_speed=self._speeds[step],
            robustness=margin,
        )
        self.decided, self.pending = True, False

    def _robustness(
        self, node: TruthNode, first: int = 0, last: int | None = None, closed: bool = False
    ) -> Bounds:
        """The robustness over the timesteps from the first up to, but not including, the last."""
        trace = {name: np.array(values[first:last]) for name, values in self._values.items()}
        n = len(self._times[first:last])
        try:
            return robustness(node, View(trace, n, self.rule.dt, closed))
        except NoNumber as error:
            time = self._times[first + error.step]
            place = self.rule.place(error.at)
            raise AssertionFault(f"{place}: has no number as its result at {time:.2f} s") from None
