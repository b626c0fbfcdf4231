"""``cavsumo.run`` and ``cavsumo.run_study``: batches, played as ``cavsumo run`` plays them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from cavsumo.agents.names import SEARCH
from cavsumo.api.keywords import settings_of
from cavsumo.api.results import Results, TemporaryFolder
from cavsumo.batch.manner import Manner, Means
from cavsumo.batch.playing import played
from cavsumo.batch.preflight import checked
from cavsumo.batch.progress import is_shown
from cavsumo.errors import InputError
from cavsumo.model.named_networks import DEFAULT
from cavsumo.model.objects import SentObject
from cavsumo.model.scenario import Scenario
from cavsumo.model.scenario_file import read_config
from cavsumo.model.study import Part, overruled, read_study
from cavsumo.openscenario.parts import ScenarioChoice, scenario_parts

FILE = "results.csv"  # of results without an output file


def run(
    net: str | os.PathLike[str] | Scenario | None = None,
    *,
    config: str | os.PathLike[str] | None = None,
    scenario: str | os.PathLike[str] | None = None,
    scenario_params: Mapping[str, Any] | None = None,
    scenario_root: str | os.PathLike[str] | None = None,
    scenario_ego: str = "Ego",
    output: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    executor: Any = None,
    scheduler: str | None = None,
    progress: bool = True,
    resume: bool = False,
    retry_errors: bool = False,
    overwrite: bool = False,
    **settings: Any,
) -> Results:
    """Play a batch of episodes; the rows are those of the command ``cavsumo run``.

    Args:
        net: a network's name or file (default: the crossing), or a whole scenario.
        config: a scenario file (TOML) of one scenario; the keywords win.
        scenario: a published scenario (OpenSCENARIO XML, docs/published-scenarios.md), in place of
            a network and testers.
        scenario_params: values of its parameters, by name.
        scenario_root: the folder that its files may come from; its own if not given.
        scenario_ego: the name of its entity under test.
        output: the results file (.csv), with manifest and traces beside it. Without it the results
            lie in a temporary folder until the ``Results`` are gone, or the process ends.
        jobs: episodes at a time (default 1), in processes of their own.
        executor: a ``concurrent.futures.Executor`` or a dask ``Client`` that plays them instead.
        scheduler: the address of a dask scheduler whose workers play them.
        progress: show a bar, in a notebook or on a terminal.
        resume: continue after the existing results, or start.
        retry_errors: play the episodes again that ended in errors.
        overwrite: start again in place of what lies there: an unfinished batch, or another one.
        **settings: of the scenario and of the batch, by their names in a scenario file
            (docs/python.md): ``agents``, ``ego``, ``testers``, ``runs``, ``seed`` ...

    Returns:
        the results; an episode that could not be played is a row with the outcome "error".

    Raises:
        InputError: an argument, a name or a file is wrong; no episode was played.
        BatchError: the batch cannot continue, for example on a full disk.
        KeyboardInterrupt: the user stopped it; finished rows are in ``output``.
    """
    given, objects = settings_of(net, settings)
    places = net.places if isinstance(net, Scenario) else {}
    if config is not None:
        given = overruled(read_config(Path(config)), given)
    part = Part("", given, {"net": DEFAULT})
    if scenario is not None:
        if config is not None:
            raise InputError("run: config: scenario names another scenario; give one of them")
        values = {name: f"{value}" for name, value in (scenario_params or {}).items()}
        root = None if scenario_root is None else Path(scenario_root)
        read = scenario_parts(ScenarioChoice(Path(scenario), values, root, scenario_ego), given)
        if len(read.parts) != 1:
            raise InputError(
                f"run: scenario {os.fspath(scenario)!r}: has {len(read.parts)} variations; "
                "scenario_params of the scenario itself play one"
            )
        (part,), places = read.parts, read.places
    manner = Manner(resume, retry_errors, overwrite, quiet=not (progress and is_shown()))
    order = Order((part,), manner, means_of(jobs, executor, scheduler), places=places)
    (found,) = results_of(order, output, objects)
    return found


def search(
    net: str | os.PathLike[str] | Scenario | None = None,
    *,
    method: str = "portfolio",
    **arguments: Any,
) -> Results:
    """Search for preventable failures of an ego, as ``cavsumo search`` does.

    Args:
        net: see ``run``.
        method: of the search, by its name (docs/search.md).
        **arguments: those of ``run``; there is one tester unless ``testers`` says otherwise.

    Returns and raises as ``run``.
    """
    if "agents" in arguments:
        raise InputError("search: agents: expected none, it has an agent of its own")
    params = {**arguments.pop("params", {}), f"{SEARCH}.method": method}
    if not isinstance(net, Scenario) and not arguments.get("config"):
        arguments.setdefault("testers", 1)
    return run(net, agents=[SEARCH], params=params, **arguments)


def run_study(
    config: str | os.PathLike[str],
    *,
    output: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    executor: Any = None,
    scheduler: str | None = None,
    progress: bool = True,
    resume: bool = False,
    retry_errors: bool = False,
    overwrite: bool = False,
    **settings: Any,
) -> dict[str, Results]:
    """Play the batches of a scenario file (TOML) with a table ``[vary]``, one after another.

    Args:
        config: the scenario file; the keywords win, but may not be what it varies.
        output: the results file, to whose name that of each batch is added.
        jobs, executor, scheduler, progress, resume, retry_errors, overwrite, **settings: see
            ``run``.

    Returns:
        the results of each batch, by its name: ``testers3`` for ``testers = [1, 3]``.

    Raises as ``run``; all batches are checked before any is played.
    """
    given, objects = settings_of(None, settings)
    parts = read_study(Path(config), given)
    manner = Manner(resume, retry_errors, overwrite, quiet=not (progress and is_shown()))
    order = Order(tuple(parts), manner, means_of(jobs, executor, scheduler))
    found = results_of(order, output, objects)
    return {part.name: results for part, results in zip(parts, found, strict=True)}


@dataclass(frozen=True)
class Order:
    """Batches that a call asks for.

    Attributes:
        parts, manner, means: the batches, and how they are played.
        call: the call as text; empty for that of ``run`` with the settings of each batch.
        places: as in ``Scenario.placed``.
    """

    parts: Sequence[Part]
    manner: Manner
    means: Means
    call: str = ""
    places: Mapping[str, Path] = field(default_factory=dict)


def results_of(
    order: Order, output: str | os.PathLike[str] | None, objects: Sequence[SentObject]
) -> list[Results]:
    """The results of batches that are played into files, or into a temporary folder."""
    if output is None and (order.manner.resume or order.manner.retry_errors):
        raise InputError("run: resume and retry_errors go on with an output; none is given")
    folder = TemporaryFolder() if output is None else None
    file = folder.path / FILE if folder is not None else Path(output or FILE)
    try:
        _play(order, file)
    except BaseException:
        if folder is not None:
            folder.close()
        raise
    return [
        Results(part.output(file), trusted=True, folder=folder, objects=tuple(objects))
        for part in order.parts
    ]


def means_of(jobs: int | None, executor: Any, scheduler: str | None) -> Means:
    """How the episodes are played."""
    if executor is not None:
        return Means(jobs, executor, scheduler)
    return Means(jobs, "local" if scheduler is None else "dask", scheduler)


def _play(order: Order, file: Path) -> None:
    """Play batches into files."""
    batches = []
    planned = checked(order.parts, file, order.manner, order.places)
    for part, batch in zip(order.parts, planned, strict=True):
        said = ", ".join(f"{key}={value!r}" for key, value in part.settings.items())
        call = order.call or f"cavsumo.run({said})"
        batches.append(replace(batch, manifest={**batch.manifest, "command": [], "call": call}))
    _, interrupted = played(batches, order.means, order.manner)
    if interrupted:
        raise KeyboardInterrupt
