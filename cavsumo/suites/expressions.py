"""Arithmetic in the files of suites: numbers computed from the parameters of a case."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from cavsumo.errors import UnknownName
from cavsumo.suites import careful_driver, crosswalk_cases, street_walks

Value = bool | int | float | str


def _one_if(truth: Callable[..., bool]) -> Callable[..., float]:
    """A function whose answer is 1 or 0."""
    return lambda *numbers: float(truth(*numbers))


FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "abs": abs,
    "acos": math.acos,
    "atan": math.atan,
    "cav_gym_points": street_walks.cav_gym_points,  # lists of places, not numbers
    "chance_points": street_walks.chance_points,
    "cos": math.cos,
    "crosswalk_errors": crosswalk_cases.errors,
    "crosswalk_points": crosswalk_cases.points,
    "cut_in_preventable": _one_if(careful_driver.cut_in_preventable),
    "cut_out_preventable": _one_if(careful_driver.cut_out_preventable),
    "deceleration_preventable": _one_if(careful_driver.deceleration_preventable),
    "deg": math.radians,  # degrees, as radians
    "kmh": lambda speed: speed / 3.6,  # km/h, as m/s
    "max": max,
    "min": min,
    "sin": math.sin,
    "sqrt": math.sqrt,
    "tan": math.tan,
}
OPERATORS: Mapping[type, Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
LONGEST = 500  # characters


def evaluated(text: str, names: Mapping[str, Value]) -> Value:
    """The value of an expression, or of a name alone, which may stand for a word.

    ``+ - * / **``, brackets, numbers, names and the functions of ``FUNCTIONS``; ValueError in
    plain words for anything else, UnknownName for a name that there is not.
    """
    try:
        value = _value(_parsed(text), names, text)
    except (ArithmeticError, TypeError) as error:
        raise ValueError(f"{text!r} has no value: {error}") from error
    if isinstance(value, complex) or (isinstance(value, float) and not math.isfinite(value)):
        raise ValueError(f"{text!r} has no finite value")
    return value  # type: ignore[no-any-return]


@lru_cache(maxsize=4096)
def _parsed(text: str) -> ast.AST:
    """The tree of an expression."""
    if len(text) > LONGEST:
        raise ValueError(f"an expression of more than {LONGEST} characters")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"no expression: {text!r}") from None


def _value(node: ast.AST, names: Mapping[str, Value], text: str) -> Any:
    """The value of a part of an expression."""
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return node.value
    if isinstance(node, ast.Name):
        if node.id not in names:
            raise UnknownName("name", node.id, [*names, *FUNCTIONS], repr(text))
        return names[node.id]
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        left, right = _value(node.left, names, text), _value(node.right, names, text)
        if isinstance(node.op, ast.Pow) and abs(right) > 10:
            raise ValueError(f"{text!r}: a power above 10")
        return OPERATORS[type(node.op)](left, right)
    if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
        return OPERATORS[type(node.op)](_value(node.operand, names, text))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        if node.func.id not in FUNCTIONS:
            raise UnknownName("function", node.func.id, FUNCTIONS, repr(text))
        arguments = [_value(argument, names, text) for argument in node.args]
        try:
            return FUNCTIONS[node.func.id](*arguments)
        except ValueError as error:
            raise ValueError(f"{text!r} has no value: {error}") from error
    raise ValueError(f"{text!r}: expected numbers, names, + - * / **, brackets and functions")
