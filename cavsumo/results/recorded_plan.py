"""The plan of a batch as its manifest has it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cavsumo.errors import ResultsError
from cavsumo.model.scenario import BatchPlan
from cavsumo.results.reading import STARTING, read_manifest


def recorded_plan(csv_file: Path) -> tuple[BatchPlan, dict[str, Any]]:
    """The plan of a batch, and its manifest."""
    manifest = read_manifest(csv_file)
    if manifest.get("status") == STARTING:
        raise ResultsError(f"results {str(csv_file)!r}: a batch that was killed as it started")
    try:
        return BatchPlan.model_validate(manifest["plan"]), manifest
    except (KeyError, ValueError) as error:
        raise ResultsError(f"manifest of {str(csv_file)!r}: holds no valid plan") from error
