"""``cavsumo.transfer``: kept tests on other networks, as ``cavsumo transfer`` tries them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from cavsumo.api.keywords import settings_of
from cavsumo.api.results import Results
from cavsumo.api.running import Order, means_of, results_of
from cavsumo.batch.manner import Manner
from cavsumo.batch.progress import is_shown
from cavsumo.kept.transfer import transfer_parts
from cavsumo.kept.transfer_order import FORMS, TransferOrder
from cavsumo.kept.transferred import transferred

if TYPE_CHECKING:
    import pandas

FileName = str | os.PathLike[str]


class Transfer(NamedTuple):
    """Tests on other networks.

    Attributes:
        table: a row for each test on each network, on all ("all"), and for all tests: places,
            how many of them it fails at again (``fails_at``, with ``fails_at_low`` and
            ``fails_at_high``), episodes, failures, those that are preventable or were not judged
            (``again``, ``again_low``, ``again_high``: shares), and errors.
        results: those of each batch, by its name.
    """

    table: pandas.DataFrame
    results: dict[str, Results]


def transfer(
    tests: Sequence[FileName],
    nets: Sequence[FileName],
    *,
    ego: Any = None,
    ego_params: Mapping[str, Any] | None = None,
    places: int = 5,
    seeds: int = 3,
    seed: int = 1,
    forms: Sequence[str] = FORMS,
    trust: bool = False,
    output: FileName | None = None,
    jobs: int | None = None,
    progress: bool = True,
    resume: bool = False,
    overwrite: bool = False,
) -> Transfer:
    """Try failures on other networks, wherever they fit.

    Args:
        tests: kept tests (.cavtest), or rows as ``"FILE.csv:RUN"``.
        nets: names or files of networks.
        ego, ego_params: in place of the egos of the tests.
        places: of a test on a network, at most.
        seeds: episodes at each place, in each form.
        seed: of the batches.
        forms: of each test: "zone" keeps where the ego is as a pedestrian comes into its way,
            "phase" when that is between two decisions of the ego.
        trust: use egos and assertions that only the files name.
        output: the results file, to whose name that of each batch is added.
        jobs, progress, resume, overwrite: as for ``cavsumo.run``.

    Raises InputError for a test without a relative form, for an unknown network, and where no test
    fits anywhere; then nothing was played.
    """
    import pandas

    given, objects = settings_of(None, {} if ego is None else {"ego": ego})
    order = TransferOrder(
        [os.fspath(one) for one in tests],
        [os.fspath(one) for one in nets],
        ego=given.get("ego"),
        ego_params=dict(ego_params or {}),
        places=places,
        seeds=seeds,
        seed=seed,
        forms=forms,
        trust=trust,
    )
    parts = transfer_parts(order)
    manner = Manner(resume, overwrite=overwrite, quiet=not (progress and is_shown()))
    said = f"cavsumo.transfer({list(order.tests)!r}, {list(order.nets)!r})"
    asked = Order(parts.parts, manner, means_of(jobs, None, None), said)
    results = results_of(asked, output, objects)
    rows = [
        {
            "test": one.test,
            "net": one.net,
            "places": one.places,
            "fails_at": one.again_at.count,
            "fails_at_low": one.again_at.low,
            "fails_at_high": one.again_at.high,
            "episodes": one.episodes,
            "failures": one.failures,
            "again": one.again.value,
            "again_low": one.again.low,
            "again_high": one.again.high,
            "errors": one.errors,
        }
        for one in transferred(parts, [found.file for found in results])
    ]
    named = {part.name: found for part, found in zip(parts.parts, results, strict=True)}
    return Transfer(pandas.DataFrame(rows), named)
