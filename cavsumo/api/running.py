"""``cavsumo.run``: a batch of episodes, played as ``cavsumo run`` plays it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from cavsumo.api.keywords import settings_of
from cavsumo.api.results import Results, TemporaryFolder
from cavsumo.batch.manner import Manner, Means
from cavsumo.batch.playing import played
from cavsumo.batch.preflight import checked
from cavsumo.batch.progress import is_shown
from cavsumo.errors import InputError
from cavsumo.model.named_networks import DEFAULT
from cavsumo.model.scenario import Scenario
from cavsumo.model.scenario_file import read_config
from cavsumo.model.study import Part, overruled

FILE = "results.csv"  # of results without an output file


def run(
    net: str | os.PathLike[str] | Scenario | None = None,
    *,
    config: str | os.PathLike[str] | None = None,
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
    manner = Manner(resume, retry_errors, overwrite, quiet=not (progress and is_shown()))
    means = _means(jobs, executor, scheduler)
    if output is None and (resume or retry_errors):
        raise InputError("run: resume and retry_errors go on with an output; none is given")
    if output is not None:
        _play(given, places, Path(output), means, manner)
        return Results(Path(output), trusted=True, objects=tuple(objects))
    folder = TemporaryFolder()
    try:
        _play(given, places, folder.path / FILE, means, manner)
    except BaseException:
        folder.close()
        raise
    return Results(folder.path / FILE, trusted=True, folder=folder, objects=tuple(objects))


def _means(jobs: int | None, executor: Any, scheduler: str | None) -> Means:
    """How the episodes are played."""
    if executor is not None:
        return Means(jobs, executor, scheduler)
    return Means(jobs, "local" if scheduler is None else "dask", scheduler)


def _play(
    settings: Mapping[str, Any],
    places: Mapping[str, Path],
    file: Path,
    means: Means,
    manner: Manner,
) -> None:
    """Play a batch into a file; ``places`` as in ``Scenario.placed``."""
    (batch,) = checked([Part("", dict(settings), {"net": DEFAULT})], file, manner, places)
    said = ", ".join(f"{key}={value!r}" for key, value in settings.items())
    manifest = {**batch.manifest, "command": [], "call": f"cavsumo.run({said})"}
    _, interrupted = played([replace(batch, manifest=manifest)], means, manner)
    if interrupted:
        raise KeyboardInterrupt
