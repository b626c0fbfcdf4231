"""Tests written as files that are kept (``kept.cavtest``), with their pages."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from cavsumo.batch.replay import Record
from cavsumo.kept.candidate import Candidate, as_recorded
from cavsumo.kept.cavtest import write_cavtest
from cavsumo.kept.minimising import Minimised
from cavsumo.kept.sentence import in_words
from cavsumo.network.site import Site
from cavsumo.report.pages.minimal.page import minimal_page
from cavsumo.report.pages.replay.page import page


def write_minimal_test(file: Path, found: Minimised) -> None:
    """Write the smallest failure; raises InputError when that is not possible."""
    after = dataclasses.replace(found.after, file=file, alone=True)
    row = found.before.row
    about = {
        "sentence": in_words(after.plan, after.row, found.last),
        "made_smaller": {
            "before": _size(found.first),
            "after": _size(found.last),
            "run": int(row["run"]),
            "agent": row["agent"],
            "replays": found.replays,
            "smallest": found.complete,
        },
    }
    told = dataclasses.replace(found, after=after)
    write_cavtest(file, after, minimal_page(told), about)


def write_kept_test(file: Path, record: Record, site: Site) -> None:
    """Write an episode as it was recorded; raises InputError when that is not possible."""
    assert record.trace is not None
    there = dataclasses.replace(record, file=file, alone=True)
    candidate = as_recorded(record.trace.recording())
    about = {"sentence": in_words(record.plan, record.row, candidate)}
    write_cavtest(file, there, page(there, record.trace, site), about)


def _size(candidate: Candidate) -> dict[str, Any]:
    """The size of an episode."""
    return {
        "testers": len(candidate.motions),
        "background": len(candidate.background),
        "segments": candidate.segments,
    }
