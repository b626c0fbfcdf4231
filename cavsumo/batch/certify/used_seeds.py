"""Seeds that were used, and a batch whose episodes have none of them.

SUMO uses a seed modulo 2^31, so seeds that are equal modulo 2^31 count as equal.
"""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cavsumo.errors import InputError, ResultsError
from cavsumo.model.documents import json_of, read_text
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.seeds import episode_seed
from cavsumo.model.visible_files import is_visible
from cavsumo.results.present import present_paths
from cavsumo.results.reading import FORMAT, rows_of
from cavsumo.results.recorded_plan import recorded_plan

SUMO_SEEDS = 2**31
ATTEMPTS = 100  # batches that are tried; each fails only if two seeds agree by chance


@dataclass(frozen=True)
class Used:
    """Seeds that a test has used, or may have used.

    Attributes:
        seeds: of all known episodes.
        results: their batches.
        silent: files with an agent's knowledge that do not name the seeds.
    """

    seeds: frozenset[int]
    results: tuple[Path, ...]
    silent: tuple[Path, ...]


def used(results: Sequence[Path], params: Mapping[str, Any]) -> Used:
    """The seeds of results, of their sources, and of the results from which an agent learned.

    ``params`` are the agent's: a manifest among them (``weights=results.json``) is followed, and
    so are those in the plans of all these results.
    """
    seeds: set[int] = set()
    named: dict[Path, Path] = {}  # files that are kept with results, by where they are now
    known, silent = _files_in(params)
    todo, done = [*results, *known], dict.fromkeys(silent, False)
    while todo:
        csv_file = todo.pop(0)
        if done.get(csv_file):
            continue
        plan, manifest = recorded_plan(csv_file)
        seeds |= _seeds_of(csv_file, plan)
        done[csv_file] = True
        kept = _kept(plan, manifest, csv_file)
        named |= {
            place.with_suffix(end): Path(name).with_suffix(end)
            for name, place in kept.items()
            if Path(name).name
            for end in (".csv", place.suffix)
        }
        known, silent = _files_in({**plan.params, **{k: str(v) for k, v in kept.items()}})
        origin = Path(dict(manifest.get("certifies") or {}).get("results", "none"))
        sources = [file for file in (origin, csv_file.parent / origin.name) if _is_there(file)]
        todo += known + sources[:1]
        done |= dict.fromkeys(silent, False)
    return Used(
        frozenset(seeds),
        tuple(named.get(file, file) for file, recorded in done.items() if recorded),
        tuple(named.get(file, file) for file, recorded in done.items() if not recorded),
    )


def _is_there(csv_file: Path) -> bool:
    """Whether there is the manifest of results."""
    return is_visible(csv_file.with_suffix(".json"))


def _kept(plan: BatchPlan, manifest: Mapping[str, Any], csv_file: Path) -> dict[str, Path]:
    """The present paths of the files that parameters name and that are not where they were."""
    found: dict[str, Path] = {}
    for name in {value for value in plan.params.values() if isinstance(value, str)}:
        with contextlib.suppress(InputError):  # it is nowhere: then nothing learned from it either
            found |= present_paths(plan, manifest, csv_file, [str(Path(name))])
    return found


def _seeds_of(csv_file: Path, plan: BatchPlan) -> set[int]:
    """The seeds of a batch: of its rows, and of all episodes of its plan, played here or not.

    If only the manifest exists, those of the plan.
    """
    seeds = {episode_seed(plan.seed, i) for i in range(plan.runs)}
    if plan.scenario.starts_seed is not None:
        seeds.add(plan.scenario.starts_seed)
    if not csv_file.is_file():
        return seeds
    try:
        return seeds | {int(row["seed"]) for row in rows_of(csv_file)}
    except (TypeError, ValueError) as error:
        raise ResultsError(f"results {str(csv_file)!r}: a row without a seed") from error


def _files_in(params: Mapping[str, Any]) -> tuple[list[Path], list[Path]]:
    """The JSON files among parameters: results by their manifests, and other files."""
    named = [Path(value) for value in params.values() if isinstance(value, str)]
    files = [file for file in named if file.suffix == ".json" and is_visible(file)]
    known = [file for file in files if _is_manifest(file)]
    return [f.with_suffix(".csv") for f in known], [f for f in files if f not in known]


def _is_manifest(file: Path) -> bool:
    """Whether a JSON file is the manifest of a batch."""
    try:
        data = json_of(read_text(file, "parameter"))
    except (InputError, ValueError):
        return False
    return isinstance(data, dict) and data.get("format") == FORMAT


def fresh_seed(seed: int, runs: int, used: Collection[int]) -> int:
    """The seed of a batch of so many episodes, none of which has a seed that was used.

    The first of a sequence that starts from ``seed``. Raises InputError when there is none near,
    which takes very many seeds.
    """
    taken = {number % SUMO_SEEDS for number in used}
    for attempt in range(ATTEMPTS):
        found = np.random.SeedSequence((seed, attempt)).generate_state(1, np.uint64)
        batch_seed = int(found[0] >> np.uint64(1))  # the plan's seeds have 63 bits
        if taken.isdisjoint(_sumo_seeds(batch_seed, runs)):
            return batch_seed
    raise InputError(f"no {runs} seeds beside {len(used)} that were used; try fewer --runs")


def _sumo_seeds(batch_seed: int, runs: int) -> Iterator[int]:
    """The seeds of a batch's episodes modulo 2^31."""
    return (episode_seed(batch_seed, i) % SUMO_SEEDS for i in range(runs))
