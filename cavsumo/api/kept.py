"""``cavsumo.minimise`` and ``cavsumo.regress``: the smallest failures, and kept tests."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cavsumo.api.episodes import MinimalTest, RecordedEpisode
from cavsumo.api.keywords import settings_of
from cavsumo.api.results import load
from cavsumo.errors import InputError
from cavsumo.kept.minimising import MOST_REPLAYS
from cavsumo.kept.regression import RECORDED, OtherEgo, Regression, regressions

if TYPE_CHECKING:
    import pandas

FileName = str | os.PathLike[str]


def minimise(
    results: FileName,
    run: int | None = None,
    *,
    output: FileName | None = None,
    replays: int = MOST_REPLAYS,
    trust: bool = False,
) -> MinimalTest:
    """Find the smallest test that still fails the ego the same way, as ``cavsumo minimise`` does.

    Args:
        results: the CSV of a batch, or a kept test (.cavtest).
        run: number of the episode in a CSV.
        output: a file for the test (.cavtest).
        replays: stop after so many.
        trust: as for ``cavsumo.load``.

    Raises InputError for an episode that is no failure or not the same when it is played back.
    """
    loaded = load(results, trust=trust)
    if isinstance(loaded, RecordedEpisode):
        episode = loaded
    elif run is None:
        raise InputError(f"minimise: which run of {os.fspath(results)!r}? name its number")
    else:
        episode = loaded.replay(run, recorded=True)
    found = episode.minimised(replays=replays)
    if output is not None:
        found.keep(output)
    return found


def regress(
    tests: Sequence[FileName],
    ego: Any,
    *,
    ego_params: Mapping[str, Any] | None = None,
    testers: str = RECORDED,
    jobs: int = 1,
    trust: bool = False,
) -> pandas.DataFrame:
    """Play kept tests against another ego, as ``cavsumo regress`` does.

    Args:
        tests: files (.cavtest).
        ego: the ego by name, a class or an object.
        ego_params: its parameters.
        testers: "recorded": they act by the clock; "policy": each sets off when the ego is where
            it was as the tester last stood.
        jobs: tests at a time.
        trust: use assertions that only the files name.

    Returns:
        a row for each test: ``test``, its file; ``status``: "still fails", "passes now",
        "no longer meets", "stands still" or "error"; ``told``, the reason; ``sentence``, the test.

    Raises InputError for a file that is no kept test, and for an unknown ego.
    """
    import pandas

    given, _objects = settings_of(None, {"ego": ego, "ego_params": dict(ego_params or {})})
    other = OtherEgo(given["ego"], given["ego_params"], testers, trust)
    found: list[Regression] = regressions([Path(one) for one in tests], other, jobs)
    rows = [(str(one.file), one.status, one.told, one.sentence) for one in found]
    return pandas.DataFrame(rows, columns=["test", "status", "told", "sentence"])
