"""``cavsumo.run`` and ``cavsumo.run_study``: batches, played as ``cavsumo run`` plays them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
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
from cavsumo.model.objects import SentObject
from cavsumo.model.scenario import Scenario
from cavsumo.model.scenario_file import read_config
from cavsumo.model.study import Part, overruled, read_study

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
    part = Part("", given, {"net": DEFAULT})
    manner = Manner(resume, retry_errors, overwrite, quiet=not (progress and is_shown()))
    (found,) = _played([part], places, output, _means(jobs, executor, scheduler), manner, objects)
    return found


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
    means = _means(jobs, executor, scheduler)
    found = _played(parts, {}, output, means, manner, objects)
    return {part.name: results for part, results in zip(parts, found, strict=True)}


def _means(jobs: int | None, executor: Any, scheduler: str | None) -> Means:
    """How the episodes are played."""
    if executor is not None:
        return Means(jobs, executor, scheduler)
    return Means(jobs, "local" if scheduler is None else "dask", scheduler)


def _played(
    parts: Sequence[Part],
    places: Mapping[str, Path],
    output: str | os.PathLike[str] | None,
    means: Means,
    manner: Manner,
    objects: Sequence[SentObject],
) -> list[Results]:
    """The results of batches, in a temporary folder without an output.

    ``places`` as in ``Scenario.placed``.
    """
    if output is None and (manner.resume or manner.retry_errors):
        raise InputError("run: resume and retry_errors go on with an output; none is given")
    folder = TemporaryFolder() if output is None else None
    file = folder.path / FILE if folder is not None else Path(output or FILE)
    try:
        _play(parts, places, file, means, manner)
    except BaseException:
        if folder is not None:
            folder.close()
        raise
    return [
        Results(part.output(file), trusted=True, folder=folder, objects=tuple(objects))
        for part in parts
    ]


def _play(
    parts: Sequence[Part], places: Mapping[str, Path], file: Path, means: Means, manner: Manner
) -> None:
    """Play batches into files."""
    batches = []
    for part, batch in zip(parts, checked(parts, file, manner, places), strict=True):
        said = ", ".join(f"{key}={value!r}" for key, value in part.settings.items())
        manifest = {**batch.manifest, "command": [], "call": f"cavsumo.run({said})"}
        batches.append(replace(batch, manifest=manifest))
    _, interrupted = played(batches, means, manner)
    if interrupted:
        raise KeyboardInterrupt
