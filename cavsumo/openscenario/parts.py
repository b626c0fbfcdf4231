"""Published scenarios as batches to plan: their settings under those of the user."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.errors import InputError
from cavsumo.model.study import LONGEST, Part, part_name
from cavsumo.openscenario.reading import STEP_S, ScenarioSource, read_scenario
from cavsumo.openscenario.variations import Values, variations_of

# What the user gives in place of these: runs differ by SUMO's random numbers alone.
OWN = {"assertions": ["collision"], "step_length": STEP_S, "runs": 1}
# Settings that a scenario leaves to its user; all others are the scenario's own.
OPEN = frozenset(
    "ego ego_params ego_sensor tester_sensor step_length end assertions assertion_params formulas "
    "reference runs seed trace deadline_s shard first until_tests until_half_width until_rate "
    "budget_s".split()
)


@dataclass(frozen=True)
class ScenarioChoice:
    """A scenario that is to be played.

    Attributes:
        file: of a scenario, or of its variations.
        values: of its parameters, in place of those of the files.
        root: the folder that all its files must be in; the file's own if not given.
        ego: the name of the entity under test.
    """

    file: Path
    values: Mapping[str, str]
    root: Path | None = None
    ego: str = "Ego"


@dataclass(frozen=True)
class ScenarioParts:
    """The batches of a scenario: one, or one for each variation.

    Attributes:
        parts: to be planned.
        places: present paths of the networks that were made for them.
        notes: sentences for the user.
    """

    parts: tuple[Part, ...]
    places: dict[str, Path]
    notes: tuple[str, ...]


def scenario_parts(choice: ScenarioChoice, settings: Mapping[str, Any]) -> ScenarioParts:
    """The batches of a scenario with the user's settings; InputError in one sentence."""
    for key in settings:
        if key not in OPEN:
            raise InputError(f"{key}: {str(choice.file)!r} says that, or does not have it")
    if choice.root is not None and not choice.root.is_dir():
        raise InputError(f"scenario_root: no such folder: {str(choice.root)!r}")
    found = variations_of(choice.file, choice.root)
    root = choice.root or choice.file.parent
    step = float(settings.get("step_length", STEP_S))
    parts, places, notes = [], dict[str, Path](), list[str]()
    for values in found.combinations:
        source = ScenarioSource(found.file, {**values, **choice.values}, root, choice.ego, step)
        read = read_scenario(source)
        name = _name(values, found.combinations)
        parts.append(Part(name, {**settings, **read.settings}, OWN))
        places |= read.places
        notes += read.notes
    return ScenarioParts(tuple(parts), places, tuple(dict.fromkeys(notes)))


def _name(values: Values, combinations: Sequence[Values]) -> str:
    """The name of a variation: the values of the parameters that vary; none for a single one."""
    varied = [key for key in values if len({one.get(key) for one in combinations}) > 1]
    words = [part_name(key, values[key].rsplit("/", 1)[-1]) for key in varied]
    return "-".join(words)[:LONGEST]
