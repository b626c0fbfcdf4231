"""Results of a command whose own output is redirected into a file: neither may replace the other.

``cavsumo estimate --json > results.json`` lets the shell make the file in which the results in
``results.csv`` have their manifest.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cavsumo.errors import InputError

if TYPE_CHECKING:
    from cavsumo.model.study import Part


def taken_by_output(output: Path, parts: Sequence[Part]) -> Path | None:
    """The file of these results into which the standard output goes, if it does."""
    tables = [part.output(output) for part in parts]
    files = [file for table in tables for file in (table, table.with_suffix(".json"))]
    return next((file for file in files if _is_output(file)), None)


def free_output(given: str | None, names: Sequence[str], parts: Sequence[Part]) -> Path:
    """The results file: the given one, else the first name that the output does not take.

    Raises InputError where the standard output is redirected into the results that were asked for.
    """
    if given is None:
        return next(p for p in map(Path, names) if taken_by_output(p, parts) is None)
    taken = taken_by_output(Path(given), parts)
    if taken is not None:
        raise InputError(
            f"output {given!r}: the output of this command is redirected into {str(taken)!r}, "
            "one of its results: name one of them differently"
        )
    return Path(given)


def _is_output(file: Path) -> bool:
    """Whether the standard output goes into a file."""
    try:
        return os.path.samestat(os.fstat(sys.stdout.fileno()), file.stat())
    except (OSError, ValueError, AttributeError):  # no such file, or output that is none
        return False
