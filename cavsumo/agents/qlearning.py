"""Algorithm 6 of the seed: Q-learning with linear features.

The continuous actions are reduced to a few durative ones: stand, or walk at full speed along one
of four headings (along the road, across it, and back), each held for a while. Throttle and
steering follow from the chosen target at every timestep, so the effectors' limits hold.

A decision lasts several timesteps, so its reward is the discounted sum over them and the next
value is discounted by gamma to the power of their number (semi-Markov Q-learning). Goals and dead
ends are not bootstrapped; the horizon is, because only the simulation ends there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cavsumo.agents.base import AGENTS, Agent, learner_of
from cavsumo.agents.features import FEATURES, TARGETS, Features, towards
from cavsumo.agents.staying import Staying
from cavsumo.model.bodies import Action
from cavsumo.model.checks import number, truth, whole
from cavsumo.model.documents import json_of, read_text
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

LARGEST = 1e100  # a weight; sums and products of larger ones may overflow


@AGENTS.register("q-learning")
class QLearningAgent(Agent):
    """Algorithm 6: learns from episode to episode which walking targets lead to tests."""

    sees_background = False
    drives = False
    FILES = ("weights",)

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "alpha": "learning rate in the first episode (0..1]",
        "gamma": "discount per second (0..1]; 1 for the undiscounted game",
        "epsilon": "exploration rate per decision in the first episode [0..1]",
        "half_life": "episodes after which alpha and epsilon have halved",
        "hold_s": "how long an action lasts [s]",
        "weights": "manifest of an earlier batch, or a JSON file, with the weights to begin with",
        "learn": "false to play the weights greedily without changing them",
    }

    def __init__(
        self,
        alpha: float = 0.05,
        gamma: float = 0.98,
        epsilon: float = 0.3,
        half_life: float = 100.0,
        hold_s: float = 0.5,
        weights: str | None = None,
        learn: bool = True,
    ) -> None:
        self.alpha = number("alpha", alpha, 0.0, 1.0)
        self.gamma = number("gamma", gamma, 0.0, 1.0)
        self.epsilon = number("epsilon", epsilon, 0.0, 1.0)
        self.half_life = number("half_life", half_life, 1e-9)
        self.hold_s = number("hold_s", hold_s, 0.0)
        self.learn = self.learns = truth("learn", learn)
        self.weights = [0.0] * len(FEATURES) if weights is None else load_weights(Path(weights))
        self.episodes = 0

    def recall(self) -> Any:
        return {
            "weights": dict(zip(FEATURES, self.weights, strict=True)),
            "episodes": self.episodes,
        }

    def remember(self, memory: Any) -> None:
        self.weights = weights_in(memory)
        self.episodes = whole("episodes", memory["episodes"])

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        decay = 0.5 ** (self.episodes / self.half_life)
        self.episodes += self.learn
        self._alpha = self.alpha * decay if self.learn else 0.0
        self._epsilon = self.epsilon * decay if self.learn else 0.0
        self._steps = max(1, round(self.hold_s / scene.dt))
        self._discount = self.gamma**scene.dt
        self.features = [Features(scene, i) for i in owned]
        self._staying = [Staying(scene, i) for i in owned]
        self._decided: list[tuple[int, list[float]]] = []
        self._held, self._return = 0, 0.0

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        if not self._decided:
            self._decided = [self._decide(i, snapshot) for i in range(len(self.owned))]
        return tuple(
            staying.action(state, towards(state, features.across, target, self.scene.dt))
            for staying, state, features, (target, _) in zip(
                self._staying, self.own(snapshot), self.features, self._decided, strict=True
            )
        )

    def process_feedback(
        self,
        snapshot: Snapshot,
        action: tuple[Action, ...],
        reward: float,
        successor: Snapshot,
        terminal: bool,
    ) -> None:
        self._return += self._discount**self._held * reward
        self._held += 1
        if terminal or self._held >= self._steps:
            if self.learn:
                self._update(successor, terminal)
            self._decided, self._held, self._return = [], 0, 0.0

    def q_value(self, features: Sequence[float]) -> float:
        """The seed's QValue: the weighted sum of the features."""
        return total(w * f for w, f in zip(self.weights, features, strict=True))

    def _decide(self, i: int, snapshot: Snapshot) -> tuple[int, list[float]]:
        """A target for one body, with its features: random, or the best with ties drawn."""
        options = [self.features[i].values(snapshot, target) for target in range(len(TARGETS))]
        if self.rng.random() < self._epsilon:
            chosen = int(self.rng.integers(len(options)))
        else:
            values = [self.q_value(f) for f in options]
            best = [t for t, value in enumerate(values) if value == max(values)]
            chosen = best[0] if len(best) == 1 else int(self.rng.choice(best))
        return chosen, options[chosen]

    def _update(self, successor: Snapshot, terminal: bool) -> None:
        """One step of gradient descent; the bodies' values add up to the agent's."""
        future = (
            0.0 if terminal else total(self._best(i, successor) for i in range(len(self.owned)))
        )
        target = self._return + self._discount**self._held * future
        joint = [total(column) for column in zip(*(f for _, f in self._decided), strict=True)]
        error = target - self.q_value(joint)
        self.weights = [
            w + self._alpha * error * f for w, f in zip(self.weights, joint, strict=True)
        ]

    def _best(self, i: int, snapshot: Snapshot) -> float:
        """The value of the best target for one body."""
        options = (self.features[i].values(snapshot, target) for target in range(len(TARGETS)))
        return max(self.q_value(f) for f in options)


def total(values: Iterable[float]) -> float:
    """The sum from left to right, rounded after each term.

    The built-in ``sum`` compensates the rounding of floats since Python 3.12, so weights learned
    with it would differ in the last digits between versions.
    """
    found = 0.0
    for value in values:
        found += value
    return found


def load_weights(file: Path) -> list[float]:
    """Weights from a JSON file with a number for each feature; ValueError when it is none."""
    text = read_text(file, "weights", ValueError)
    try:
        data = json_of(text)
        if "learned" in data:  # the manifest of a batch
            data = learner_of(data["learned"], "q-learning")[0]
        return weights_in(data)
    except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
        raise ValueError(
            f"weights {str(file)!r}: expected a JSON object with 'weights', finite numbers for the "
            f"features {', '.join(FEATURES)}"
        ) from error


def weights_in(data: Any) -> list[float]:
    """The weights in the knowledge of an agent; an exception where they are missing or damaged."""
    return [number(name, data["weights"][name], -LARGEST, LARGEST) for name in FEATURES]
