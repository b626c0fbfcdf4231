"""Plans of the batches of a run: numbers, names and files, checked before heavy imports.

Parameters and the site, which are known only once they are built, are checked by ``preflight``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.batch.manner import Manner
from cavsumo.batch.plan_names import check_names
from cavsumo.errors import InputError, ResultsError
from cavsumo.model.gone_settings import without_gone
from cavsumo.model.scenario import BatchPlan, plan_from
from cavsumo.model.study import Part
from cavsumo.network.network_file import root_of
from cavsumo.results.own_file import check_free
from cavsumo.results.present import gone, present_paths
from cavsumo.results.reading import check_replaceable, read_manifest


@dataclass(frozen=True)
class PlannedBatch:
    """A batch whose settings are valid.

    Attributes:
        name: which part of a study it is; empty for none.
        output: its results file.
        plan: what is played.
        recorded: the manifest of the batch to go on with, None for a new one.
    """

    name: str
    output: Path
    plan: BatchPlan
    recorded: Mapping[str, Any] | None


def planned(
    parts: Sequence[Part],
    output: Path,
    manner: Manner,
    places: Mapping[str, Path] | None = None,
) -> list[PlannedBatch]:
    """Plan all parts of a run before any is played; raises InputError in one sentence.

    ``places``: the present paths of files that the parts name (``Scenario.placed``).
    """
    batches = [_planned(part, part.output(output), manner, places or {}) for part in parts]
    for batch in batches:
        check_free(batch.output)
        if batch.recorded is None and not manner.overwrite:
            check_replaceable(batch.output)
    return batches


def check_plan(plan: BatchPlan) -> None:
    """Refuse names that nothing has, and a network that is no file of SUMO's."""
    check_names(plan)
    root_of(plan.scenario.net_file)


def _planned(part: Part, output: Path, manner: Manner, places: Mapping[str, Path]) -> PlannedBatch:
    """Plan one part."""
    _check_output(output)
    recorded = _recorded(output, manner)
    source = f"run: {part.name}" if part.name else "run"
    settings = {**part.defaults, **recorded_settings(recorded), **part.settings}
    plan = plan_from(settings, source, {**places, **_moved(recorded, output)})
    check_plan(plan)
    return PlannedBatch(part.name, output, plan, recorded)


def _check_output(output: Path) -> None:
    """Refuse a path that cannot become a results file."""
    if not output.parent.is_dir():
        raise InputError(f"output {str(output)!r}: no such folder {str(output.parent)!r}")
    if output.suffix != ".csv":
        raise InputError(f"output {str(output)!r}: expected a name that ends in .csv")
    if output.is_dir() or output.with_suffix("").is_file():
        raise InputError(f"output {str(output)!r}: its place is taken")


def _recorded(output: Path, manner: Manner) -> dict[str, Any] | None:
    """The manifest of the batch to continue, None for a new one.

    With ``resume`` there may be no results yet, so that the same command starts and continues.
    """
    if not (manner.resume or manner.retry_errors):
        return None
    rows = output.is_file() and output.stat().st_size > 0
    if manner.resume and not rows and not output.with_suffix(".json").exists():
        return None  # a kill may leave an empty file
    return read_manifest(output)


def _moved(recorded: Mapping[str, Any] | None, output: Path) -> dict[str, Path]:
    """The present paths of the files of a batch to go on with, where none can be read at its place.

    A file that was changed there since is none to go on with, so no other one is searched.
    """
    try:
        plan = BatchPlan.model_validate((recorded or {})["plan"])
    except (KeyError, ValueError):  # a new batch, or none to go on with
        return {}
    return present_paths(plan, recorded or {}, output, gone(plan))


def recorded_settings(recorded: Mapping[str, Any] | None) -> dict[str, Any]:
    """The settings of a recorded plan; settings that are not given again are kept."""
    if recorded is None:
        return {}
    try:
        plan = without_gone(recorded["plan"])
        flat = {"routes": "none"} | {k: v for k, v in plan.pop("scenario").items() if v is not None}
        return flat | {k: v for k, v in plan.items() if v is not None}
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ResultsError("the manifest holds no plan to go on with") from error
