"""From the options of a command line to the record that a command is asked by."""

from __future__ import annotations

import argparse
import dataclasses
from typing import Any


def values_of(options: argparse.Namespace, record: Any) -> dict[str, Any]:
    """The options that are called as the fields of a record (a dataclass)."""
    names = [field.name for field in dataclasses.fields(record) if field.name in options]
    return {name: getattr(options, name) for name in names}
