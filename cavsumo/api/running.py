"""``cavsumo.run``: a batch of episodes, played as ``cavsumo run`` plays it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
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
    if config is not None:
        given = overruled(read_config(Path(config)), given)
    manner = Manner(resume, retry_errors, overwrite, quiet=not (progress and is_shown()))
    said = ", ".join(f"{key}={value!r}" for key, value in given.items())
    part = Part("", dict(given), {"net": DEFAULT})
    order = Order(part, f"cavsumo.run({said})", manner, means_of(jobs, executor, scheduler))
    return results_of(order, output, objects)


@dataclass(frozen=True)
class Order:
    """A batch that a call asks for: what, the call as text, and how it is played."""

    part: Part
    call: str
    manner: Manner
    means: Means


def results_of(
    order: Order, output: str | os.PathLike[str] | None, objects: Sequence[SentObject]
) -> Results:
    """The results of a batch that is played into a file, or into a temporary one."""
    manner = order.manner
    if output is None and (manner.resume or manner.retry_errors):
        raise InputError("run: resume and retry_errors go on with an output; none is given")
    if output is not None:
        _play(order, Path(output))
        return Results(Path(output), trusted=True, objects=tuple(objects))
    folder = TemporaryFolder()
    try:
        _play(order, folder.path / FILE)
    except BaseException:
        folder.close()
        raise
    return Results(folder.path / FILE, trusted=True, folder=folder, objects=tuple(objects))


def means_of(jobs: int | None, executor: Any, scheduler: str | None) -> Means:
    """How the episodes are played."""
    if executor is not None:
        return Means(jobs, executor, scheduler)
    return Means(jobs, "local" if scheduler is None else "dask", scheduler)


def _play(order: Order, file: Path) -> None:
    """Play a batch into a file."""
    (batch,) = checked([order.part], file, order.manner)
    manifest = {**batch.manifest, "command": [], "call": order.call}
    _, interrupted = played([replace(batch, manifest=manifest)], order.means, order.manner)
    if interrupted:
        raise KeyboardInterrupt
