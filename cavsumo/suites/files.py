"""Suites by name or by file."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, lru_cache
from pathlib import Path

from pydantic import ValidationError

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.documents import LARGEST_TOML_B, first_problem, read_text, toml_of
from cavsumo.suites.records import Suite

ENDING = ".toml"
FOLDER = Path(__file__).parent


@cache
def suite_names() -> tuple[str, ...]:
    """The suites that come with cavsumo."""
    return tuple(sorted(file.stem for file in FOLDER.glob(f"*{ENDING}")))


def suite_file(name: str, places: Mapping[str, Path] | None = None) -> Path:
    """The file of a suite; raises UnknownName with the nearest name.

    ``places``: the present paths of files that have moved.
    """
    if name in suite_names():
        return FOLDER / f"{name}{ENDING}"
    file = (places or {}).get(name, Path(name))
    if not name.endswith(ENDING):
        raise UnknownName("suite", name, suite_names())
    if not file.is_file():
        raise InputError(f"suite {name!r}: no such file")
    return file


def read_suite(file: Path) -> Suite:
    """The suite in a file; raises InputError in one sentence."""
    facts = file.stat()
    return _read(file, facts.st_mtime_ns, facts.st_size)


@lru_cache(maxsize=16)
def _read(file: Path, _time: int, _size: int) -> Suite:
    """The suite in a file as it is now."""
    text = read_text(file, "suite", largest=LARGEST_TOML_B)
    try:
        return Suite.model_validate(toml_of(text))
    except ValidationError as error:
        raise InputError(f"suite {str(file)!r}: {first_problem(error)}") from error
    except ValueError as error:
        raise InputError(f"suite {str(file)!r}: {error}") from error
