"""The protocol of tester agents, which see snapshots and choose actions for the bodies they own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from cavsumo.agents.names import AGENT_NAMES
from cavsumo.model.bodies import NOOP, Action, Kind
from cavsumo.model.carriageway import StartRecord
from cavsumo.model.registry import Registry
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

VERDICTS = SURE, UNDECIDED, NOT_FORCEABLE = "sure", "undecided", "not-forceable"


class Forecast(NamedTuple):
    """The forecast of an agent for an episode before it is played.

    Attributes:
        verdict: SURE, UNDECIDED or NOT_FORCEABLE: whether it brings about a test.
        value: of its game where the episode starts: 0 for a test, -1 for none.
    """

    verdict: str
    value: float

    def rank(self) -> tuple[int, float]:
        """The larger, the better for the tester."""
        return -VERDICTS.index(self.verdict), self.value


class Agent:
    """Base of the tester agents; on its own it does nothing at all.

    An agent exists for a whole batch: ``reset`` begins an episode and keeps its knowledge.

    Attributes:
        sees_background: whether it looks at background traffic farther than ``snapshot.AROUND_M``
            from its bodies. Set False where it does not: when nobody in an episode does, bodies
            that are far from everybody are left out of the snapshots.
        drives: whether its bodies may be vehicles. Set False where it can only walk.
        learns: whether episodes change what it knows: then they are played in sequence.
        searches: whether a searcher tells it before each episode what to play (``searchers``).
        promise: the class of egos for which its forecasts hold; empty for none.
        manoeuvre: the one manoeuvre that its vehicles are asked to do (``manoeuvres.MANOEUVRES``):
            they start where it is possible; "auto" for whichever is possible where they start.
        recorded_starts: where its bodies start, for an agent that plays back; empty to draw it.
        recorded_waits: where they wait until the ego has entered; empty for where they start.
        FILES: its parameters that name files; their checksums are noted with the results.
    """

    PARAMETERS: ClassVar[Mapping[str, str]] = {}
    FILES: ClassVar[tuple[str, ...]] = ()
    learns: bool = False
    searches: bool = False
    sees_background: bool = True
    drives: bool = True
    promise: str = ""
    manoeuvre: str = "auto"
    recorded_starts: Sequence[StartRecord] = ()
    recorded_waits: Sequence[StartRecord] = ()

    scene: Scene
    owned: tuple[int, ...]
    rng: np.random.Generator

    def check_bodies(self, kind: Kind, bodies: int) -> None:
        """Raise ValueError unless the agent can own so many bodies of a kind."""

    def prepare(self) -> None:
        """Do long computations once, before the first episode; called in every process."""

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        """Begin an episode with the bodies ``scene.bodies[i] for i in owned``.

        The generator belongs to this agent for this episode alone.
        """
        self.scene, self.owned, self.rng = scene, tuple(owned), rng

    def forecast(self, snapshot: Snapshot) -> Forecast | None:
        """Whether this episode brings about a test; called once, before the first action.

        None for agents that do not know.
        """
        return None

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        """An action for each owned body, in their order (seed, ChooseAction)."""
        return tuple(NOOP for _ in self.owned)

    def process_feedback(
        self,
        snapshot: Snapshot,
        action: tuple[Action, ...],
        reward: float,
        successor: Snapshot,
        terminal: bool,
    ) -> None:
        """Learn from one timestep (seed, ProcessFeedback); most agents learn nothing.

        ``terminal``: the successor is a goal or a dead end, so nothing follows it. It is False
        at the horizon, where only the simulation ends.
        """

    def notes(self) -> str:
        """Notes on the episode for its searcher, a cell of its row; empty for none."""
        return ""

    def rests(self) -> bool:
        """Whether none of its bodies moves any more in this episode; a promise.

        Where all agents say so of bodies that the ego has left behind, the episode ends early.
        """
        return False

    def stops(self) -> bool:
        """Whether the test that it plays is over, so that the episode ends."""
        return False

    def recall(self) -> Any:
        """The knowledge of the agent, as plain data; None when it does not learn."""
        return None

    def remember(self, memory: Any) -> None:
        """Take up the knowledge of an earlier instance of this agent."""

    def check_memory(self, memory: Any, bodies: int) -> None:
        """Raise an exception unless it can take up this knowledge, which comes from a file.

        ``bodies``: how many it owns.
        """
        self.remember(memory)

    def own(self, snapshot: Snapshot) -> list[BodyState]:
        """The states of the owned bodies."""
        return [snapshot.testers[i] for i in self.owned]

    @classmethod
    def coordinate(cls, agents: Sequence[Agent], rng: np.random.Generator) -> None:
        """Make the agents of one episode known to each other; called after their resets."""


AGENTS: Registry[Agent] = Registry(AGENT_NAMES)


@AGENTS.register("noop")
class NoopAgent(Agent):
    """Does nothing: its bodies keep their speed and direction (the seed's noop)."""

    sees_background = False


def learner_of(learned: Mapping[str, Any], name: str) -> Any:
    """The knowledge of a batch's learner in its manifest: that without a label, or the only one."""
    if name not in learned and len(learned) == 1:
        return next(iter(learned.values()))
    return learned[name]
