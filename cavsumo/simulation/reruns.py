"""An episode again up to a takeover by a reference driver, and beyond it.

Until the takeover every snapshot must equal the recorded one.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from cavsumo.assertions.base import VIOLATED, Assertion, Judgement
from cavsumo.assertions.contacts import STANDING_MPS, Contact
from cavsumo.egos.reference import Reference
from cavsumo.egos.reference.takeover import Takeover
from cavsumo.errors import CavsumoError
from cavsumo.model.snapshot import Snapshot
from cavsumo.model.zone_presence import is_vehicle, ran_into
from cavsumo.simulation.episode import Episode
from cavsumo.simulation.loop import EpisodeLoop

STILL_MPS = 1e-6  # rounding apart, the ego has come to stand


def same(now: Snapshot, recorded: Snapshot) -> bool:
    """Whether a snapshot is the recorded one, as far as both show the background."""
    fewer, more = sorted((now.raw_background, recorded.raw_background), key=len)
    return now._replace(raw_background=recorded.raw_background) == recorded and all(
        raw in more for raw in fewer
    )


class ContactWatch(Assertion):
    """The assertion of a rerun: from the takeover on the moving ego touches no body.

    A body that touches the standing ego, or a vehicle that runs into the side or rear of a moving
    one, is no failure of the driver; nor is a body that the original touched before.

    Args:
        since: the timestep of the takeover; infinite as long as there is none.
    """

    name = "takeover"
    sees_background = False

    def __init__(self, since: float = -1) -> None:
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


class Rerun:
    """An episode that is played again, with its original ego so far.

    Args:
        loop: the episode once more, at its start; it is this rerun's own.
        episode: what it was, with all its snapshots.
        broken: the assertion that was violated.
    """

    def __init__(self, loop: EpisodeLoop, episode: Episode, broken: Assertion) -> None:
        self._loop, self._episode, self._broken = loop, episode, broken
        loop.measured = False
        self._watch = ContactWatch(math.inf)
        self._watch.reset(loop.scene)
        self._ego = Takeover(loop.setup.ego, drives=episode.drives)
        self._ego.begin(loop.scene)
        assertions = broken, self._watch
        loop.setup = dataclasses.replace(loop.setup, ego=self._ego, assertions=assertions)
        self._check_same()

    @property
    def step(self) -> int:
        """The timestep up to which it was played."""
        return self._loop.snapshot.step

    def advance(self, step: int) -> None:
        """Play it up to a timestep with its original ego; raises Diverged."""
        while self.step < step and not (self._loop.over or self._violated):
            self._loop.step()
            self._check_same()

    def avoids(self, reference: Reference, step: int) -> bool:
        """Whether the ego that is taken over at a timestep violates nothing and hits nobody.

        Known as soon as it stands, where it is about contact or the assertion has decided; else at
        the end of the episode. The rerun is then another episode.

        Args:
            step: not before the timestep up to which it was played.
        """
        self._ego.take_over(reference, step)
        self._watch.since = step
        by_contact = self._episode.judgement.impact_speed is not None
        self.advance(step)
        while True:
            now = self._loop.snapshot
            if self._violated:
                return False
            stands = now.step > step and now.ego.v < STILL_MPS
            if self._loop.over or (stands and (by_contact or self._broken.decided)):
                return True
            self._loop.step()

    @property
    def _violated(self) -> bool:
        """Whether the violated assertion is so again, or the driver hit somebody."""
        return VIOLATED in (self._broken.judgement.verdict, self._watch.judgement.verdict)

    def _check_same(self) -> None:
        """Raise Diverged unless the snapshot is the recorded one."""
        now = self._loop.snapshot
        recorded = self._episode.frames[now.step]
        if same(now, recorded):
            return
        what = "the ego" if now.ego != recorded.ego else "somebody"
        raise Diverged(f"the episode again is another one: {what} differs at {now.time:.2f} s")
