"""Settings as options of a command; names, types and help are those of the record's fields."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, get_args, get_origin

from cavsumo.cli.choices import CHOICES
from cavsumo.errors import InputError
from cavsumo.model.checks import assignment
from cavsumo.model.scenario.fields import Setting
from cavsumo.model.scenario.sensor import Sensor


def add_setting(add: Callable[..., Any], setting: Setting, **instead: Any) -> None:
    """Add the option of a setting to a command or a group; ``instead`` replaces its keywords."""
    add(
        *setting.names,
        **{"dest": setting.key, "help": help_of(setting), **_kind(setting)} | instead,
    )


def given(options: argparse.Namespace, settings: Iterable[Setting]) -> dict[str, Any]:
    """The settings that a command line gives, by their keys."""
    found = {s.key: getattr(options, s.key) for s in settings}
    tables = {s.key for s in settings if _is_table(s)}
    return {
        key: dict(value) if key in tables else value
        for key, value in found.items()
        if value is not None
    }


def help_of(setting: Setting) -> str:
    """One line with the meaning, the form of several values, and the default."""
    parts = [meaning(setting)]
    if _is_repeated(setting):
        parts.append("repeat for several")
    default, colon = default_of(setting), ":" if setting.option.unset else ""
    said = "; ".join(parts) + (f" (default{colon} {default})" if default else "")
    return said.replace("%", "%%")


def meaning(setting: Setting) -> str:
    """The description of a setting, with what follows its last words: keys, or names."""
    following: Iterable[str] = ()
    if setting.type is Sensor:
        following = Sensor.model_fields
    elif setting.description.endswith("by name"):
        following = CHOICES[setting.option.choices]()
    listed = ", ".join(following)
    return f"{setting.description}: {listed}" if listed else setting.description


def default_of(setting: Setting) -> str:
    """The default in words, empty for none."""
    default = setting.default
    if setting.option.unset or default is None or isinstance(default, bool):
        return setting.option.unset
    if isinstance(default, float):
        return f"{default:g}"
    return ", ".join(map(str, default)) if isinstance(default, tuple) else str(default or "")


def words_of(setting: Setting) -> tuple[str, ...]:
    """The words from which a setting chooses: of its type, or the names that it takes."""
    if setting.words or setting.option.metavar or not setting.option.choices:
        return setting.words
    return tuple(CHOICES[setting.option.choices]())


def _kind(setting: Setting) -> dict[str, Any]:
    """The keywords of argparse for a setting's values."""
    if setting.type is bool:
        return {"action": argparse.BooleanOptionalAction, "default": None}
    words = ",".join(words_of(setting))
    kind: dict[str, Any] = {
        "metavar": setting.option.metavar or (f"{{{words}}}" if words else None)
    }
    if _is_table(setting):
        text = get_args(setting.type)[1:] == (str,)
        kind["type"] = partial(named_text if text else assignment, setting.names[-1])
    elif setting.option.separator:
        return kind | {"type": partial(_separated, setting.names[-1], setting.option.separator)}
    elif setting.type in (int, float):
        kind["type"] = setting.type
    return kind | {"action": "append"} if _is_repeated(setting) else kind


def _is_table(setting: Setting) -> bool:
    """Whether its values are assignments."""
    return get_origin(setting.type) is dict or setting.type is Sensor


def _is_repeated(setting: Setting) -> bool:
    """Whether its option is given once for each value."""
    values = get_args(setting.type)[-1:] == (...,)
    return _is_table(setting) or (values and not setting.option.separator)


def _separated(option: str, separator: str, text: str) -> list[str]:
    """The values of an option that takes several at once."""
    values = [word for word in re.split(f"[{separator}]+", text) if word]
    if not values:
        raise InputError(f"{option}: expected at least one value, got {text!r}")
    return values


def named_text(option: str, word: str) -> tuple[str, str]:
    """NAME=TEXT as two."""
    name, equals, text = word.partition("=")
    if not (equals and text.strip()):
        raise InputError(f"{option}: expected NAME=TEXT, got {word!r}")
    return name.strip(), text.strip()
