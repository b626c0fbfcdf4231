"""Avoidability of a violation: the episode again, with a reference driver that takes over.

Each rerun is the episode from its start in a simulation of its own. Until the takeover every
snapshot must equal the recorded one. The testers repeat their recorded actions, independently of
the ego, and keep their velocities after the end of the record: the question is how the ego could
have treated the conflict that it met (recorded trajectories, as in arXiv 2212.08148). No agent
learns from a rerun.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

from cavsumo.agents.base import Agent
from cavsumo.agents.recorded import Recorded
from cavsumo.assertions.base import VIOLATED, Assertion, Judgement
from cavsumo.assertions.contacts import STANDING_MPS, Contact
from cavsumo.egos.reference import Reference
from cavsumo.egos.reference.encounter import encounter
from cavsumo.egos.reference.takeover import Takeover
from cavsumo.errors import CavsumoError
from cavsumo.model.departures import Demand
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.model.zone_presence import is_vehicle, ran_into
from cavsumo.simulation.avoidability_guess import foreseen
from cavsumo.simulation.loop import Episode
from cavsumo.simulation.playback import playback, recorded
from cavsumo.simulation.setup import Setup

MOST_RERUNS = 6  # a search that needs more reports its bounds
STRIDES = (1, 4)  # how far from the last answer the next one is asked for, then halfway [timesteps]
NOTABLE_MPS = 1.5  # less speed lost avoids little
STILL_MPS = 1e-6  # rounding apart, the ego has come to stand
NOT_MONOTONE = "not monotone: a later takeover avoided it and an earlier one did not"


@dataclass(frozen=True)
class Avoidability:
    """Whether a reference driver would have avoided a violation.

    Attributes:
        avoidable: whether it would, perceiving the risk where it first can; None if not judged.
        last_chance: time of the latest perception with which it still would [s]; None if never.
        margin: how long before the violation that is [s].
        note: what kept it from being judged, or what to doubt, as a sentence.
    """

    avoidable: bool | None
    last_chance: float | None = None
    margin: float | None = None
    note: str = ""


class ContactWatch(Assertion):
    """The assertion of a rerun: from the takeover on the moving ego touches no body.

    A body that touches the standing ego, or a vehicle that runs into the side or rear of a moving
    one, is no failure of the driver; nor is a body that the original touched before.

    Args:
        since: the timestep of the takeover.
    """

    name = "takeover"
    sees_background = False

    def __init__(self, since: int = -1) -> None:
        self.since = since

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        ego = snapshot.ego
        if snapshot.step <= self.since:
            return
        for contact in contacts:
            if contact.a is not ego or ego.v <= STANDING_MPS:
                continue
            if not (is_vehicle(contact.b) and ran_into(contact.b, ego, self.scene.dt)):
                self.decided = True
                self.judgement = Judgement(self.name, VIOLATED, contact.b.id)


class Diverged(CavsumoError):
    """A rerun was not the same until the takeover."""


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
    """

    setup: Setup
    agents: Sequence[Agent]
    seed: int
    record: bool
    episode: Episode
    beat: Callable[[], None]
    demand: Demand | None = None

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

    def judged(self, reference: Reference) -> Avoidability:
        """Whether a reference driver would have avoided it, and until when."""
        try:
            return self._judged(reference)
        except CavsumoError as error:
            return Avoidability(None, note=f"not judged: {error}")

    def _judged(self, reference: Reference) -> Avoidability:
        end, frames = self.end, self.episode.frames
        if frames[end].ego.v <= STANDING_MPS:
            return Avoidability(
                None, note="not judged: the ego stood, and the references only brake"
            )
        perceived, guess = self._risk(reference)
        outcomes: dict[int, bool] = {end: False}

        def avoids(step: int) -> bool:
            if step not in outcomes:
                outcomes[step] = self._avoided(reference, step)
            return outcomes[step]

        avoidable = avoids(perceived)
        low, high = latest(avoids, guess, perceived if avoidable else -1, end, MOST_RERUNS - 1)
        notes = [NOT_MONOTONE] if perceived < low and not avoidable else []
        if high - low > 1:
            notes.append(
                f"{MOST_RERUNS} reruns leave open whether a perception up to "
                f"{frames[high - 1].time:.1f} s would have been early enough"
            )
        note = "; ".join(notes)
        if low < 0:
            return Avoidability(avoidable, note=note)
        return Avoidability(avoidable, frames[low].time, frames[end].time - frames[low].time, note)

    def _risk(self, reference: Reference) -> tuple[int, int]:
        """When the reference perceives the risk, and a guess of the last chance, as timesteps.

        Without a body to look at it is the trigger of the assertion.
        """
        dt, end = self.setup.world.dt, self.end
        bodies = self._bodies()
        if bodies is None:
            return self._trigger(), end - self._delay(reference)
        scene, frames = self._scene(), self.episode.frames[: end + 1]
        met = [b and encounter(scene, f, b) for f, b in zip(frames, bodies, strict=True)]
        found = reference.perceived(met, dt)
        there = [b for b in bodies if b is not None]
        guess = foreseen(frames, there, reference, dt) if len(there) == len(bodies) else end - 1
        if self.episode.judgement.impact_speed is None:  # it needs no touch to be violated
            guess = min(guess, end - self._delay(reference))
        return (end if found is None else found), guess

    def _delay(self, reference: Reference) -> int:
        """How many timesteps it takes a reference to change the course of things a little."""
        dt, kind = self.setup.world.dt, self.setup.ego.kind
        steps = range(self.end)
        return next((i for i in steps if reference.speed_lost(i * dt, kind) >= NOTABLE_MPS), 1)

    def _trigger(self) -> int:
        """The timestep at which the precondition began to hold."""
        time = self.episode.judgement.trigger_time or 0.0
        return min(round(time / self.setup.world.dt), self.end)

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

        Known as soon as it stands, where it is about contact or the assertion has decided; else at
        the end of the episode.
        """
        self.beat()
        episode, broken, watch = self.episode, self.broken, ContactWatch(step)
        # Bodies that the rerun leaves out count with their states of the first episode.
        record = self.record or any(a.sees_background for a in self.setup.assertions)
        ego = Takeover(self.setup.ego, reference, step, drives=episode.drives)
        setup = dataclasses.replace(self.setup, ego=ego, assertions=(broken, watch))
        rerun = playback(setup, self._recorded, record=record, alike=self.agents)
        by_contact = episode.judgement.impact_speed is not None
        while True:
            now = rerun.snapshot
            if now.step <= step:
                self._check_same(now)
            if VIOLATED in (broken.judgement.verdict, watch.judgement.verdict):
                return False
            stands = now.step > step and now.ego.v < STILL_MPS
            if rerun.over or (stands and (by_contact or broken.decided)):
                return True
            rerun.step()

    def _check_same(self, now: Snapshot) -> None:
        """Raise Diverged unless a snapshot is the recorded one."""
        recorded = self.episode.frames[now.step]
        if now == recorded:
            return
        what = "the ego" if now.ego != recorded.ego else "somebody"
        raise Diverged(f"the episode again is another one: {what} differs at {now.time:.2f} s")

    @cached_property
    def _recorded(self) -> Recorded:
        """The episode, to be played back."""
        return recorded(self.setup, self.episode, self.seed, self.demand)


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
