"""Text, JSON and TOML from anywhere, read within bounds: what is wrong is said in plain words.

All such files are read here, so that nesting, numbers and encodings that would cause an error of
Python later are refused where they are read. Each reader checks the values itself.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cavsumo.errors import InputError, shown

if TYPE_CHECKING:
    from pydantic import ValidationError

DEPTH = 60  # of lists and tables in each other; ours have at most ten
DIGITS = 40  # of a whole number
LARGEST_B = 1 << 30
LARGEST_TOML_B = 1 << 20  # what people write


def read_text(
    file: Path, what: str, wrong: type[Exception] = InputError, largest: int = LARGEST_B
) -> str:
    """The text of a file (UTF-8); raises ``wrong`` in one sentence, which begins with ``what``."""
    return decoded(read_bytes(file, what, wrong, largest), f"{what} {str(file)!r}", wrong)


def read_bytes(
    file: Path, what: str, wrong: type[Exception] = InputError, largest: int = LARGEST_B
) -> bytes:
    """The bytes of a file; raises ``wrong`` in one sentence, which begins with ``what``."""
    name = f"{what} {str(file)!r}"
    try:
        with file.open("rb") as stream:
            data = stream.read(largest + 1)
    except (OSError, ValueError) as error:  # a name with a null character is a ValueError
        reason = getattr(error, "strerror", None) or "no name of a file"
        raise wrong(f"{name}: cannot be read: {reason}") from error
    if len(data) > largest:
        raise wrong(f"{name}: more than {largest} bytes, expected at most so many")
    return data


def decoded(data: bytes, name: str, wrong: type[Exception] = InputError) -> str:
    """Bytes as text (UTF-8); raises ``wrong`` in one sentence, which begins with a name."""
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise wrong(f"{name}: line {line}: no UTF-8, byte 0x{data[error.start]:02x}") from error


def json_of(text: str, parse_float: Callable[[str], Any] = float, *, bounded: bool = True) -> Any:
    """The content of a JSON text; ValueError in plain words for other text, or beyond the bounds.

    Numbers that JSON does not have (NaN, Infinity) are refused. Not ``bounded``, the depth is that
    which Python can parse: enough where a shape is asked of what is found.
    """
    try:
        found = json.loads(
            text, parse_float=parse_float, parse_int=_whole, parse_constant=_no_number
        )
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise ValueError(f"no JSON at {place}: {error.msg}") from error
    except RecursionError:
        raise _too_deep() from None
    if bounded:
        _check_bounds(found)
    return found


def toml_of(text: str) -> dict[str, Any]:
    """The content of a TOML text; ValueError in plain words for any other, or beyond bounds."""
    try:
        found = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"no TOML: {error}") from error
    except RecursionError:
        raise _too_deep() from None
    except ValueError:  # Python's own bound
        raise _too_long() from None
    _check_bounds(found)
    return found


def first_problem(error: ValidationError, apart: str = "") -> str:
    """The first of pydantic's findings as one sentence; ``apart`` is left out of the place."""
    problem = error.errors(include_url=False)[0]
    place = ".".join(str(p) for p in problem["loc"] if p != apart)
    message = _MESSAGES.get(problem["type"]) or problem["msg"].removeprefix("Value error, ")
    own = problem["type"] == "value_error"  # its message says what was given
    told = problem["type"] == "missing" or (own and ", got " in message)
    given = "" if told else f", got {shown(problem['input'])}"
    return f"{place}: {message}{given}" if place else f"{message}{given}"


# Words of pydantic's that speak of Python.
_MESSAGES = {
    "path_type": "expected a path",
    "dict_type": "expected a table",
    "model_type": "expected a table",
    "list_type": "expected a list",
    "tuple_type": "expected a list",
}


def _whole(digits: str) -> int:
    if len(digits) > DIGITS:
        raise _too_long()
    return int(digits)


def _no_number(word: str) -> None:
    raise ValueError(f"{word} is no number of JSON")


def _too_long() -> ValueError:
    return ValueError(f"a whole number of more than {DIGITS} digits")


def _too_deep() -> ValueError:
    return ValueError(f"lists or tables in each other, more than {DEPTH} deep")


def _check_bounds(document: Any) -> None:
    """Refuse nesting and numbers that later steps cannot process."""
    level = [document]
    for _ in range(DEPTH):
        if any(isinstance(value, int) and abs(value) >= 10**DIGITS for value in level):
            raise _too_long()
        level = [
            child
            for value in level
            if isinstance(value, dict | list)
            for child in (value.values() if isinstance(value, dict) else value)
        ]
        if not level:
            return
    raise _too_deep()
