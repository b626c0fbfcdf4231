"""Recorded episodes with their files wherever they are now."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from cavsumo.batch.replay import Record
from cavsumo.model.named_networks import check_network, named_routes, network_file, routes_file
from cavsumo.results.present import present_paths

PLAYED_BACK = ", or play back who departed with --playback"


def located(
    record: Record, net: Path | None = None, routes: Path | None = None, *, shown: bool = False
) -> Record:
    """The record with the present paths of its files.

    Args:
        net, routes: where the network and the routes are; cavsumo's are found by their names.
        shown: the episode is not played, so that the network is enough.

    Raises InputError for a missing or different file.
    """
    plan, scenario = record.plan, record.plan.scenario
    given: dict[str, Path] = {}
    if net is not None:
        check_network(net, "--net")
        given[str(scenario.net)] = network_file(net)
    if routes is not None:
        given[str(scenario.routes)] = routes_file(named_routes(routes, "--routes"))
    names = [str(scenario.net)] if shown else None
    way_out = PLAYED_BACK if record.trace is not None and record.trace.has_recording else ""
    places = present_paths(plan, record.origin, record.file, names, given=given, way_out=way_out)
    placed = plan.model_copy(update={"scenario": scenario.placed(places)})
    return dataclasses.replace(record, plan=placed)
