"""Sentences about what was found: preventable failures first, and how the ego came along."""

from __future__ import annotations

from cavsumo.batch.searching import SearchFacts
from cavsumo.batch.tally import Found, Row
from cavsumo.egos.reference import IDEAL, REFERENCES
from cavsumo.results.failures import NOT_JUDGED, UNPREVENTABLE
from cavsumo.results.rows import cell, is_failure
from cavsumo.results.statistics import rate


def many(count: int, what: str) -> str:
    """So many of them, in the singular or the plural."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def driver(reference: str) -> str:
    """A reference driver in words."""
    return REFERENCES.make(reference, {}).words if reference in REFERENCES else reference


def failures(found: Found, judged: bool) -> str:
    """The failures that lead: the preventable ones, or all where nobody judged."""
    return (
        many(found.preventable, "preventable failure")
        if judged
        else many(found.failures, "failure")
    )


def judgement(found: Found, reference: str) -> str:
    """The driver that would have prevented failures, and the others apart; empty without any."""
    if not found.failures:
        return ""
    said = f"{many(found.preventable, 'failure')} preventable by {driver(reference)}"
    ideal = by_ideal(found, reference)
    return f"{said}{others(found.unpreventable, found.not_judged, ideal)}"


def by_ideal(found: Found, reference: str) -> int | None:
    """How many failures an ideal driver would have avoided and the reference driver would not.

    None where that was not judged, or the reference is the ideal driver.
    """
    asked = found.ideal.total() > 0 and reference != IDEAL
    return found.ideal[True] if asked else None


def others(unpreventable: int, not_judged: int, ideal: int | None) -> str:
    """The failures that are not preventable, as the end of a sentence; empty without any.

    ``ideal``: ``by_ideal``.
    """
    kinds = ((unpreventable, UNPREVENTABLE), (not_judged, NOT_JUDGED))
    apart = ", ".join(f"{count} {kind}" for count, kind in kinds if count)
    said = f"; apart from that {apart}" if apart else ""
    return said if ideal is None else f"{said}; {driver(IDEAL)} would have avoided {ideal} more"


def exit_reason(found: Found, judged: bool) -> str:
    """Why the exit status is 1: an assertion was violated, preventably or not."""
    if not judged:
        return f"the ego violated an assertion in {many(found.failures, 'episode')}"
    said = f"the ego violated an assertion, preventably in {many(found.preventable, 'episode')}"
    rest = found.failures - found.preventable
    return f"{said}, otherwise in {rest}" if rest else said


def searched(found: SearchFacts) -> str:
    """The findings of a search, or how much of the space it has seen without finding anything."""
    whole = f"{many(found.episodes, 'episode')} and {found.seconds:.0f} simulated seconds"
    if found.first is None:
        bound = rate(0, found.uniform, "exact").high if found.uniform else None
        said = f"no preventable failure in {whole}; {found.covered:.0%} of the cells of its space"
        if bound is None:
            return said
        return (
            f"{said}; of the {many(found.uniform, 'point')} drawn at random none failed, so at "
            f"most {bound:.1%} of the space does (95 %)"
        )
    (episodes, seconds), failed = found.first, many(found.failures, "preventable failure")
    return (
        f"{failed}, {found.distinct} distinct, in {whole}; the "
        f"first after {many(episodes, 'episode')} and {seconds:.0f} s; in common: {found.words}"
    )


def drive(found: Found) -> str:
    """How much time the ego lost, and how often it arrived; empty where nothing was measured."""
    if not found.compared:
        return ""
    lost = f"the ego lost {found.lost_s / found.compared:.1f} s an episode against a free drive"
    whole = found.arrivals.total()
    if not whole:
        return f"{lost}; every episode ended with a verdict before it could arrive"
    return (
        f"{lost}; it arrived in {found.arrivals[True]} of the {many(whole, 'episode')} that no "
        "verdict ended"
    )


def frozen(found: Found) -> str:
    """That the ego stood still or crawled, and what that means; empty if it never did."""
    words = {"stood": "stood still at the end of", "crawled": "crawled in"}
    said = [f"{words[how]} {found.frozen[how]}" for how in words if found.frozen[how]]
    if not said:
        return ""
    return (
        f"frozen: the ego {' and '.join(said)} of {many(found.valid, 'valid episode')}; "
        "that is not safe driving, it was hardly tested"
    )


def event(row: Row) -> str:
    """The event of a test, with its time and body."""
    violated = is_failure(row)
    when = float(row["violation_time_s"] if violated else row["trigger_time_s"])
    hit = violated and cell(row["impact_speed_mps"])
    what = "collision" if hit else f"{row['assertion']} {'violated' if violated else 'triggered'}"
    tester = f" with {row['tester']}" if row["tester"] else ""
    return f"{what} at {when:.1f} s{tester}"
