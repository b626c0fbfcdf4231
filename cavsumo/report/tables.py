"""A report as tables of text, which any format can print."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from cavsumo.batch.summary import interval, percent
from cavsumo.report.analysis import Report
from cavsumo.report.cells import Labels, Table, number, p_value, span
from cavsumo.report.compare import EVENTS, PairedComparison
from cavsumo.report.distinct import PLACE_BIN, SPEED_BIN, Distinct, Diversity, FailureCell
from cavsumo.report.effort import Effort, PerSecond
from cavsumo.report.load import Batch
from cavsumo.report.rates import EXACT, SEQUENTIAL, WILSON, Rates, Share
from cavsumo.report.survival import TimeToTest

SHOWN = 10  # cells of failures


def tables(report: Report) -> Iterator[Table]:
    """All tables with at least one row."""
    labels = Labels(report)
    yield _batches(report.evidence.batches, report)
    if not report.groups:
        return
    yield _rates(report.rates, labels)
    if any(one.blame for one in report.rates):
        yield _blame(report.rates, labels)
    yield from _comparisons(report, labels)
    yield _times(report.times, labels)
    yield _effort(report, labels)
    yield _distinct(report.distinct, labels)
    if report.failures:
        yield _failures(report.failures, len(report.evidence.batches) > 1)


def _batches(batches: Sequence[Batch], report: Report) -> Table:
    """The files that were read."""
    counts = report.evidence.rows["batch"].value_counts()
    rows = []
    for i, batch in enumerate(batches):
        scenario, status = batch.plan.scenario, batch.manifest.get("status", "")
        testers = f"{scenario.testers} x {scenario.kind}"
        episodes = f"{int(counts.get(i, 0))} of {batch.plan.size}"
        cells = [str(batch.csv_file), scenario.name, testers, scenario.ego, str(status)]
        rows.append([*cells, str(batch.plan.seed), episodes])
    words = ("results", "network", "testers", "ego", "status")
    return Table(
        "results", "Results", words, ("seed", "episodes"), rows, list(_batch_notes(batches))
    )


def _batch_notes(batches: Sequence[Batch]) -> Iterator[str]:
    """Notes on special batches."""
    for batch in batches:
        if batch.sequential:
            reason = batch.manifest.get("stopped_by")
            why = f"was stopped: {reason}" if reason else "could have been stopped by what it found"
            yield (
                f"{batch.csv_file} {why}. Its intervals of rates and ratios and its p-values hold "
                "whenever one stops; times, figures per second and numbers of cells do not allow "
                "for it."
            )
        elif batch.unfinished:
            yield (
                f"{batch.csv_file} is unfinished: the figures hold as long as it was not stopped "
                "for what it had found."
            )


def _rates(found: Sequence[Rates], labels: Labels) -> Table:
    """Shares with intervals."""
    kinds = ("tests", "failures", "unfair", "preventable")
    methods = _methods(found)
    rows = []
    for one in found:
        for what in kinds:
            share: Share = getattr(one, what)
            if what == "preventable" and not share.total:
                continue
            name = f"{what} ({one.reference})" if what == "preventable" else what
            rows.append([*labels.cells(one), name, *_share(share, methods)])
        for what, count in (("invalid", one.invalid), ("errors", one.errors)):
            if not count:
                continue
            cells = [what, str(count), f"of {one.episodes} episodes", ""]
            rows.append([*labels.cells(one), *cells, *("" for _ in methods)])
    titles = ("count", "", "share", *methods)
    words = (*labels.titles, "of what")
    return Table(
        "shares", "Shares, with 95 % intervals in %", words, titles, rows, heads=len(words) - 1
    )


def _blame(found: Sequence[Rates], labels: Labels) -> Table:
    """The rules broken first in failures."""
    methods = _methods(found)
    rows = [
        [*labels.cells(one), rule, *_share(share, methods)]
        for one in found
        for rule, share in one.blame.items()
    ]
    titles, words = ("count", "", "share", *methods), (*labels.titles, "party:rule")
    notes = ["A hint by rules, not law: which party broke which rule of the road first."]
    title = "Blame for failures, with 95 % intervals in %"
    return Table("shares", title, words, titles, rows, notes, heads=len(words) - 1)


def _methods(found: Sequence[Rates]) -> list[str]:
    """The methods of the intervals."""
    used = {method for one in found for method in one.tests.intervals}
    return [method for method in (WILSON, EXACT, SEQUENTIAL) if method in used]


def _share(share: Share, methods: Sequence[str]) -> list[str]:
    """The cells of a share."""
    spans = [interval(share.intervals[m]) if m in share.intervals else "" for m in methods]
    return [str(share.count), f"of {share.total} {share.of}", percent(share.value), *spans]


def _comparisons(report: Report, labels: Labels) -> Iterator[Table]:
    """The comparisons on the same seeds."""
    words = [title for title in labels.titles if title == "setting"]
    words += ["agent"] if report.by != "agent" else []
    numbers = ("pairs", "only first", "only second", "ratio", "95 % interval", "p", "p (Holm)")
    for event in EVENTS:
        found = [c for c in report.comparisons if c.event == event]
        if found:
            rows = [_comparison(one, words) for one in found]
            title = f"{event.capitalize()} on the same seeds"
            notes = () if event == "tests" else _comparison_notes(report.comparisons)
            yield Table("pairs", title, (*words, "first : second"), numbers, rows, notes)


def _comparison(one: PairedComparison, words: Sequence[str]) -> list[str]:
    """One row of the comparison table."""
    who = [getattr(one, word) for word in words]
    return [
        *who,
        f"{one.first or '(none)'} : {one.second or '(none)'}",
        str(one.pairs.total),
        str(one.pairs.first),
        str(one.pairs.second),
        "" if one.ratio is None else number(one.ratio),
        span(one.interval),
        p_value(one.p),
        p_value(one.p_holm),
    ]


def _comparison_notes(found: Sequence[PairedComparison]) -> list[str]:
    """The methods of the comparisons."""
    methods = []
    if any(not one.sequential for one in found):
        methods.append(
            "Ratio of the first's rate per valid episode to the second's with the score interval "
            "for pairs (Nam and Blackwelder); p: exact McNemar test."
        )
    if any(one.sequential for one in found):
        methods.append(
            "After stopping: ratio with the interval from both rates' confidence sequences, p of "
            "McNemar's hypothesis by the same martingale."
        )
    return [*methods, f"Holm: adjusted for all {len(found)} comparisons, of tests and failures."]


def _times(found: Sequence[TimeToTest], labels: Labels) -> Table:
    """The times of tests."""
    limit = next((one.limit for one in found if one.limit is not None), None)
    mean = "mean" if limit is None else f"mean to {limit:.1f}"
    rows = [
        [
            *labels.cells(one),
            str(one.censored),
            "" if one.median is None else f"{one.median:.1f}",
            span(one.median_interval, ".1f"),
            "" if one.mean is None else f"{one.mean:.1f}",
            span(one.mean_interval, ".1f"),
            *("none" if n is None else str(n) for n in (one.first_test, one.first_failure)),
        ]
        for one in found
    ]
    numbers = ("censored", "median", "95 %", mean, "95 %", "1st test", "1st failure")
    notes = [
        "Seconds by Kaplan and Meier. Episodes without a test are censored at their end, unfair "
        "ones too: a tester that came too early shows only that there was no test so far.",
        "1st test, 1st failure: in which valid episode.",
    ]
    return Table(
        "times", "Time to the test, within an episode [s]", labels.titles, numbers, rows, notes
    )


def _effort(report: Report, labels: Labels) -> Table:
    """The rates of tests and failures per second."""
    rows = []
    for rate, one in zip(report.rates, report.efforts, strict=True):
        for what in EVENTS:
            simulated: PerSecond = getattr(one, f"{what}_simulated")
            real: PerSecond = getattr(one, f"{what}_real")
            count: Share = getattr(rate, what)
            cells = [*labels.cells(one), what, str(count.count)]
            rows.append([*cells, *_effort_cells(simulated), *_effort_cells(real)])
    numbers = ("count", "per simulated s", "95 % interval", "per CPU s", "95 % interval")
    notes = [f"{_total(report.efforts)} CPU s: real time of the processes that played."]
    words = (*labels.titles, "")
    return Table("effort", "Found per second", words, numbers, rows, notes, heads=len(words) - 1)


def _effort_cells(found: PerSecond) -> list[str]:
    """A figure per second with its interval."""
    return ["" if found.value is None else number(found.value), span(found.interval)]


def _total(efforts: Sequence[Effort]) -> str:
    """The total times."""
    simulated, real = sum(e.simulated_s for e in efforts), sum(e.real_s for e in efforts)
    return f"{simulated:,.0f} s were simulated in {real:,.1f}"


def _distinct(found: Sequence[Distinct], labels: Labels) -> Table:
    """The numbers of distinct tests and failures."""
    rows = []
    for one in found:
        for what in EVENTS:
            diversity: Diversity = getattr(one, what)
            rows.append([*labels.cells(one), what, *_diversity_cells(diversity)])
    numbers = ("count", "cell known", "distinct", "estimated", "next is new")
    notes = [
        f"A cell: closing speed in steps of {SPEED_BIN:g} m/s, side of the ego, its way so far in "
        f"steps of {PLACE_BIN:g} m, kind of tester; of tests at the trigger, of failures at the "
        "impact.",
        "Estimated: all cells there are, met or not, at least (Chao); next is new: by Good and "
        "Turing.",
    ]
    missing = sum(d.total - d.known for one in found for d in (one.tests, one.failures))
    if missing:
        notes.append("Where no trace was kept the cell is not known.")
    words = (*labels.titles, "")
    return Table(
        "distinct", "How many are distinct", words, numbers, rows, notes, heads=len(words) - 1
    )


def _diversity_cells(diversity: Diversity) -> list[str]:
    """The numbers of distinct tests and failures of one group."""
    estimate = "" if diversity.estimate is None else f"{diversity.estimate:.0f}"
    counts = [diversity.total, diversity.known, diversity.cells]
    return [*map(str, counts), estimate, percent(diversity.new)]


def _failures(found: Sequence[FailureCell], several: bool) -> Table:
    """The most frequent cells of failures, each with an example."""
    rows = []
    settings = any(one.cell.setting for one in found)
    for one in found[:SHOWN]:
        cell = one.cell
        run = f"{one.file} {one.run}" if several else str(one.run)
        speed = f"{cell.speed:g} to {cell.speed + SPEED_BIN:g}"
        place = f"{cell.place:g} to {cell.place + PLACE_BIN:g}"
        words = [cell.kind, cell.side, ", ".join(one.agents)]
        words = [cell.setting, *words] if settings else words
        rows.append([*words, speed, place, str(one.count), run])
    words = ["tester", "hit on", "found by"]
    notes = []
    if len(found) > SHOWN:
        rest = sum(one.count for one in found[SHOWN:])
        notes.append(f"{rest} failures in {len(found) - SHOWN} more cells are not shown.")
    notes.append(f"To see one: cavsumo replay {'RESULTS' if several else found[0].file} RUN")
    numbers = ("at [m/s]", "after [m]", "failures", "run")
    words = ["setting", *words] if settings else words
    return Table(
        "distinct", "Failures by cell, the most frequent first", words, numbers, rows, notes
    )
