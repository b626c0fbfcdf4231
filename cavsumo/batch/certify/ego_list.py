"""The egos against which a test is certified: for each label an ego and its parameters."""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.labels import cast_of
from cavsumo.model.scenario import Params, Scenario
from cavsumo.model.study import NAME, Choice, part_name

Egos = dict[str, tuple[str, Params]]


def opponents(words: Sequence[str], params: Params, scenario: Scenario) -> Egos:
    """The egos that are named, ``EGO`` or ``LABEL=EGO``; that of the scenario if none is.

    The scenario's ego keeps its parameters under its own name. Those given are ``LABEL.KEY``, or
    ``KEY`` where there is only one ego.
    """
    if not all(words):
        raise InputError("--egos: expected EGO or LABEL=EGO between the commas, got nothing")
    try:
        named = cast_of(words or (scenario.ego,))
    except ValueError as error:
        raise InputError(f"--egos: {error}") from error
    same = {scenario.ego: dict(scenario.ego_params)}
    egos = {label: (ego, same.get(label, {})) for label, ego in named.items()}
    for key, value in params.items():
        label, name = _whose(key, list(egos))
        egos[label][1][name] = value
    return egos


def _whose(key: str, labels: Sequence[str]) -> tuple[str, str]:
    """The ego that a parameter is meant for, and the parameter."""
    for label in labels:
        if key.startswith(f"{label}."):
            return label, key.removeprefix(f"{label}.")
    label, dot, _ = key.rpartition(".")
    if dot:
        raise UnknownName("ego", label, labels, f"--ego-param {key}")
    if len(labels) > 1:
        of = ", ".join(labels)
        raise InputError(f"--ego-param {key}: of which ego? LABEL.{key}=VALUE ({of})")
    return labels[0], key


def choices(egos: Egos) -> list[Choice]:
    """The egos as the settings that a study varies."""
    return [
        Choice(
            label if NAME.fullmatch(label) else part_name("ego", label),
            {"ego": ego, "ego_params": params},
        )
        for label, (ego, params) in egos.items()
    ]
