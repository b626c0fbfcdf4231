"""Avoidability of a violation: the episode again, with a reference driver that takes over.

Each rerun is the episode from its start in a simulation of its own. Until the takeover every
snapshot must equal the recorded one. The testers repeat their recorded actions, independently of
the ego, and keep their velocities after the end of the record: the question is how the ego could
have treated the conflict that it met (recorded trajectories, as in arXiv 2212.08148). No agent
learns from a rerun.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

from cavsumo.agents.base import Agent
from cavsumo.agents.recorded import Recorded
from cavsumo.assertions.base import Assertion
from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.egos.reference import Reference
from cavsumo.egos.reference.encounter import encounter
from cavsumo.errors import BranchError, CavsumoError
from cavsumo.model.departures import Demand
from cavsumo.model.forks import can_fork, cost_of_fork, result_of
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.simulation.avoidability_guess import foreseen
from cavsumo.simulation.episode import Episode
from cavsumo.simulation.loop import EpisodeLoop
from cavsumo.simulation.playback import doing, playback, recorded
from cavsumo.simulation.reruns import Rerun
from cavsumo.simulation.setup import Setup

MOST_RERUNS = 6  # a search that needs more reports its bounds
# A rerun up to a takeover that takes this long [s] and as many forks is worth forking: on small
# networks reruns from the start are as quick (benchmarks/README.md, Branches).
SLOW_S, FORKS = 0.2, 4.0
STRIDES = (1, 4)  # how far from the last answer the next one is asked for, then halfway [timesteps]
NOTABLE_MPS = 1.5  # less speed lost avoids little
FORK_S = 3600.0  # time for a fork, far above that of any episode; the caller's own ends it before
NOT_MONOTONE = "not monotone: a later takeover avoided it and an earlier one did not"


@dataclass(frozen=True)
class Avoidability:
    """Whether a reference driver would have avoided a violation.

    Attributes:
        avoidable: whether it would, perceiving the risk where it first can; None if not judged.
        last_chance: time of the latest perception with which it still would [s]; None if never.
        margin: how long before the violation that is [s].
        note: what kept it from being judged, or what to doubt, as a sentence.
        by_ideal: whether the ideal driver would have avoided it; None if not judged.
        perceived: when the reference driver perceived the risk [s]; None if not judged.
    """

    avoidable: bool | None
    last_chance: float | None = None
    margin: float | None = None
    note: str = ""
    by_ideal: bool | None = None
    perceived: float | None = None


class NotJudged(CavsumoError):
    """A violation of which no reference driver can be judged."""


@dataclass(frozen=True)
class AvoidabilityCheck:
    """An episode that ended in a violation, to be played again with other drivers.

    Attributes:
        setup, agents, seed: with which it was played.
        record: whether everybody was shown in its snapshots.
        episode: what happened; its frames and actions were kept.
        demand: the departures with which it was played; None for the scenario's own demand, which
            goes on where a rerun outlasts the episode.
        beat: called before each rerun, so that a waiting process knows that it continues.
        kept: the same episode at its start, which the reruns may use up; None to start SUMO again.
    """

    setup: Setup
    agents: Sequence[Agent]
    seed: int
    record: bool
    episode: Episode
    beat: Callable[[], None]
    demand: Demand | None = None
    kept: EpisodeLoop | None = None

    @property
    def broken(self) -> Assertion:
        """The assertion that was violated.

        Known by its name: what the setup's assertions judge is of the latest episode played there.
        """
        name = self.episode.judgement.assertion
        return next(a for a in self.setup.assertions if a.name == name)

    @property
    def end(self) -> int:
        """The timestep of the violation."""
        time = self.episode.judgement.violation_time
        assert time is not None
        return min(round(time / self.setup.world.dt), len(self.episode.frames) - 1)

    def judged(self, reference: Reference, ideal: Reference | None = None) -> Avoidability:
        """Whether a reference driver would have avoided it, and until when.

        ``ideal``: another driver; of it only the first is asked (``Avoidability.by_ideal``).
        """
        try:
            return self._judged(reference, ideal)
        except CavsumoError as error:
            return Avoidability(None, note=f"not judged: {error}")

    def _judged(self, reference: Reference, ideal: Reference | None) -> Avoidability:
        self._check_moving()
        end, frames = self.end, self.episode.frames
        perceived, guess = self._perceived(reference), self._guess(reference)
        outcomes: dict[int, bool] = {end: False}
        # The search asks for few takeovers before both, and for none in the last timestep.
        first = max(0, min(perceived, guess) - sum(STRIDES))
        avoided = self._forked(first) if first < end - 1 else self._avoided

        def avoids(step: int) -> bool:
            if step not in outcomes:
                outcomes[step] = avoided(reference, step)
            return outcomes[step]

        avoidable = avoids(perceived)
        low, high = latest(avoids, guess, perceived if avoidable else -1, end, MOST_RERUNS - 1)
        notes = [NOT_MONOTONE] if perceived < low and not avoidable else []
        if high - low > 1:
            notes.append(
                f"{MOST_RERUNS} reruns leave open whether a perception up to "
                f"{frames[high - 1].time:.1f} s would have been early enough"
            )
        by_ideal = avoidable if type(ideal) is type(reference) else None
        if ideal is not None and by_ideal is None:
            by_ideal = self._first_avoided(ideal, avoided)
        found = Avoidability(
            avoidable,
            note="; ".join(notes),
            by_ideal=by_ideal,
            perceived=frames[perceived].time,
        )
        if low < 0:
            return found
        last, margin = frames[low].time, frames[end].time - frames[low].time
        return dataclasses.replace(found, last_chance=last, margin=margin)

    def _first_avoided(
        self, reference: Reference, avoided: Callable[[Reference, int], bool]
    ) -> bool | None:
        """Whether a reference driver avoids it from its perception on; None if a rerun fails."""
        perceived = self._perceived(reference)
        try:
            return perceived < self.end and avoided(reference, perceived)
        except CavsumoError:
            return None

    def avoidable(self, reference: Reference) -> bool:
        """Whether a reference driver would have avoided it, by one rerun at most.

        Raises NotJudged for a violation by a standing ego, Diverged if the rerun is another
        episode.
        """
        self._check_moving()
        perceived = self._perceived(reference)
        return perceived < self.end and self._avoided(reference, perceived)

    def _check_moving(self) -> None:
        """Raise NotJudged if the ego stood at the violation."""
        if self.episode.frames[self.end].ego.v <= STANDING_MPS:
            raise NotJudged("the ego stood, and the references only brake")

    def _perceived(self, reference: Reference) -> int:
        """The timestep at which the reference perceives the risk.

        Without a body to look at it is the trigger of the assertion.
        """
        bodies = self._bodies
        if bodies is None:
            return self._trigger()
        scene, frames = self._scene(), self.episode.frames[: self.end + 1]
        met = [b and encounter(scene, f, b) for f, b in zip(frames, bodies, strict=True)]
        found = reference.perceived(met, self.setup.world.dt)
        return self.end if found is None else found

    def _guess(self, reference: Reference) -> int:
        """A guess of the last chance, as a timestep."""
        dt, end, bodies = self.setup.world.dt, self.end, self._bodies
        if bodies is None:
            return end - self._delay(reference)
        there = [b for b in bodies if b is not None]
        guess = end - 1
        if len(there) == len(bodies):
            guess = foreseen(self.episode.frames[: end + 1], there, reference, dt)
        if self.episode.judgement.impact_speed is None:  # it needs no touch to be violated
            guess = min(guess, end - self._delay(reference))
        return guess

    def _delay(self, reference: Reference) -> int:
        """How many timesteps it takes a reference to change the course of things a little."""
        dt, kind = self.setup.world.dt, self.setup.ego.kind
        steps = range(self.end)
        return next((i for i in steps if reference.speed_lost(i * dt, kind) >= NOTABLE_MPS), 1)

    def _trigger(self) -> int:
        """The timestep at which the precondition began to hold."""
        time = self.episode.judgement.trigger_time or 0.0
        return min(round(time / self.setup.world.dt), self.end)

    @cached_property
    def _bodies(self) -> list[BodyState | None] | None:
        """The body of the violation at each timestep up to it; None when none is involved."""
        name = self.episode.judgement.tester
        if not name:
            return None
        frames = self.episode.frames[: self.end + 1]
        return [_named(frame, name) for frame in frames]

    def _scene(self) -> Scene:
        """The scene of the encounters: paths and roads of the site."""
        world = self.setup.world
        return self.setup.site.scene(world.dt, world.ego_body, self.setup.bodies, (), self.seed)

    def _avoided(self, reference: Reference, step: int) -> bool:
        """Whether the ego that is taken over at a timestep violates nothing and hits nobody.

        Found by a rerun from the start.
        """
        self.beat()
        return self._rerun().avoids(reference, step)

    def _rerun(self, kept: EpisodeLoop | None = None) -> Rerun:
        """The episode about to be played again, in this process.

        Args:
            kept: the episode at its start, to begin with it in place of a new simulation.
        """
        if kept is not None:
            actions = [list(joint) for joint in self.episode.actions]
            kept.hand_over(doing(actions, len(self.setup.teams)))
            return Rerun(kept, self.episode, self.broken)
        # Where nobody looks at the background, a rerun shows as much of it as contacts need.
        record = any(a.sees_background for a in self.setup.assertions)
        setup = dataclasses.replace(self.setup, assertions=(self.broken,))
        loop = playback(setup, self._recorded, record=record, alike=self.agents)
        return Rerun(loop, self.episode, self.broken)

    def _forked(self, first: int) -> Callable[[Reference, int], bool]:
        """``_avoided`` by forks of one rerun that has come to a timestep, where that pays.

        An earlier takeover, or a fork that fails, is found out by a rerun of its own.
        """
        if self.setup.ego.outside or not can_fork():
            return self._avoided
        self.beat()
        begun = time.process_time()
        rerun = self._rerun(self.kept)
        rerun.advance(first)
        spent = math.inf if self.kept else time.process_time() - begun
        pays = spent > SLOW_S and spent > FORKS * cost_of_fork()
        alone = False  # whether its simulation is used up, by itself or by another rerun

        def avoids(reference: Reference, step: int) -> bool:
            nonlocal alone
            if alone or step < rerun.step:
                alone = True
                return self._avoided(reference, step)
            self.beat()
            if pays:
                found = result_of(lambda: rerun.avoids(reference, step), FORK_S)
                if not isinstance(found, BranchError):
                    return found
            alone = True
            return self._avoided(reference, step) if pays else rerun.avoids(reference, step)

        return avoids

    @cached_property
    def _recorded(self) -> Recorded:
        """The episode, to be played back."""
        return recorded(self.setup, self.episode, self.seed, self.demand)


def preventable(check: AvoidabilityCheck, reference: Reference) -> bool | None:
    """Whether a reference driver would have avoided a violation, and no more; None if not judged.

    One rerun at most, where ``AvoidabilityCheck.judged`` also finds out until when.
    """
    try:
        return check.avoidable(reference)
    except CavsumoError:
        return None


def latest(
    avoids: Callable[[int], bool], guess: int, low: int, high: int, most: int
) -> tuple[int, int]:
    """The last timestep at which a takeover avoids, and the first after it at which none does.

    Assumes that earlier takeovers avoid what a takeover avoids. Asks at a guess, next to it
    and some steps on, then by bisection: a right guess is confirmed by two calls. Where ``most``
    calls are not enough the two are further apart.

    Args:
        low, high: a timestep at which a takeover is known to avoid, -1 for none, and one at which
            it is known not to.
    """
    probe = min(max(guess, low + 1), high - 1)
    strides = iter(STRIDES)
    for _ in range(most):
        if high - low <= 1:
            break
        stride = next(strides, high)
        if avoids(probe):
            low, probe = probe, probe + stride
        else:
            high, probe = probe, probe - stride
        if not low < probe < high:
            probe = (low + high) // 2
    return low, high


def _named(frame: Snapshot, name: str) -> BodyState | None:
    """A tester or background body in a snapshot."""
    for tester in frame.testers:
        if tester.id == name:
            return tester
    return next((BodyState(*raw) for raw in frame.raw_background if raw[0].id == name), None)
