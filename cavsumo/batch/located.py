"""The files of recorded episodes, wherever they are now: identified by their checksums.

Each is searched where it was when it was recorded, beside the results or the trace, and among the
inputs that are kept with them (``results/inputs``). Nothing depends on the working folder but a
relative path, and that only where the file there is the recorded one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping
from pathlib import Path

from cavsumo.batch.replay import Record
from cavsumo.errors import InputError
from cavsumo.model.checksums import checksum
from cavsumo.model.named_networks import check_network, network_file
from cavsumo.results.inputs import FOLDER, unpacked
from cavsumo.results.provenance import input_files


def located(
    record: Record, net: Path | None = None, routes: Path | None = None, *, shown: bool = False
) -> Record:
    """The record with the present paths of its files.

    Args:
        net, routes: where the network and the routes are; a network with a name is found by it.
        shown: the episode is not played, so that the network is enough.

    Raises InputError for a missing or different file.
    """
    scenario = record.plan.scenario
    given: dict[str, Path] = {}
    if net is not None:
        check_network(net, "--net")
        given[str(scenario.net)] = network_file(net)
    if routes is not None and scenario.routes is not None:
        given[str(scenario.routes)] = routes
    names = [str(scenario.net)] if shown else list(input_files(record.plan))
    placed = scenario.placed(present_paths(record, names, given))
    return dataclasses.replace(record, plan=record.plan.model_copy(update={"scenario": placed}))


def present_paths(
    record: Record, names: Collection[str], given: Mapping[str, Path] | None = None
) -> dict[str, Path]:
    """The present paths of files that a record's plan names, of those that are not where they were.

    ``given``: where some of them are said to be, by their names. Raises InputError.
    """
    sums, found = dict(record.origin.get("sha256") or {}), {}
    essential = _essential(record)
    for name, was in input_files(record.plan).items():
        if name in names and (name in sums or name in essential):
            place = _place(record, name, was, sums.get(name, ""), (given or {}).get(name))
            if place != was:
                found[name] = place
    return found


def inputs_folder(record: Record) -> Path:
    """The folder of the inputs that are kept with results, or beside a trace that stands alone."""
    return (record.file.parent if record.alone else record.file.with_suffix("")) / FOLDER


def _essential(record: Record) -> set[str]:
    """The names of files that must be known by their checksums."""
    scenario = record.plan.scenario
    return {str(f) for f in (scenario.net, scenario.routes, *scenario.additional) if f is not None}


def _place(record: Record, name: str, was: Path, sha: str, given: Path | None) -> Path:
    """The present path of a file."""
    option = _option(record, name)
    there = [file for file in (given or was, record.file.parent / was.name) if file.is_file()]
    for file in there[:1] if given else there:
        if checksum(file) == sha:
            return file
    what = f"{was.name!r} (sha256 {sha[:12] or 'unknown'})"
    if given is not None and not given.is_file():
        raise InputError(f"{option}: no such file: {str(given)!r}")
    kept = None if given else unpacked(inputs_folder(record), sha)
    if kept is not None:
        return kept
    if there:
        raise InputError(
            f"{option} {str(there[0])!r}: sha256 {checksum(there[0])[:12]}, not the {what} of "
            f"{str(record.file)!r}"
        )
    how = f"name it with {option} FILE or put it" if option.startswith("--") else "put it"
    raise InputError(
        f"{str(record.file)!r} needs {what}, which is not here; {how} beside it"
        f"{_without(record, option)}"
    )


def _option(record: Record, name: str) -> str:
    """The option that names a file, or its sort where none does."""
    scenario = record.plan.scenario
    known = {str(file): "additional" for file in scenario.additional}
    known |= {str(scenario.routes): "--routes", str(scenario.net): "--net"}
    return known.get(name, "agent")


def _without(record: Record, option: str) -> str:
    """The way to do without a file, if there is one."""
    if option == "--routes" and record.trace is not None and record.trace.has_recording:
        return ", or play back who departed with --playback"
    return ""
