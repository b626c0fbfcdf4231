"""Tree search over decisions, with double progressive widening.

Adaptive stress testing by Monte Carlo tree search (Lee et al., arXiv 1811.02188; Koren et al.,
arXiv 1902.01909): a node is a situation, an edge a decision. A node gets a new decision as its
visits grow, else the one with the best upper confidence bound is followed; a decision gets a new
situation likewise, else the nearest known one counts as what came. Every iteration plays a whole
episode: the decisions of the tree are repeated and the rest is drawn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cavsumo.agents.decisions import Situation
from cavsumo.searchers.decision_space import DecisionSpace
from cavsumo.searchers.protocol import GENERATION, LOWEST_GRADE, PlayedPoint
from cavsumo.searchers.space import Point

WIDTH, GROWTH = 1.5, 0.4  # a node of n visits has at most so many decisions: WIDTH n ** GROWTH
STATES, SPREADING = 1.0, 0.3  # likewise the situations that follow a decision
CURIOSITY = 0.3  # weight of what has hardly been tried
HARD_MPS = 10.0  # an impact counts as so much of a whole further worth


@dataclass
class TreeNode:
    """A situation, or the beginning: the decisions tried there."""

    edges: list[TriedDecision] = field(default_factory=list)
    visits: int = 0


@dataclass
class TriedDecision:
    """A decision at a node: how often it was followed, and the worth of the best episode so far.

    The best one counts and not their mean, as an episode with the same decisions is much the same.
    """

    decision: NDArray[np.float64]
    visits: int = 0
    told: int = 0
    worth: float = 0.0
    follows: dict[Situation, TreeNode] = field(default_factory=dict)
    counts: dict[Situation, int] = field(default_factory=dict)


class TreeSearch:
    """A tree whose root's decisions are the starts."""

    uniform = False

    def __init__(self, space: DecisionSpace, rng: np.random.Generator) -> None:
        self.space, self.rng = space, rng
        self._root = TreeNode()

    def ask(self) -> list[Point]:
        return [self._asked() for _ in range(GENERATION)]

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        for point, result in zip(points, told, strict=True):
            self._learn(point, result)

    def _asked(self) -> Point:
        """A point that follows the tree as far as it is known."""
        node, rows = self._root, list[NDArray[np.float64]]()
        while True:
            node.visits += 1
            if len(node.edges) < WIDTH * node.visits**GROWTH:
                break
            edge = max(node.edges, key=lambda e: self._bound(e, node.visits))
            edge.visits += 1
            rows.append(edge.decision)
            if not edge.follows:
                break
            node = edge.follows[self._situation(edge)]
        return self.space.completed(self.rng, np.array(rows).reshape(-1, self.space.width))

    def _bound(self, edge: TriedDecision, visits: int) -> float:
        """The upper confidence bound of a decision."""
        return edge.worth + CURIOSITY * math.sqrt(math.log(visits) / max(1, edge.visits))

    def _situation(self, edge: TriedDecision) -> Situation:
        """A situation that follows a decision, as often as it did."""
        known = list(edge.counts)
        counts = np.array([edge.counts[one] for one in known], dtype=float)
        return known[int(self.rng.choice(len(known), p=counts / counts.sum()))]

    def _learn(self, point: Point, result: PlayedPoint) -> None:
        """Add the decisions of an episode to the tree, and its worth to all of them."""
        node, worth = self._root, _worth(result.grade)
        rows = self.space.rows(point)
        for decision, after in zip(rows, (*result.situations, None), strict=False):
            edge = self._edge(node, decision)
            edge.told += 1
            edge.worth = max(edge.worth, worth)
            if after is None:
                return
            node = _following(edge, after)

    def _edge(self, node: TreeNode, decision: NDArray[np.float64]) -> TriedDecision:
        """The edge of a decision; a new one counts as followed."""
        for edge in node.edges:
            if np.array_equal(edge.decision, decision):
                return edge
        node.edges.append(TriedDecision(decision, visits=1))
        return node.edges[-1]


def _following(edge: TriedDecision, after: Situation) -> TreeNode:
    """The node of a situation after a decision, or of the nearest one if there are enough."""
    if after not in edge.follows:
        if len(edge.follows) < STATES * edge.told**SPREADING:
            edge.follows[after], edge.counts[after] = TreeNode(visits=1), 0
        else:
            after = min(edge.follows, key=lambda known: math.dist(known, after))
    edge.counts[after] += 1
    return edge.follows[after]


def _worth(grade: float) -> float:
    """The worth of a grade: from 0 for an invalid episode to 1, and above for failures."""
    if grade >= 0.0:
        return 1.0 + grade / HARD_MPS
    return 1.0 + grade / -LOWEST_GRADE
