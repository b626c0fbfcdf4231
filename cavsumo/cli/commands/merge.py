"""``cavsumo merge``: the results of shards as the one file that a single run would have written."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from cavsumo.batch.merge import merged
from cavsumo.batch.summary import summarise
from cavsumo.cli.steps import SlowSteps
from cavsumo.errors import Exit


def merge(parts: Sequence[Path], output: Path, overwrite: bool, quiet: bool) -> int:
    """Merge the parts and print their summary."""
    with SlowSteps(quiet=quiet) as steps:
        steps.begin(f"merging {len(parts)} results into {output}")
        whole = merged(parts, output, overwrite=overwrite, warn=_warn)
    if not quiet:
        summarise([whole])
    return Exit.OK


def _warn(said: str) -> None:
    """A line about the results on stderr."""
    print(f"cavsumo: {said}", file=sys.stderr)
