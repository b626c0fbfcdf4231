"""Whether a policy of the tester is proper (seed, eq. 2), in both readings.

To the letter, pi1 is proper at a state if some t has P(G | s, pi1, pi2, t) = 1 for every pi2: the
goal is *sure* within t steps. *Almost surely* asks lim over t of P = 1 for every pi2. A self-loop
of probability 1/2 distinguishes the two. Both are decided for stationary policies, pure or mixed,
against every policy of the ego; ``evaluation.least_reach_probability`` looks at other policies up
to t.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from cavsumo.games.evaluation import stationary_values
from cavsumo.games.model import Game
from cavsumo.games.policies import Stationary, ego_actions, pure, tester_actions
from cavsumo.games.readings import Reading
from cavsumo.games.regions import almost_sure_region, sure_region

Options = dict[int, list[set[int]]]  # for each state, the successors by each ego action


def proper_states(game: Game, tester: Stationary) -> list[bool]:
    """Where the goal is reached with probability 1 against every ego."""
    options = _options(game, tester)
    avoided = set(options)
    while True:  # greatest set in which the ego can stay with certainty
        left = {s for s in avoided if not any(after <= avoided for after in options[s])}
        if not left:
            break
        avoided -= left
    risky, grown = set(avoided), True
    while grown:
        new = {s for s in options if s not in risky and any(a & risky for a in options[s])}
        risky |= new
        grown = bool(new)
    return [state not in risky for state in range(game.n_states)]


def sure_steps(game: Game, tester: Stationary) -> list[int | None]:
    """The least t of eq. 2 for each state: steps in the worst case; None where there is none."""
    options = _options(game, tester)
    steps: list[int | None] = [0 if goal else None for goal in game.goal]
    for t in itertools.count(1):
        new = [
            s
            for s, after in options.items()
            if steps[s] is None and all(steps[k] is not None for k in set().union(*after))
        ]
        if not new:
            return steps
        for state in new:
            steps[state] = t
    raise AssertionError


def is_proper(game: Game, tester: Stationary, *, literal: bool = False) -> bool:
    """Whether the policy is proper at every state, to the letter or almost surely."""
    return all(_proper_states(game, tester, literal))


def _proper_states(game: Game, tester: Stationary, literal: bool) -> list[bool]:
    """Where the policy is proper, to the letter or almost surely."""
    if literal:
        return [t is not None for t in sure_steps(game, tester)]
    return proper_states(game, tester)


def _options(game: Game, tester: Stationary) -> Options:
    """The possible successors of each state under a policy of the tester, by the ego's action."""
    options: Options = {}
    for state in np.flatnonzero(~game.goal).tolist():
        after: dict[int, set[int]] = {action: set() for action in ego_actions(game, state)}
        for row in game.rows(state):
            if tester.table[state].get(int(game.tester_action[row])):
                for cell in game.cells(row):
                    after.setdefault(int(game.ego_action[cell]), set()).update(
                        s for s, *_ in game.outcomes(cell)
                    )
        options[state] = list(after.values())
    return options


def literally_solvable(game: Game, limit: int = 20_000, *, literal: bool = True) -> bool | None:
    """Whether the game is solvable by the seed's literal definition; None beyond the limit.

    Some policy is proper (reading A), and every improper one has, at each state where it is
    improper, an ego against which it earns minus infinity. A policy that reaches the goal almost
    surely but within no number of steps is improper to the letter and earns a finite value, so it
    makes a game unsolvable; unless ``literal`` is False, which takes it for proper.
    """
    live = np.flatnonzero(~game.goal).tolist()
    testers, egos = ([f(game, s) for s in live] for f in (tester_actions, ego_actions))
    if math.prod(map(len, testers)) * math.prod(map(len, egos)) > limit:
        return None
    region = sure_region if literal else almost_sure_region
    if not region(game, Reading.A).inside.all():
        return False
    for choice in itertools.product(*testers):
        tester = pure(dict(zip(live, choice, strict=True)))
        proper_at = _proper_states(game, tester, literal)
        improper = {s for s, proper in enumerate(proper_at) if not proper}
        for reply in itertools.product(*egos) if improper else ():
            ego = pure(dict(zip(live, reply, strict=True)))
            found = stationary_values(game, tester, ego, exact=game.exact is not None)
            improper = {s for s in improper if found[s] != -math.inf}
        if improper:
            return False
    return True
