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
from cavsumo.model.scenario import NO_REFERENCE
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
        triggered, prevented, violated: lower bounds on the probability that an episode is a test,
            that the ego fails it preventably, and that it fails it at all.
        alike: all episodes have equal results.
    """

    label: str
    ego: str
    params: Mapping[str, Any]
    found: Found
    triggered: float
    prevented: float
    violated: float
    alike: bool


@dataclass(frozen=True)
class TriggerCertificate:
    """The bounds against all egos jointly, each of the three with the confidence.

    Attributes:
        guarantees: ego by ego.
        confidence: of all bounds on triggering together, of all on preventable violation, and of
            all on violation.
        reference: the reference driver that judged the failures; "none" for nobody.
    """

    guarantees: Sequence[Guarantee]
    confidence: float
    reference: str

    @property
    def triggered(self) -> float:
        """The least bound on triggering."""
        return min(one.triggered for one in self.guarantees)

    @property
    def prevented(self) -> float:
        """The least bound on preventable violation."""
        return min(one.prevented for one in self.guarantees)

    @property
    def judged(self) -> bool:
        """Whether a reference driver judged the failures."""
        return self.reference != NO_REFERENCE

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
        return Guarantee(
            label,
            ego,
            params,
            found,
            triggered=lower_bound(found.tests, n, level),
            prevented=lower_bound(found.preventable, n, level),
            violated=lower_bound(found.failures, n, level),
            alike=_alike(one.csv_file),
        )

    guarantees = [guarantee(one, label) for one, label in zip(ended, egos, strict=True)]
    return TriggerCertificate(guarantees, confidence, ended[0].reference)


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
        "preventable_at_least": found.prevented if found.judged else None,
        "violated_at_least": found.violated,
        "reference": found.reference,
        "egos": [
            {
                "label": one.label,
                "ego": one.ego,
                "params": dict(one.params),
                "runs": one.found.episodes,
                "tests": one.found.tests,
                "preventable": one.found.preventable if found.judged else None,
                "failures": one.found.failures,
                "unfair": one.found.unfair,
                "invalid": one.found.invalid,
                "errors": one.found.errors,
                "triggered_at_least": one.triggered,
                "preventable_at_least": one.prevented if found.judged else None,
                "violated_at_least": one.violated,
                "all_alike": one.alike,
            }
            for one in found.guarantees
        ],
    }


def as_table(found: TriggerCertificate) -> Table:
    """One line per ego, and the least of all; preventable failures first, if they were judged."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("ego", overflow="fold")
    judged = ("preventable", "at least") if found.judged else ()
    counted = ("runs", "tests", "at least", *judged, "failures", "at least")
    for title in (*counted, "unfair", "invalid", "errors"):
        table.add_column(title, justify="right", no_wrap=True)
    for one in found.guarantees:
        counts = one.found
        table.add_row(
            described(one.label, one.ego, one.params),
            str(counts.episodes),
            str(counts.tests),
            rounded_down(one.triggered),
            *((str(counts.preventable), rounded_down(one.prevented)) if judged else ()),
            str(counts.failures),
            rounded_down(one.violated),
            *map(str, (counts.unfair, counts.invalid, counts.errors)),
        )
    prevented = ("", rounded_down(found.prevented)) if judged else ()
    least = "", "", rounded_down(found.triggered), *prevented, "", rounded_down(found.violated)
    table.add_row("least of all", *least)
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
    failed = any(one.found.failures for one in found.guarantees)
    if failed and not found.judged:
        said.append(
            "No reference driver judged the failures, as none did in these results: nobody may "
            "have been able to prevent them."
        )
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
