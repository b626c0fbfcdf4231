"""``cavsumo estimate``: how often an ego fails preventably, with an interval or a refusal."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from cavsumo.batch.ended import Ended
from cavsumo.batch.estimated import compared
from cavsumo.batch.manner import Manner, Means
from cavsumo.batch.planned import PlannedBatch
from cavsumo.batch.playing import played
from cavsumo.batch.preflight import prepared_batches
from cavsumo.batch.summary import result_files
from cavsumo.cli.commands.run import announce
from cavsumo.cli.requests.estimate import EstimateShown
from cavsumo.cli.steps import SlowSteps
from cavsumo.errors import Exit
from cavsumo.report import estimates


def estimate(
    batches: Sequence[PlannedBatch], means: Means, manner: Manner, shown: EstimateShown
) -> int:
    """Play the episodes of an estimate, or of two egos, and print the result.

    Returns the exit status: 0 there is a result, 3 it is refused, 130 interrupted.
    """
    with SlowSteps(quiet=manner.quiet) as steps:
        steps.begin("reading the network and looking for starts")
        checked = prepared_batches(batches, manner)
    ended, interrupted = played(checked, means, manner, announce)
    egos = [batch.plan.scenario.ego for batch in batches][: len(ended)]
    if shown.picture is not None:
        drawn = {
            f"{one.name} {ego}".strip(): facts
            for one, ego in zip(ended, egos, strict=True)
            for facts in one.estimates.values()
        }
        estimates.draw(drawn, shown.picture)
    if shown.as_json:
        _print_json(ended, egos, shown)
    elif not manner.quiet:
        _print(ended, egos, shown)
    if interrupted:
        return Exit.INTERRUPTED
    refused = any(facts.refused for one in ended for facts in one.estimates.values())
    return Exit.NOT_RUN if refused else Exit.OK


def _print(ended: Sequence[Ended], egos: Sequence[str], shown: EstimateShown) -> None:
    """Print the results in words."""
    for one, ego in zip(ended, egos, strict=True):
        for facts in one.estimates.values():
            print(f"{ego}: {estimates.words(facts, shown.bound)}")
        print(f"{result_files(one)}\n")
    if _pair(ended):
        print(estimates.ratio_words(egos[0], egos[1], compared(*_files(ended))))
    if any(one.tally.all.errors for one in ended):
        print("cavsumo: run again with --retry-errors", file=sys.stderr)


def _print_json(ended: Sequence[Ended], egos: Sequence[str], shown: EstimateShown) -> None:
    """Print one JSON object: the estimate, or those of two egos and their ratio."""
    found = [
        {"ego": ego, **estimates.as_json(facts, shown.bound), "results": str(one.csv_file)}
        for one, ego in zip(ended, egos, strict=True)
        for facts in one.estimates.values()
    ]
    whole: object = found[0] if len(found) == 1 else {"estimates": found}
    if _pair(ended):
        ratio = estimates.ratio_json(compared(*_files(ended)))
        whole = {"estimates": found, "comparison": ratio}
    print(json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False))


def _pair(ended: Sequence[Ended]) -> bool:
    """Whether two egos are compared."""
    return [one.name for one in ended] == ["first", "second"]


def _files(ended: Sequence[Ended]) -> tuple[Path, Path]:
    first, second = ended
    return first.csv_file, second.csv_file
