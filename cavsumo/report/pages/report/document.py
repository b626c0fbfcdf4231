"""The report as one page, with the pages of some replays beside it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from markupsafe import Markup

from cavsumo.batch.sentences import many
from cavsumo.batch.summary import percent
from cavsumo.report.analysis import Report
from cavsumo.report.cells import TOPICS, Table, number
from cavsumo.report.compare import WORDS, PairedComparison
from cavsumo.report.order import Tell, untold
from cavsumo.report.pages.report import words
from cavsumo.report.pages.report.archive import WORDS as BANDS
from cavsumo.report.pages.report.archive import Archive, archive
from cavsumo.report.pages.report.links import (
    LinkedRun,
    chosen,
    unshown,
    with_pages,
    write_pages,
)
from cavsumo.report.pages.report.places import MEANING, Map, maps
from cavsumo.report.pages.report.plots import (
    DASHES,
    MOST,
    ratio_bar,
    ratios_plot,
    share_bar,
    shares_plot,
    survival_plot,
)
from cavsumo.report.pages.report.scenes import BatchPlace, scenes
from cavsumo.report.pages.shell import render, write
from cavsumo.report.rates import Share
from cavsumo.report.tables import tables
from cavsumo.results.kaplan_meier import Curve

FILES = Path(__file__).parent
COUNTED = ("tests", "failures")  # in the titles of lists of runs
LINES = 30  # of a plot; the tables have all
TITLES = {
    "preventable": "Preventable failures, of tests",
    "failures": "Failed by the ego, of tests",
    "tests": "Tests found, of valid episodes",
    "unfair": "Unfair, of valid episodes",
}


class Plot(NamedTuple):
    """A plot with its title, its legend and a note on the parts left out.

    Attributes:
        legend: name, number of the colour and dashes of each line.
    """

    title: str
    svg: Markup
    legend: Sequence[tuple[str, int, str]] = ()
    note: str = ""


class WrittenPage(NamedTuple):
    """A page that was written.

    Attributes:
        files: names of what was written.
        problems: sentences that say which pages of replays cannot be made, and why; the page has
            them too.
    """

    files: Sequence[str]
    problems: Sequence[str]


def write_report(report: Report, file: Path, replays: int, tell: Tell = untold) -> WrittenPage:
    """Write the page, and beside it those of some replays; raises InputError.

    Args:
        replays: how many failures are shown as pages of their own; of the tests that the ego
            passed half as many.
    """
    tell("drawing plots and maps", "")
    played = scenes(report.evidence.batches)
    failures, tests = chosen(report, replays)
    failures = with_pages(failures, replays, report, played)
    tests = with_pages(tests, replays // 2, report, played)
    folder = file.parent / f"{file.stem}_replays"
    problems = unshown(failures, replays, report, played)
    problems += unshown(tests, replays // 2, report, played)
    problems = list(dict.fromkeys(problems))
    text = page(report, played, failures, tests, folder.name, problems)
    pages = write_pages([*failures, *tests], report.evidence.batches, played, folder, tell)
    write(text, file)
    written = [str(file), *([f"{folder}/ ({many(pages, 'page')})"] if pages else [])]
    return WrittenPage(written, problems)


def page(
    report: Report,
    played: Sequence[BatchPlace],
    failures: Sequence[LinkedRun],
    tests: Sequence[LinkedRun],
    folder: str,
    problems: Sequence[str],
) -> str:
    """The page, with links into a folder of replays, and with what is not in it."""
    found: dict[str, list[Table]] = {topic: [] for topic in TOPICS}
    for table in tables(report):
        found[table.topic].append(table)
    return render(
        FILES,
        "report",
        title=words.title(report),
        headline=words.headline(report),
        answers=words.answers(report),
        certainty=words.certainty(report),
        excluded=words.excluded(report),
        errors=words.errors(report),
        invalid=words.invalid(report),
        batches=list(words.told_batches(report)),
        tables=found,
        labels=[words.label(group, report.by) for group in report.groups],
        shares=list(_shares(report)),
        ratios=list(_ratios(report)),
        curves=list(_curves(report)),
        maps=[_drawn(one, report, [*failures, *tests]) for one in maps(report, played)],
        sorts=MEANING,
        archives=list(_archives(report, [*failures, *tests])),
        bands=BANDS,
        failures=failures,
        tests=tests,
        totals={what: sum(getattr(one, what).count for one in report.rates) for what in COUNTED},
        problems=problems,
        several=any(group.setting for group in report.groups),
        beside=quote(folder),
    )


def _archives(report: Report, looks: Sequence[LinkedRun]) -> Iterator[Archive]:
    """A map of what each search has explored."""
    runs = report.evidence.rows["run"]
    for one in report.explored:
        title = words.JOINT.join(word for word in (one.setting, one.agent, one.value) if word)
        yield archive(one, title, looks, runs)


def _shares(report: Report) -> Iterator[Plot]:
    """Interval bars of each kind of share, a line for each group, the leading failures first."""
    for what in (*report.events, "unfair"):
        bars = []
        for one in report.rates[:LINES]:
            share: Share = getattr(one, what)
            text = percent(share.value)
            bars.append(share_bar(words.label(one, report.by), share, text))
        if bars:
            yield _plot(TITLES[what], shares_plot, bars, len(report.rates))


def _ratios(report: Report) -> Iterator[Plot]:
    """Interval bars of the ratios of tests and of failures."""
    for what in report.events:
        found = [one for one in report.comparisons if one.event == what]
        bars = []
        for one in found[:LINES]:
            where = [word for word in (one.setting, one.agent) if word]
            name = words.JOINT.join((*where, f"{one.first or '(none)'} : {one.second or '(none)'}"))
            bars.append(ratio_bar(name, one, _ratio(one)))
        if bars:
            title = f"{WORDS.get(what, what).capitalize()}: how many times as often"
            yield _plot(title, ratios_plot, bars, len(found))


def _plot(
    title: str, draw: Callable[[Sequence[Any], str], str], bars: Sequence[Any], total: int
) -> Plot:
    """A plot of bars, with the number of those left out."""
    note = f"{total - len(bars)} more are in the table." if total > len(bars) else ""
    return Plot(title, Markup(draw(bars, title)), note=note)


def _ratio(one: PairedComparison) -> str:
    """The ratio beside its bar."""
    if one.ratio is None:
        return "none found"
    return number(one.ratio) if math.isfinite(one.ratio) else "∞"


def _curves(report: Report) -> Iterator[Plot]:
    """The curves of Kaplan and Meier, those of a setting together."""
    settings: dict[str, list[tuple[str, Curve]]] = {}
    for group, time in zip(report.groups, report.times, strict=True):
        if time.curve is not None:
            name = words.label(group, report.by)
            settings.setdefault(group.setting, []).append((name, time.curve))
    for setting, found in settings.items():
        shown = found[:MOST]
        svg = Markup(survival_plot([curve for _, curve in shown], f"times {setting}"))
        legend = [
            (name, i, " ".join(f"{2 * part:g}" for part in DASHES[i % len(DASHES)]))
            for i, (name, _) in enumerate(shown)
        ]
        more = len(found) - len(shown)
        yield Plot(setting, svg, legend, f"{more} more are in the table." if more else "")


def _drawn(one: Map, report: Report, looks: Sequence[LinkedRun]) -> dict[str, Any]:
    """A map for the template: every dot with its words and, for a single run, its page."""
    pages = {look.index: look.page for look in looks}
    rows = report.evidence.rows
    dots = []
    for dot in one.dots:
        who = words.label(report.groups[dot.group], report.by)
        many = f"run {rows['run'][dot.run]}" if dot.many == 1 else f"{dot.many} tests"
        radius = round(one.radius * min(4.0, dot.many**0.5), 2)
        single = pages.get(dot.run, "") if dot.many == 1 else ""
        dots.append((dot, radius, f"{who}, {many}: {MEANING[dot.sort]}", single))
    return {"map": one, "dots": dots, "wide": round(600 * one.width / one.height)}
