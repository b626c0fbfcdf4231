"""The settings: the fields of the scenario record, for those who offer them to users."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from cavsumo.model.scenario.option import Option
from cavsumo.model.scenario.plan import BatchPlan
from cavsumo.model.scenario.record import Scenario

RECORDS: tuple[type[BaseModel], ...] = (Scenario, BatchPlan)


@dataclass(frozen=True)
class Setting:
    """One setting.

    Attributes:
        key: its name in scenario files and as a keyword.
        type: of its value, without None.
        default: None or empty where something is chosen for it.
        description: meaning, with its unit.
        option: how it is offered.
        environments: whether the environments take it as a keyword.
    """

    key: str
    type: Any
    default: Any
    description: str
    option: Option
    environments: bool

    @property
    def names(self) -> tuple[str, ...]:
        """Its names on the command line."""
        return self.option.names or ("--" + self.key.replace("_", "-"),)

    @property
    def words(self) -> tuple[str, ...]:
        """The words that its value, or each of its values, is one of; none for any other type."""
        values = get_args(self.type)[:1] if get_origin(self.type) is tuple else (self.type,)
        found = [get_args(value) for value in values if get_origin(value) is Literal]
        return tuple(map(str, found[0])) if found else ()


def settings(records: Sequence[type[BaseModel]] = RECORDS) -> tuple[Setting, ...]:
    """The settings of some records in their order; fields without a mark are not the user's."""
    return tuple(
        _setting(key, field, mark, issubclass(record, Scenario))
        for record in records
        for key, field in record.model_fields.items()
        for mark in field.metadata
        if isinstance(mark, Option)
    )


def _setting(key: str, field: FieldInfo, mark: Option, environments: bool) -> Setting:
    """A field as a setting."""
    return Setting(
        key=key,
        type=without_none(field.annotation),
        default=None if field.is_required() else field.get_default(call_default_factory=True),
        description=field.description or "",
        option=mark,
        environments=environments if mark.environments is None else mark.environments,
    )


def without_none(annotation: Any) -> Any:
    """A type without None as one of its alternatives, and without what annotates it."""
    if get_origin(annotation) in (Union, UnionType):
        (annotation,) = (t for t in get_args(annotation) if t is not type(None))
    if hasattr(annotation, "__metadata__"):
        return annotation.__origin__
    return annotation
