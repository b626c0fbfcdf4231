"""A report as plain figures: nested for JSON, one per line for CSV."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cavsumo.report.analysis import Report
from cavsumo.report.compare import PairedComparison
from cavsumo.report.effort import PerSecond
from cavsumo.report.load import Batch
from cavsumo.report.rates import Share
from cavsumo.report.survival import RunOf
from cavsumo.results.statistics import Rate

FORMAT = "cavsumo-report-1"
COLUMNS = ("section", "setting", "agent", "group", "quantity", "value", "low", "high", "method")
LABELS = ("setting", "agent", "value")
Line = tuple[Any, ...]


def as_json(report: Report) -> dict[str, Any]:
    """All figures as JSON; an infinite bound is null beside a finite one."""
    counts = report.evidence.rows["batch"].value_counts()
    return {
        "format": FORMAT,
        "by": report.by,
        "batches": [
            _batch(b, int(counts.get(i, 0))) for i, b in enumerate(report.evidence.batches)
        ],
        "rates": [_plain(one) for one in report.rates],
        "driving": [_plain(one) for one in report.driving],
        "comparisons": [_plain(one) for one in report.comparisons],
        "time_to_test": [
            _plain(dataclasses.replace(one, curve=None), leave_out=("curve",))
            for one in report.times
        ],
        "effort": [_plain(one) for one in report.efforts],
        "distinct": [_plain(one) for one in report.distinct],
        "failures": [_plain(one) for one in report.failures],
    }


def _batch(batch: Batch, episodes: int) -> dict[str, Any]:
    """The source of rows."""
    scenario = batch.plan.scenario
    return {
        "file": str(batch.csv_file),
        "status": batch.manifest.get("status"),
        "stopped_by": batch.manifest.get("stopped_by"),
        "sequential": batch.sequential,
        "episodes": episodes,
        "planned": batch.plan.size,
        "network": scenario.name,
        "ego": scenario.ego,
        "testers": scenario.testers,
        "kind": scenario.kind,
        "seed": batch.plan.seed,
    }


def _plain(value: Any, leave_out: Sequence[str] = ()) -> Any:
    """A record in JSON's types."""
    if isinstance(value, Share):
        ends = {name: [rate.low, rate.high] for name, rate in value.intervals.items()}
        head = {"count": value.count, "total": value.total, "of": value.of, "value": value.value}
        return {**head, "intervals": ends}
    if dataclasses.is_dataclass(value):
        fields = (f.name for f in dataclasses.fields(value) if f.name not in leave_out)
        return {name: _plain(getattr(value, name)) for name in fields}
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return {name: _plain(part) for name, part in value._asdict().items()}
    if isinstance(value, Mapping):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def lines(report: Report) -> Iterator[Line]:
    """One figure a line, in the order of ``COLUMNS``; empty cells are None."""
    sections: Mapping[str, Sequence[Any]] = {
        "rates": report.rates,
        "driving": report.driving,
        "time_to_test": report.times,
        "effort": report.efforts,
        "distinct": report.distinct,
    }
    for section, records in sections.items():
        for record in records:
            head = (section, *record.whose)
            for field in dataclasses.fields(record):
                if field.name not in (*LABELS, "curve") and not field.name.endswith("_interval"):
                    for figure in _figures(record, field.name):
                        yield (*head, *figure)
    for comparison in report.comparisons:
        yield from _comparison_lines(comparison)


def _figures(record: Any, name: str) -> Iterator[Line]:
    """The figures of one field: quantity, value, low, high, method."""
    value = getattr(record, name)
    if isinstance(value, Share):
        yield from _share_figures(name, value)
    elif isinstance(value, Mapping):
        for key, share in value.items():
            yield from _share_figures(f"{name} {key}", share)
    elif isinstance(value, RunOf):
        yield f"{name}: run", value.run, None, None, None
        yield f"{name}: file", value.file, None, None, None
    elif isinstance(value, PerSecond):
        yield name, value.value, *(value.interval or (None, None)), None
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield f"{name}: {field.name}", getattr(value, field.name), None, None, None
    else:
        yield name, value, *(getattr(record, f"{name}_interval", None) or (None, None)), None


def _share_figures(name: str, share: Share) -> Iterator[Line]:
    """The figures of a share."""
    yield f"{name}: count", share.count, None, None, None
    yield f"{name}: total", share.total, None, None, None
    for method, rate in share.intervals.items():
        yield f"{name}: share", share.value, *_ends(rate), method


def _ends(rate: Rate) -> tuple[float | None, float | None]:
    """Its interval."""
    return rate.low, rate.high


def _comparison_lines(one: PairedComparison) -> Iterator[Line]:
    """The figures of a comparison."""
    head = (f"comparison of {one.event}", one.setting, one.agent, f"{one.first} : {one.second}")
    for name, count in one.pairs._asdict().items():
        yield (*head, f"pairs: {name}", count, None, None, None)
    methods = ("Nam-Blackwelder", "exact McNemar", "exact McNemar, Holm")
    if one.sequential:
        methods = ("confidence sequences", "martingale", "martingale, Holm")
    yield (*head, "ratio", one.ratio, *(one.interval or (None, None)), methods[0])
    yield (*head, "p", one.p, None, None, methods[1])
    yield (*head, "p", one.p_holm, None, None, methods[2])
