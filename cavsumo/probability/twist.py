"""The learned twist: disturbances drawn by the values of a decision process, weighted exactly.

1. Play some runs under tilted chances and note how the ego responds.
2. Fit a small model of the responses and solve the decision process (``responses``,
   ``cavsumo.games``): V_k(s) is the probability of a failure within k steps, were the model true.
3. Play the true process with the disturbance a drawn in proportion to

       q(a | s) = (1 - m) P(a) + m P(a) V(s') / sum over a of P(a) V(s')        (E over responses)

   and weigh each run by its likelihood ratio, so the estimate is unbiased for any model.
4. Do so twice for learning from what was seen near failures, then for the estimate.

A share of the runs has another m or values to the power 1/2 (``COMPONENTS``). Every run is weighed
by the mixture of all, so no weight is large where any of them is right. Compare NADE (Feng et al.
2021, Nat. Commun. 12, 748).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cavsumo.games.horizon import horizon_values
from cavsumo.probability.responses import Process, Responses
from cavsumo.probability.tree import Floats, Ints
from cavsumo.probability.weights import LEVEL, Estimate, contradicts, weighted

EXPLORED, PILOTS = 200, (200, 400)

# Of a step, the states and the numbers of the runs: (components, runs, disturbances).
Proposals = Callable[[int, Ints, Ints], Floats]


class Component(NamedTuple):
    """A part of the mixture of proposals: its share, its m, and the power of its values."""

    share: float
    twist: float
    power: float


COMPONENTS = (Component(0.7, 0.9, 1.0), Component(0.2, 0.9, 0.5), Component(0.1, 0.5, 1.0))


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs of a process.

    Attributes:
        terms: 1{failure} w of each run.
        states, responses: how the ego responded, in every step of every run.
    """

    terms: Floats
    states: Ints
    responses: Ints


class TwistedEstimate(NamedTuple):
    """The result of a learned twist: the estimate, and the steps, those of learning included."""

    estimate: Estimate
    steps: int


def estimate_by_twist(
    process: Process, rng: np.random.Generator, runs: int = 1000, level: float = LEVEL
) -> TwistedEstimate:
    """The probability that a process fails within its horizon; ``runs`` are those of the estimate.

    Refused where the estimate contradicts its last pilot, or rests on few runs.
    """
    seen = [explored(process, EXPLORED, rng)]
    for count in (*PILOTS, runs):
        values = learned_values(process, seen)
        seen.append(twisted(process, values, count, rng))
    pilot, found = weighted(seen[-2].terms, 0.999), weighted(seen[-1].terms, level)
    found = replace(found, episodes=sum(len(one.terms) for one in seen))
    if not found.refused and not pilot.refused and contradicts(pilot, found):
        found = replace(found, refused="the estimate contradicts its pilot")
    return TwistedEstimate(found, sum(len(one.states) for one in seen))


class LearnedValues(NamedTuple):
    """The values of a decision process with a model of the ego, of k steps in row k."""

    table: Floats
    model: Responses

    def worth(self, process: Process, states: Ints, steps: int) -> Floats:
        """The value after each disturbance, with so many steps left: (states, disturbances)."""
        disturbances = np.arange(len(process.chances))[:, None]
        there = process.moved(states[:, None, None], disturbances, self.model.values)
        worth: Floats = np.einsum("sdr,sr->sd", self.table[steps][there], self.model.shares[states])
        return worth


def learned_values(process: Process, seen: list[Runs]) -> LearnedValues:
    """The values by a model of all responses that were seen."""
    states = np.concatenate([one.states for one in seen])
    responses = np.concatenate([one.responses for one in seen])
    model = Responses(process, states, responses)
    table = horizon_values(model.game(process), process.horizon)
    table[:, -1] = 1.0
    return LearnedValues(table, model)


def explored(process: Process, count: int, rng: np.random.Generator) -> Runs:
    """Runs whose chances are tilted: raised to a power of their own, 0 (uniform) to 1."""
    tilted = process.chances[None, :] ** rng.random(count)[:, None]
    tilted /= tilted.sum(1, keepdims=True)
    return _played(process, count, rng, lambda _, __, runs: tilted[None, runs], np.ones(1))


def twisted(
    process: Process,
    values: LearnedValues,
    count: int,
    rng: np.random.Generator,
    components: tuple[Component, ...] = COMPONENTS,
) -> Runs:
    """Runs whose disturbances are drawn by values."""

    def proposals(step: int, states: Ints, _: Ints) -> Floats:
        worth = values.worth(process, states, process.horizon - 1 - step)
        return np.stack([_proposal(process.chances, worth, one) for one in components])

    return _played(process, count, rng, proposals, np.array([one.share for one in components]))


def _proposal(chances: Floats, worth: Floats, one: Component) -> Floats:
    """Probabilities of the disturbances by their worth, shape (runs, disturbances)."""
    favoured = chances * worth**one.power
    total = favoured.sum(1, keepdims=True)
    twisted = np.where(total > 0.0, favoured / np.where(total > 0.0, total, 1.0), chances)
    return (1.0 - one.twist) * chances + one.twist * twisted


def _played(
    process: Process,
    count: int,
    rng: np.random.Generator,
    proposals: Proposals,
    shares: Floats,
) -> Runs:
    """Play runs of a process; each is drawn by one component and weighed by all."""
    own = np.searchsorted(np.cumsum(shares)[:-1], (np.arange(count) + 0.5) / count)
    now, failed = np.full(count, process.first), process.states - 1
    logs = np.zeros((len(shares), count))  # log q / p of each component
    active = np.arange(count)
    states, responses = list[Ints](), list[Ints]()
    for step in range(process.horizon):
        states.append(now[active])
        responses.append(process.respond(states[-1], rng))
        q = proposals(step, states[-1], active)  # components, runs, disturbances
        each = np.arange(len(active))
        drawn = _drawn(q[own[active], each], rng)
        logs[:, active] += np.log(q[:, each, drawn] / process.chances[drawn])
        now[active] = process.moved(states[-1], drawn, responses[-1])
        active = active[now[active] != failed]
    terms = np.where(now == failed, 1.0 / (shares @ np.exp(logs)), 0.0)
    return Runs(terms, np.concatenate(states), np.concatenate(responses))


def _drawn(probabilities: Floats, rng: np.random.Generator) -> Ints:
    """One number for each row of probabilities."""
    below = np.cumsum(probabilities, axis=1) < rng.random(len(probabilities))[:, None]
    drawn: Ints = np.minimum(below.sum(1), probabilities.shape[1] - 1)
    return drawn
