"""``cavsumo.estimate``: how often an ego fails preventably, as ``cavsumo estimate`` finds it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cavsumo.agents.names import EXPOSURE
from cavsumo.api.results import Results
from cavsumo.api.running import run
from cavsumo.batch.estimated import estimated
from cavsumo.errors import InputError
from cavsumo.model.scenario import Scenario
from cavsumo.report.estimates import as_json, words


@dataclass(frozen=True)
class Estimation:
    """An estimated probability, or a refusal.

    Attributes:
        p, lower, upper: the probability of a preventable failure an encounter, with its interval;
            None where it is refused.
        level: nominal coverage of the interval; None before the first look.
        episodes: how many were played.
        method: the estimator.
        refused: why there is no result; None for a result.
        facts: everything that ``cavsumo estimate --json`` prints.
        text: the result in sentences.
        results: the episodes.
    """

    p: float | None
    lower: float | None
    upper: float | None
    level: float | None
    episodes: int
    method: str
    refused: str | None
    facts: Mapping[str, Any]
    text: str
    results: Results

    def __str__(self) -> str:
        return self.text


def estimate(
    net: str | os.PathLike[str] | Scenario | None = None,
    *,
    exposure: str | os.PathLike[str] | None = None,
    method: str = "auto",
    half_width: float = 0.3,
    bound: float | None = None,
    max_episodes: int = 2000,
    **arguments: Any,
) -> Estimation:
    """Estimate how often an ego fails preventably when people do what an exposure says.

    Args:
        net: see ``run``.
        exposure: a TOML file (docs/probability.md); None for the default.
        method: auto, monte-carlo, stratified or importance.
        half_width: end when half of the interval is at most so much of the estimate.
        bound: end when the interval's upper end is at most this; None for never.
        max_episodes: the most to play.
        **arguments: those of ``run``; there is one tester unless ``testers`` says otherwise.

    Raises as ``run``.
    """
    for name in ("agents", "runs"):
        if name in arguments:
            expected = "max_episodes" if name == "runs" else "none, it has an agent of its own"
            raise InputError(f"estimate: {name}: expected {expected}")
    own: dict[str, Any] = {"method": method, "half_width": half_width}
    own |= {"exposure": os.fspath(exposure)} if exposure is not None else {}
    own |= {"bound": bound} if bound is not None else {}
    params = {**arguments.pop("params", {}), **{f"{EXPOSURE}.{k}": v for k, v in own.items()}}
    if not isinstance(net, Scenario) and not arguments.get("config"):
        arguments.setdefault("testers", 1)
    results = run(net, agents=[EXPOSURE], params=params, runs=max_episodes, **arguments)
    found = estimated(results.file)
    facts = as_json(found, bound)
    keys = ("p", "lower", "upper", "level", "episodes", "method", "refused")
    head = {key: facts[key] for key in keys}
    return Estimation(**head, facts=facts, text=words(found, bound), results=results)
