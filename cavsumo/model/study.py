"""A study: one batch for each combination of the settings that a scenario file varies.

::

    [vary]
    testers = [1, 3]
    place = [
        { name = "straight", net = "road.net.xml", ego = "constant" },
        { name = "crossing", net = "crossing.net.xml" },
    ]

An entry is a list of values of the setting after which it is named, or a list of tables of
settings, each with a name. There is a batch for each combination, the last entry changing fastest.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cavsumo.errors import InputError
from cavsumo.model.scenario import SENSOR_KEYS
from cavsumo.model.scenario_file import PATH_KEYS, VARY, read_toml, settings_in

# Settings that add up, key by key.
TABLES = ("params", "ego_params", "assertion_params", "formulas", *SENSOR_KEYS)
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
MOST, LONGEST = 1000, 100  # batches of a study; characters of a batch's name

Settings = dict[str, Any]


@dataclass(frozen=True)
class Part:
    """One batch of a study.

    Attributes:
        name: of the combination; empty for a batch outside of a study.
        settings: all of the batch, flat.
        defaults: of settings that neither ``settings`` nor resumed results define.
    """

    name: str
    settings: Settings
    defaults: Settings = field(default_factory=dict)

    def output(self, whole: Path) -> Path:
        """Its results file: ``-o agency.csv`` gives ``agency-straight-testers1.csv``."""
        return whole.with_name(f"{whole.stem}-{self.name}{whole.suffix}") if self.name else whole


@dataclass(frozen=True)
class Choice:
    """One of the settings that an entry chooses from."""

    name: str
    settings: Settings


def read_study(file: Path, given: Mapping[str, Any]) -> list[Part]:
    """The batches of a scenario file, each with the given settings in place of its own."""
    data = read_toml(file)
    varied = data.pop(VARY, None)
    settings = settings_in(data, file)
    if varied is None:
        return [Part("", overruled(settings, given))]
    choices = choices_in(varied, file)
    for key, options in choices.items():
        for name in sorted({name for choice in options for name in choice.settings}):
            if name in given and name not in TABLES:
                raise InputError(
                    f"config {str(file)!r}: {VARY}.{key} varies {name}, which is given "
                    "beside the file as well"
                )
    try:
        return [
            Part(part.name, overruled(part.settings, given))
            for part in product(settings, list(choices.values()))
        ]
    except ValueError as error:
        raise InputError(f"config {str(file)!r}: {VARY}: {error}") from error


def at_each(parts: Sequence[Part], nets: Sequence[str]) -> list[Part]:
    """Each batch on each of several networks, called by the network first."""
    names = [Path(net).name.split(".")[0] for net in nets]
    for name, net in zip(names, nets, strict=True):
        if names.count(name) > 1:
            raise InputError(f"--net {net}: another network is called {name!r} as well")
    if len(parts) * len(nets) > MOST:
        raise InputError(f"--net: {len(parts) * len(nets)} batches, at most {MOST} are played")
    return [
        Part(f"{name}-{part.name}" if part.name else name, {**part.settings, "net": net})
        for name, net in zip(names, nets, strict=True)
        for part in parts
    ]


def choices_in(varied: Any, file: Path) -> dict[str, list[Choice]]:
    """The entries of a table ``[vary]``; raises InputError for anything else."""
    if not (isinstance(varied, dict) and varied):
        raise InputError(f"config {str(file)!r}: {VARY}: expected a table of lists")
    choices: dict[str, list[Choice]] = {}
    owners: dict[str, str] = {}
    for key, options in varied.items():
        place = f"config {str(file)!r}: {VARY}.{key}"
        if not (isinstance(options, list) and options):
            raise InputError(f"{place}: expected a list, got {options!r}")
        choices[key] = [_choice(key, option, file, place) for option in options]
        for name in (name for choice in choices[key] for name in choice.settings):
            owner = owners.setdefault(name, key)
            if owner != key and name not in TABLES:
                raise InputError(f"{place}: varies {name}, as {VARY}.{owner} does")
    return choices


def product(settings: Mapping[str, Any], choices: Sequence[Sequence[Choice]]) -> list[Part]:
    """All combinations, the last entry changing fastest; ValueError if two names are equal."""
    count = math.prod(map(len, choices))
    if count > MOST:
        raise ValueError(f"{count} batches, at most {MOST} are played as one study")
    parts: dict[str, Part] = {}
    for combination in itertools.product(*choices):
        chosen = dict(settings)
        for choice in combination:
            chosen = overruled(chosen, choice.settings)
        part = Part("-".join(choice.name for choice in combination), chosen)
        if len(part.name) > LONGEST:
            raise ValueError(f"the name {part.name!r} has more than {LONGEST} characters")
        if parts.setdefault(part.name.lower(), part) is not part:
            raise ValueError(f"two batches have the name {part.name!r}")
    return list(parts.values())


def overruled(settings: Mapping[str, Any], by: Mapping[str, Any]) -> Settings:
    """Settings with others in their place; tables of parameters key by key."""
    merged = dict(settings)
    for key, value in by.items():
        if key in TABLES and isinstance(value, dict):
            before = merged.get(key, {})
            if not isinstance(before, dict):
                raise InputError(f"{key}: expected a table in the scenario file, got {before!r}")
            value = before | value
        merged[key] = value
    return merged


def _choice(key: str, option: Any, file: Path, place: str) -> Choice:
    """One option of an entry."""
    if isinstance(option, dict):
        table = dict(option)
        name = table.pop("name", None)
        if not (isinstance(name, str) and NAME.fullmatch(name)):
            raise InputError(
                f"{place}: expected a name of letters, digits, '.', '-' and '_' in each table of "
                f"settings, got {name!r}"
            )
        return Choice(name, settings_in(table, file, place))
    if not isinstance(option, bool | int | float | str):
        raise InputError(
            f"{place}: expected numbers, words or truth values, or tables of settings with a "
            f"name, got {option!r}"
        )
    settings = settings_in({key: option}, file, f"config {str(file)!r}: {VARY}")
    return Choice(part_name(key, option), settings)


def part_name(key: str, value: bool | int | float | str) -> str:
    """The name of a batch with this value: ``testers3``, ``signal-red``."""
    text = str(value).lower() if isinstance(value, bool) else str(value)
    if key in PATH_KEYS:
        text = Path(text).name.split(".")[0]
    word = re.sub(r"[^A-Za-z0-9._]+", "-", text).strip("-")
    return f"{key}{word}" if word[:1].isdigit() else f"{key}-{word}"
