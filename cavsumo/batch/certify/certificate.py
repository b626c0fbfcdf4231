"""Bounds on the probability that a test triggers, jointly valid for all listed egos.

The tests among n episodes with fresh seeds are binomial, so Clopper and Pearson's lower bound
holds with the confidence that is asked for. Of m egos each has its bound at level alpha / m
(Bonferroni), so that all m hold at once with confidence 1 - alpha, and so does the least of them.
Unfair, invalid and error episodes count as not triggered.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from cavsumo.batch.ended import Ended
from cavsumo.batch.tally import Found
from cavsumo.results.reading import rows_of
from cavsumo.results.statistics import lower_bound

# Columns in which even equal episodes differ.
NAMES_ONLY = ("run", "seed", "trace", "wall_s")


@dataclass(frozen=True)
class Guarantee:
    """The bounds against one ego.

    Attributes:
        label, ego, params: which.
        found: the counts of its episodes.
        triggered, violated: lower bounds on the probability that an episode is a test, and that the
            ego fails it.
        alike: all episodes have equal results.
    """

    label: str
    ego: str
    params: Mapping[str, Any]
    found: Found
    triggered: float
    violated: float
    alike: bool


@dataclass(frozen=True)
class TriggerCertificate:
    """The bounds against all egos jointly, each of the two with the confidence.

    Attributes:
        guarantees: ego by ego.
        confidence: of all bounds on triggering together, and of all on violation together.
    """

    guarantees: Sequence[Guarantee]
    confidence: float

    @property
    def triggered(self) -> float:
        """The least bound on triggering."""
        return min(one.triggered for one in self.guarantees)

    @property
    def violated(self) -> float:
        """The least bound on violation."""
        return min(one.violated for one in self.guarantees)


def certified(
    ended: Sequence[Ended], egos: Mapping[str, tuple[str, Mapping[str, Any]]], confidence: float
) -> TriggerCertificate:
    """The certificate of batches, one for each ego, by its label."""
    level = 1.0 - (1.0 - confidence) / len(ended)

    def guarantee(one: Ended, label: str) -> Guarantee:
        found, (ego, params) = one.tally.all, egos[label]
        n = found.episodes
        tests, failures = (lower_bound(k, n, level) for k in (found.tests, found.failures))
        return Guarantee(label, ego, params, found, tests, failures, _alike(one.csv_file))

    guarantees = [guarantee(one, label) for one, label in zip(ended, egos, strict=True)]
    return TriggerCertificate(guarantees, confidence)


def _alike(csv_file: Path) -> bool:
    """Whether all episodes have equal results."""
    rows = ([v for k, v in row.items() if k not in NAMES_ONLY] for row in rows_of(csv_file))
    first = next(rows, None)
    return first is not None and all(row == first for row in rows)


def as_json(found: TriggerCertificate) -> dict[str, Any]:
    """The certificate in full precision (docs/guide.md)."""
    return {
        "confidence": found.confidence,
        "triggered_at_least": found.triggered,
        "violated_at_least": found.violated,
        "egos": [
            {
                "label": one.label,
                "ego": one.ego,
                "params": dict(one.params),
                "runs": one.found.episodes,
                "tests": one.found.tests,
                "failures": one.found.failures,
                "unfair": one.found.unfair,
                "invalid": one.found.invalid,
                "errors": one.found.errors,
                "triggered_at_least": one.triggered,
                "violated_at_least": one.violated,
                "all_alike": one.alike,
            }
            for one in found.guarantees
        ],
    }


def as_table(found: TriggerCertificate) -> Table:
    """One line per ego, and the least of all."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("ego", overflow="fold")
    for title in ("runs", "tests", "at least", "failures", "at least"):
        table.add_column(title, justify="right", no_wrap=True)
    for title in ("unfair", "invalid", "errors"):
        table.add_column(title, justify="right", no_wrap=True)
    for one in found.guarantees:
        counts = one.found
        table.add_row(
            described(one.label, one.ego, one.params),
            str(counts.episodes),
            str(counts.tests),
            rounded_down(one.triggered),
            str(counts.failures),
            rounded_down(one.violated),
            *map(str, (counts.unfair, counts.invalid, counts.errors)),
        )
    least = rounded_down(found.triggered), rounded_down(found.violated)
    table.add_row("least of all", "", "", least[0], "", least[1])
    return table


def described(label: str, ego: str, params: Mapping[str, Any]) -> str:
    """An ego in words: its label, its name, its parameters."""
    head = label if label == ego else f"{label}={ego}"
    return " ".join((head, *(f"{key}={value}" for key, value in params.items())))


def sentences(found: TriggerCertificate) -> list[str]:
    """The statement of the certificate, and its limits."""
    many = len(found.guarantees)
    against = "against this ego" if many == 1 else f"against each of these {many} egos"
    said = [
        f"With {100 * found.confidence:g} % confidence an episode is a test with probability at "
        f"least {rounded_down(found.triggered)}, {against}; it holds for no other ego."
    ]
    for one in found.guarantees:
        if one.alike and one.found.episodes > 1:
            said.append(
                f"{one.label}: all {one.found.episodes} episodes came out the same: chance decides "
                "nothing in them."
            )
    return said


def rounded_down(bound: float) -> str:
    """A lower bound rounded down to four decimals."""
    return f"{math.floor(bound * 1e4) / 1e4:.4f}"
