"""Arithmetic that files contain as text: numbers computed from named ones, and nothing else."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from cavsumo.errors import UnknownName

Value = bool | int | float | str
Functions = Mapping[str, Callable[..., Any]]

OPERATORS: Mapping[type, Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
LONGEST = 500  # characters
LARGEST_POWER = 10


def evaluated(text: str, names: Mapping[str, Value], functions: Functions) -> Value:
    """The value of an expression, or of a name alone, which may stand for a word.

    ``+ - * / % **``, brackets, numbers, names and the given functions; ValueError in plain words
    for anything else, UnknownName for a name that there is not.
    """
    try:
        value = _value(_parsed(text), names, functions, text)
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


def _value(node: ast.AST, names: Mapping[str, Value], functions: Functions, text: str) -> Any:
    """The value of a part of an expression."""
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return node.value
    if isinstance(node, ast.Name):
        if node.id not in names:
            raise UnknownName("name", node.id, [*names, *functions], repr(text))
        return names[node.id]
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        left, right = (_value(part, names, functions, text) for part in (node.left, node.right))
        if isinstance(node.op, ast.Pow) and abs(right) > LARGEST_POWER:
            raise ValueError(f"{text!r}: a power above {LARGEST_POWER}")
        return OPERATORS[type(node.op)](left, right)
    if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
        return OPERATORS[type(node.op)](_value(node.operand, names, functions, text))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        if node.func.id not in functions:
            raise UnknownName("function", node.func.id, functions, repr(text))
        arguments = [_value(argument, names, functions, text) for argument in node.args]
        try:
            return functions[node.func.id](*arguments)
        except TypeError as error:
            count = len(arguments)
            raise ValueError(
                f"{text!r}: {node.func.id} does not take these {count} values"
            ) from error
        except ValueError as error:
            raise ValueError(f"{text!r} has no value: {error}") from error
    raise ValueError(f"{text!r}: expected numbers, names, + - * / % **, brackets and functions")
