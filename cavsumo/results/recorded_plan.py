"""The plan of a batch as its manifest has it, or as the head of a trace has it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from cavsumo.errors import ResultsError
from cavsumo.model.documents import first_problem
from cavsumo.model.scenario import BatchPlan, check_teams
from cavsumo.results.reading import STARTING, read_manifest


def recorded_plan(csv_file: Path) -> tuple[BatchPlan, dict[str, Any]]:
    """The plan of a batch, and its manifest."""
    manifest = read_manifest(csv_file)
    if manifest.get("status") == STARTING:
        raise ResultsError(f"results {str(csv_file)!r}: a batch that was killed as it started")
    return plan_in(manifest, f"manifest of {str(csv_file)!r}"), manifest


def plan_in(origin: Mapping[str, Any], name: str) -> BatchPlan:
    """The plan in a manifest or in the head of a trace; raises ResultsError that begins with it."""
    try:
        plan = BatchPlan.model_validate(origin["plan"])
    except KeyError:
        raise ResultsError(f"{name}: holds no valid plan") from None
    except ValidationError as error:
        raise ResultsError(f"{name}: holds no valid plan: {first_problem(error)}") from error
    check_teams(plan.scenario, name)
    return plan
