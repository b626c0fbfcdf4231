"""Elements together with the parameters that their values may name."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from cavsumo.errors import InputError, UnknownName, shown
from cavsumo.model.expressions import Value, evaluated
from cavsumo.openscenario.tree import XmlElement

REFERENCE = re.compile(r"\$([A-Za-z_][A-Za-z0-9_]*)")
TRUE, FALSE = ("true", "1"), ("false", "0")
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "abs": abs,
    "acos": math.acos,
    "asin": math.asin,
    "atan": math.atan,
    "ceil": math.ceil,
    "cos": math.cos,
    "floor": math.floor,
    "max": max,
    "min": min,
    "pow": lambda base, power: math.pow(base, power),
    "round": lambda number: math.floor(number + 0.5),
    "sign": lambda number: (number > 0) - (number < 0),
    "sin": math.sin,
    "sqrt": math.sqrt,
    "tan": math.tan,
}
CONSTANTS: Mapping[str, Value] = {"pi": math.pi}


@dataclass(frozen=True)
class XmlNode:
    """An element and the values of parameters.

    Attributes:
        xml: the element.
        scope: parameters by their names, without the dollar.
    """

    xml: XmlElement
    scope: Mapping[str, Value] = field(default_factory=dict)

    @property
    def tag(self) -> str:
        """The name of the element."""
        return self.xml.tag

    def refused(self, why: str) -> InputError:
        """The error that gives a reason, with file, line and element."""
        return self.xml.refused(why)

    def within(self, scope: Mapping[str, Value]) -> XmlNode:
        """The same element with other parameters."""
        return XmlNode(self.xml, scope)

    # Elements in it

    def all(self, *tags: str) -> Iterator[XmlNode]:
        """The elements in it, of some names or of all."""
        for one in self.xml.inner:
            if not tags or one.tag in tags:
                yield XmlNode(one, self.scope)

    def maybe(self, *tags: str) -> XmlNode | None:
        """The first element of these names in it, None for none."""
        return next(self.all(*tags), None)

    def one(self, *tags: str) -> XmlNode:
        """The first element of these names in it; InputError if there is none."""
        found = self.maybe(*tags)
        if found is None:
            expected = " or ".join(f"<{tag}>" for tag in tags) or "an element"
            raise self.refused(f"expected {expected} in it")
        return found

    # Values

    def has(self, key: str) -> bool:
        """Whether an attribute is given."""
        return key in self.xml.given

    def word(self, key: str, default: str | None = None) -> str:
        """The value of an attribute as text."""
        value = self._value(key, default)
        if isinstance(value, bool):
            return "true" if value else "false"
        return value if isinstance(value, str) else f"{value:.12g}"

    def number(self, key: str, default: float | None = None) -> float:
        """The value of an attribute as a finite number."""
        value = self._value(key, default)
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = math.nan
        if not math.isfinite(number) or isinstance(value, bool):
            raise self.refused(f"{key}: expected a number, got {shown(value)}")
        return number

    def truth(self, key: str, default: bool | None = None) -> bool:
        """The value of an attribute as a truth."""
        word = self.word(key, None if default is None else str(default).lower())
        if word not in TRUE + FALSE:
            raise self.refused(f"{key}: expected true or false, got {shown(word)}")
        return word in TRUE

    def choice(self, key: str, valid: tuple[str, ...], default: str | None = None) -> str:
        """The value of an attribute, which is one of some words."""
        word = self.word(key, default)
        if word not in valid:
            raise UnknownName(key, word, valid, f"{self.xml.file!r}: line {self.xml.line}")
        return word

    def _value(self, key: str, default: Value | None) -> Value:
        """The value of an attribute with parameters and expressions computed."""
        text = self.xml.given.get(key)
        if text is None:
            if default is None:
                raise self.refused(f"expected {key}")
            return default
        try:
            return value_of(text, self.scope)
        except UnknownName as error:
            raise InputError(f"{self.xml.file!r}: line {self.xml.line}: {key}: {error}") from error
        except ValueError as error:
            raise self.refused(f"{key}: {error}") from error


def value_of(text: str, scope: Mapping[str, Value]) -> Value:
    """The value of ``text``, ``$parameter`` or ``${expression}``.

    Raises ValueError in plain words, and UnknownName for a parameter that is not declared.
    """
    text = text.strip()
    if text.startswith("${") and text.endswith("}"):
        return _computed(text[2:-1], scope)
    if text.startswith("$"):
        name = text[1:]
        if name not in scope:
            raise UnknownName("parameter", text, [f"${known}" for known in scope])
        return scope[name]
    return text


def _computed(text: str, scope: Mapping[str, Value]) -> Value:
    """The value of an expression; parameters have a prefix there, so that they hide no function."""
    for name in REFERENCE.findall(text):
        if name not in scope:
            raise UnknownName("parameter", f"${name}", [f"${known}" for known in scope])
    names = {f"p_{name}": _numeric(value) for name, value in scope.items()}
    plain = REFERENCE.sub(r"p_\1", text)
    try:
        ast.parse(plain.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"no expression: {shown(text)}") from None
    return evaluated(plain, {**CONSTANTS, **names}, FUNCTIONS)


def _numeric(value: Value) -> Value:
    """Text that is a number as one."""
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            return value
    return value
