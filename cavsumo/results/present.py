"""The files that a recorded plan names, wherever they are now: identified by their checksums.

Each is searched where it was when it was recorded, beside the results or the trace, and among the
inputs that are kept with them (``inputs``). Nothing depends on the working folder but a relative
path, and that only where the file there is the recorded one.
"""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from cavsumo.agents.names import policy_file
from cavsumo.errors import InputError
from cavsumo.model.checksums import checksum, readable_checksum
from cavsumo.model.scenario import BatchPlan, Scenario
from cavsumo.results.inputs import inputs_folder, unpacked


def input_files(plan: BatchPlan) -> dict[str, Path]:
    """The files that an episode is played from besides programs: their names, present paths.

    The network, routes, additional files, policies, and files that agents' parameters may name.
    """
    scenario = plan.scenario
    found = {str(scenario.net): scenario.net_file}
    if scenario.routes is not None and scenario.routes_file is not None:
        found[str(scenario.routes)] = scenario.routes_file
    policies = [file for file in map(policy_file, plan.cast.values()) if file is not None]
    named = [Path(value) for value in plan.params.values() if isinstance(value, str)]
    files = (*scenario.additional, *policies, *named)
    return found | {str(file): scenario.present(file) for file in files}


def present_paths(
    plan: BatchPlan,
    origin: Mapping[str, Any],
    file: Path,
    names: Collection[str] | None = None,
    *,
    given: Mapping[str, Path] | None = None,
    way_out: str = "",
) -> dict[str, Path]:
    """The present paths of files that a recorded plan names, if they are not where they were.

    Args:
        plan, origin: the plan, and the manifest or the head of a trace with the checksums.
        file: the results file or the trace.
        names: the files that are needed; None for all.
        given: where some of them are said to be, by their names.
        way_out: what else can be done without the routes, for the message.

    Raises InputError for a missing or different file.
    """
    sums, found = dict(origin.get("sha256") or {}), {}
    options = _options(plan)
    for name, was in input_files(plan).items():
        option = options.get(name)
        if (names is None or name in names) and (option or name in sums):
            wanted = _Wanted(file, option or "agent", was, str(sums.get(name, "")))
            there = (given or {}).get(name)
            place = _found(wanted, way_out) if there is None else _given(wanted, there)
            if place != was:
                found[name] = place
    return found


def gone(plan: BatchPlan) -> list[str]:
    """The names of the files of a plan that cannot be read where they were."""
    return [name for name, was in input_files(plan).items() if readable_checksum(was) is None]


def placed_scenario(plan: BatchPlan, origin: Mapping[str, Any], file: Path) -> Scenario:
    """The scenario of a recorded plan, to be played again: gone files are those of the results.

    A file that is nowhere keeps its name, so that playing it is refused.
    """
    scenario, found = plan.scenario, dict[str, Path]()
    own = {str(path) for path in (scenario.net, scenario.routes, *scenario.additional)}
    for name in own.intersection(gone(plan)):
        with contextlib.suppress(InputError):
            found |= present_paths(plan, origin, file, [name])
    return scenario.placed(found)


class _Wanted(NamedTuple):
    """A file to find: the results that name it, its option, its recorded path and checksum."""

    results: Path
    option: str
    was: Path
    sha: str

    def __str__(self) -> str:
        return f"{self.was.name!r} (sha256 {self.sha[:12] or 'unknown'})"


def _options(plan: BatchPlan) -> dict[str, str]:
    """The options that name files whose checksums must be known, by the names of the files."""
    scenario = plan.scenario
    options = {str(file): "additional" for file in scenario.additional}
    if scenario.routes is not None:
        options[str(scenario.routes)] = "--routes"
    return options | {str(scenario.net): "--net"}


def _given(wanted: _Wanted, file: Path) -> Path:
    """The file that is said to be the wanted one."""
    if not file.is_file():
        raise InputError(f"{wanted.option}: no such file: {str(file)!r}")
    if (sha := checksum(file)) != wanted.sha:
        raise _another(wanted, file, sha)
    return file


def _found(wanted: _Wanted, way_out: str) -> Path:
    """The wanted file where it was, beside the results or among their inputs."""
    places = (wanted.was, wanted.results.parent / wanted.was.name)
    sums = {file: sha for file in places if (sha := readable_checksum(file)) is not None}
    for file, sha in sums.items():
        if sha == wanted.sha:
            return file
    kept = unpacked(inputs_folder(wanted.results), wanted.sha)
    if kept is not None:
        return kept
    if sums:
        raise _another(wanted, *next(iter(sums.items())))
    option = wanted.option
    how = f"name it with {option} FILE or put it" if option.startswith("--") else "put it"
    without = way_out if option == "--routes" else ""
    raise InputError(
        f"{str(wanted.results)!r} needs {wanted}, which is not here; {how} beside it{without}"
    )


def _another(wanted: _Wanted, file: Path, sha: str) -> InputError:
    """The refusal of a file with another checksum."""
    return InputError(
        f"{wanted.option} {str(file)!r}: sha256 {sha[:12]}, not the {wanted} of "
        f"{str(wanted.results)!r}"
    )
