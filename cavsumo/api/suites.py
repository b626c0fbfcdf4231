"""``cavsumo.suite``: a published catalogue of tests, played as ``cavsumo suite`` plays it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from cavsumo.api.keywords import settings_of
from cavsumo.api.results import Results
from cavsumo.api.running import Order, means_of, results_of
from cavsumo.batch.manner import Manner
from cavsumo.batch.progress import is_shown
from cavsumo.suites.parts import suite_part


def suite(
    name: str | os.PathLike[str],
    ego: Any = "sumo",
    *,
    only: str | Sequence[str] = (),
    speeds: Sequence[float] = (),
    extended: bool = False,
    vary: int = 0,
    values: Mapping[str, float] | None = None,
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
    """Play the cases of a suite, one episode each; the rows are those of ``cavsumo suite``.

    Args:
        name: of a suite (``cavsumo suite list``), or a suite's file (.toml).
        ego: the vehicle under test, by name, a class or an object.
        only: tests or cases, such as ``"CPNA"`` or ``"CPNA/30/*"``.
        speeds: of the ego [km/h].
        extended: also the cells beyond the standard range.
        vary: variations of each case besides itself.
        values: numbers in place of values and sizes of the suite, such as ``{"ego_length": 4.7}``.
        output, jobs, executor, scheduler, progress, resume, retry_errors, overwrite: as for
            ``cavsumo.run``.
        **settings: of the batch: ``ego_params``, ``ego_sensor``, ``seed``, ``trace``,
            ``reference``, ``assertions`` ...

    Returns:
        the results, with the columns ``case`` and ``parameters``.

    Raises InputError for an unknown suite, test or speed, for filters that leave no case, and for
    an ego that cannot reach the speed of a case; then no episode was played.
    """
    given, objects = settings_of(None, {"ego": ego, **settings})
    chosen = {
        "only": [only] if isinstance(only, str) else list(only),
        "speeds": list(speeds),
        "extended": extended,
        "vary": vary,
        "values": tuple((values or {}).items()),
    }
    part = suite_part(os.fspath(name), chosen, given)
    manner = Manner(resume, retry_errors, overwrite, quiet=not (progress and is_shown()))
    shown = {"ego": given["ego"], **{key: value for key, value in chosen.items() if value}}
    said = ", ".join([repr(os.fspath(name)), *(f"{k}={v!r}" for k, v in shown.items())])
    means = means_of(jobs, executor, scheduler)
    (found,) = results_of(Order((part,), manner, means, f"cavsumo.suite({said})"), output, objects)
    return found
