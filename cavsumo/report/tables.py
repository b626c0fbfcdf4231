"""A report as tables of text, which any format can print."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from cavsumo.batch.sentences import many
from cavsumo.batch.summary import interval, percent
from cavsumo.egos.reference import IDEAL
from cavsumo.report.analysis import Report
from cavsumo.report.cells import Labels, Table, number, p_value, span
from cavsumo.report.compare import WORDS, PairedComparison
from cavsumo.report.driving import EgoDriving
from cavsumo.report.effort import Effort, PerSecond
from cavsumo.report.load import Batch
from cavsumo.report.rates import EXACT, SEQUENTIAL, WILSON, Rates, Share
from cavsumo.report.survival import RunOf
from cavsumo.report.tables_of_cells import distinct_table, failures_table
from cavsumo.results.kaplan_meier import median_in_words


def tables(report: Report) -> Iterator[Table]:
    """All tables with at least one row."""
    labels = Labels(report)
    yield _batches(report.evidence.batches, report)
    if not report.groups:
        return
    yield _rates(report.rates, labels)
    yield _driving(report.driving, labels)
    if any(one.blame for one in report.rates):
        yield _blame(report.rates, labels)
    yield from _comparisons(report, labels)
    yield _times(report, labels)
    yield _effort(report, labels)
    yield distinct_table(report, labels)
    if report.failures:
        yield failures_table(report)


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
    methods = _methods(found)
    rows = []
    for one in found:
        judged = f"preventable ({one.reference})"
        shares = {judged: one.preventable} if one.reference else {"failures": one.failures}
        shares |= {"tests": one.tests}
        shares |= {"unpreventable": one.unpreventable} if one.reference else {}
        shares |= {f"preventable ({IDEAL} only)": one.by_ideal} if one.by_ideal else {}
        for what, share in (shares | {"unfair": one.unfair}).items():
            rows.append([*labels.cells(one), what, *_share(share, methods)])
        not_judged = one.not_judged if one.reference else 0
        for what, count, of in (
            ("not judged", not_judged, many(one.failures.count, "failure")),
            ("invalid", one.invalid, many(one.episodes, "episode")),
            ("errors", one.errors, many(one.episodes, "episode")),
        ):
            if count:
                cells = [what, str(count), f"of {of}", "", *("" for _ in methods)]
                rows.append([*labels.cells(one), *cells])
    titles = ("count", "", "share", *methods)
    words = (*labels.titles, "of what")
    return Table(
        "shares", "Shares, with 95 % intervals in %", words, titles, rows, heads=len(words) - 1
    )


def _driving(found: Sequence[EgoDriving], labels: Labels) -> Table:
    """How the ego came along."""
    rows = [
        [
            *labels.cells(one),
            f"{one.arrived} of {one.could_arrive}",
            "" if one.lost_s is None else f"{one.lost_s:.1f}",
            "" if one.stood_s is None else f"{one.stood_s:.1f}",
            str(one.stood_still),
            str(one.crawled),
        ]
        for one in found
    ]
    numbers = ("arrived", "lost [s]", "stood [s]", "stood still", "crawled")
    notes = [
        "Arrived: of the episodes that no verdict ended. Lost: mean time against a free drive on "
        "an empty road. Stood still: 10 s or longer when the episode ended; crawled: more than "
        "four times as long as the free drive while it moved.",
        *dict.fromkeys(one.warning for one in found if one.warning),
    ]
    return Table("shares", "How the ego came along", labels.titles, numbers, rows, notes)


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
    for event in report.events:
        found = [c for c in report.comparisons if c.event == event]
        if found:
            rows = [_comparison(one, words) for one in found]
            title = f"{WORDS.get(event, event).capitalize()} on the same seeds"
            notes = _comparison_notes(report) if event == "tests" else ()
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


def _comparison_notes(report: Report) -> list[str]:
    """By which methods."""
    methods, found = [], report.comparisons
    what = WORDS.get(report.events[0], report.events[0])
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
    return [*methods, f"Holm: adjusted for all {len(found)} comparisons, of {what} and tests."]


def _times(report: Report, labels: Labels) -> Table:
    """When tests come."""
    found, several = report.times, len(report.evidence.batches) > 1
    failure = "preventable" if report.events[0] == "preventable" else "failure"
    limit = next((one.limit for one in found if one.limit is not None), None)
    mean = "mean" if limit is None else f"mean to {limit:.1f}"
    rows = [
        [
            *labels.cells(one),
            str(one.censored),
            median_in_words(one.curve),
            span(one.median_interval, ".1f"),
            "" if one.mean is None else f"{one.mean:.1f}",
            span(one.mean_interval, ".1f"),
            *(_run(first, several) for first in (getattr(one, f"first_{failure}"), one.first_test)),
        ]
        for one in found
    ]
    numbers = ("censored", "median", "95 %", mean, "95 %", f"1st {failure}", "1st test")
    notes = [
        "Seconds by Kaplan and Meier. Episodes without a test are censored at their end, unfair "
        "ones too: a tester that came too early shows only that there was no test so far.",
        f"1st {failure}, 1st test: the run, as cavsumo replay takes it.",
    ]
    return Table(
        "times", "Time to the test, within an episode [s]", labels.titles, numbers, rows, notes
    )


def _run(first: RunOf | None, several: bool) -> str:
    """A run by its number, with its file where there are several."""
    if first is None:
        return "none"
    return f"{first.file} {first.run}" if several else str(first.run)


def _effort(report: Report, labels: Labels) -> Table:
    """The rates of tests and failures per second."""
    rows = []
    for rate, one in zip(report.rates, report.efforts, strict=True):
        for what in report.events:
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
