"""The tester agents that come with cavsumo: each name with the file that registers it.

And ``policy:FILE``, in place of a name: a tester that a user trained.
"""

from pathlib import Path

from cavsumo.errors import InputError
from cavsumo.model.names import Names

AGENT_NAMES = Names(
    "agent",
    "cavsumo.agents",
    {
        "best-response": "best_response",
        "election": "election",
        "expectiminimax": "expectiminimax",
        "exposure": "exposed",
        "noop": "base",
        "programmed-random": "programmed",
        "proximity": "programmed",
        "q-learning": "qlearning",
        "random": "random",
        "recorded": "recorded",
        "scripted": "scripted",
        "search": "searched",
        "timing": "programmed",
    },
    {
        "best-response": "aim model learn explore replan missed unfair unpreventable confidence "
        "run_up_m",
        "election": "distance_m rule idle manoeuvre",
        "expectiminimax": "against price_per_s grid_s top accel",
        "exposure": "method exposure half_width bound cut",
        "programmed-random": "rate_per_s epsilon idle manoeuvre",
        "proximity": "distance_m idle manoeuvre",
        "q-learning": "alpha gamma epsilon half_life hold_s weights learn",
        "random": "rate_per_s epsilon between",
        "search": "method cut within earlier",
        "timing": "aim idle manoeuvre",
    },
)

SEARCH = "search"  # the agent whose tests a searcher chooses, by one of these methods
SEARCH_METHODS = (
    "portfolio", "random", "manoeuvres", "neighbours", "cma", "diversity", "tree", "explore",
)  # fmt: skip
EXPOSURE = "exposure"  # the agent whose random vectors an estimator chooses, by one of these
ESTIMATE_METHODS = ("auto", "monte-carlo", "stratified", "importance")

PREFIX = "policy:"


def declared_parameters(spec: str) -> tuple[str, ...] | None:
    """The parameters of an agent that comes with cavsumo; a policy has none. None for another."""
    return AGENT_NAMES.parameters(spec) if policy_file(spec) is None else ()


def policy_file(spec: str) -> Path | None:
    """The file of ``policy:FILE``, None for any other name."""
    if not spec.startswith(PREFIX):
        return None
    if spec == PREFIX:
        raise InputError(f"agent {spec!r}: expected the file of a policy, {PREFIX}FILE")
    return Path(spec.removeprefix(PREFIX))
