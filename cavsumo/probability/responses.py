"""A model of how an ego responds, learned from what it did: a small tree, and what was seen.

In a state that was visited the model gives the responses seen there, elsewhere those of its leaf.
A little is left for every response, so that no future is held to be impossible.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from cavsumo.games import Game, from_arrays
from cavsumo.probability.tree import Floats, Ints, grown

LEAVES, LEAST = 60, 3
UNSEEN = 1e-3  # probability that is spread over all responses


class Process(Protocol):
    """A process that is disturbed by chance step by step, with a black box in it.

    Attributes:
        chances: the probability of each disturbance.
        states: their number; the last one is that of a failure, which is never left.
        first: the number of the first state.
        horizon: number of steps.
    """

    @property
    def chances(self) -> Floats: ...
    @property
    def states(self) -> int: ...
    @property
    def first(self) -> int: ...
    @property
    def horizon(self) -> int: ...

    def features(self, states: Ints) -> Floats:
        """The features of some states for a model of the black box, shape (n, features)."""

    def respond(self, states: Ints, rng: np.random.Generator) -> Ints:
        """The responses of the black box in some states, by chance or not."""

    def moved(self, states: Ints, disturbance: Ints, response: Ints) -> Ints:
        """The next states after disturbances and responses: known kinematics."""


class Responses:
    """A model of a black box.

    Attributes:
        values: the responses that occur.
        shares: the probability of each in every state but the last, shape (states - 1, responses).
    """

    def __init__(self, process: Process, states: Ints, responses: Ints) -> None:
        self.values, kind = np.unique(responses, return_inverse=True)
        seen = np.zeros((process.states - 1, len(self.values)))
        np.add.at(seen, (states, kind), 1.0)
        visited = np.flatnonzero(seen.sum(1))
        mean = seen[visited] / seen[visited].sum(1, keepdims=True)
        tree = grown(process.features(visited), mean, LEAVES, LEAST)
        leaves = np.zeros((len(tree.feature), len(self.values)))
        np.add.at(leaves, tree.leaf(process.features(visited)), mean)
        guess = leaves[tree.leaf(process.features(np.arange(process.states - 1)))]
        guess /= guess.sum(1, keepdims=True)
        guess = (1.0 - UNSEEN) * guess + UNSEEN / len(self.values)
        self.shares = (seen + UNSEEN * guess) / (seen.sum(1, keepdims=True) + UNSEEN)

    def game(self, process: Process) -> Game:
        """The decision process of disturbances with this model of the ego: one choice a state.

        The reward is the probability of failing, so its values are failure probabilities.
        """
        last, ways = process.states - 1, len(process.chances) * len(self.values)
        states = np.repeat(np.arange(last), ways)
        disturbance = np.tile(np.repeat(np.arange(len(process.chances)), len(self.values)), last)
        kind = np.tile(np.arange(len(self.values)), last * len(process.chances))
        there = process.moved(states, disturbance, self.values[kind])
        chance = process.chances[disturbance] * self.shares[states, kind]
        one_each = np.append(np.arange(last + 1), last)
        return from_arrays(
            goal=np.arange(process.states) == last,
            row_start=one_each,
            cell_start=np.arange(last + 1),
            outcome_start=ways * np.arange(last + 1),
            successor=there,
            probability=chance,
            reward=np.add.reduceat(chance * (there == last), ways * np.arange(last)),
            initial=process.first,
        )
