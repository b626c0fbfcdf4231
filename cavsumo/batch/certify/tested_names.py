"""The name of what is certified, checked before anything heavy is imported."""

from __future__ import annotations

from pathlib import Path

from cavsumo.agents.names import AGENT_NAMES, policy_file
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.labels import cast_of
from cavsumo.model.scenario import BatchPlan


def check_test(word: str, plan: BatchPlan, file: Path) -> None:
    """Raise InputError unless this is an agent of the results, or one that stands by itself."""
    if word in plan.cast:
        return
    try:
        ((_, name),) = cast_of((word,)).items()
    except ValueError as error:
        raise InputError(f"agent {error}") from error
    if policy_file(name) is None and name not in AGENT_NAMES:
        valid = {*plan.cast, *AGENT_NAMES}
        raise UnknownName("run, agent or policy:FILE", word, valid, str(file))
