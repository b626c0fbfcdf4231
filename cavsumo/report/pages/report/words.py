"""The sentences of the page: the answer, its certainty, the tested scenario."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence

from cavsumo.batch.sentences import driver, others
from cavsumo.batch.summary import interval, percent
from cavsumo.errors import CavsumoError
from cavsumo.model.scenario import Scenario
from cavsumo.report.analysis import Report
from cavsumo.report.grouping import Told
from cavsumo.report.load import Batch
from cavsumo.report.pages.replay.facts import ego_words, traffic_words
from cavsumo.report.rates import SEQUENTIAL, Rates, Share

ANSWERS = 12  # groups that are told in a sentence each
ERRORS = 5  # messages that are quoted
BATCHES = 6  # results that are told in full
JOINT = " · "  # between a file, an agent and a value in a name
Facts = list[tuple[str, str]]


def title(report: Report) -> str:
    """The page's title: which networks."""
    names = list(dict.fromkeys(batch.plan.scenario.name for batch in report.evidence.batches))
    shown = names if len(names) <= 3 else [*names[:2], f"{len(names) - 2} more"]
    return "Report: " + _listed(shown)


def headline(report: Report) -> str:
    """The ego, the testers and the scenario, in a line."""
    batches = report.evidence.batches
    egos = list(dict.fromkeys(_ego(batch.plan.scenario) for batch in batches))
    testers = list(dict.fromkeys(_testers(batch.plan.scenario) for batch in batches))
    seeds = list(dict.fromkeys(str(batch.plan.seed) for batch in batches))
    ego = egos[0] if len(egos) == 1 else f"{len(egos)} egos"
    seed = f"seed {seeds[0]}" if len(seeds) == 1 else f"{len(seeds)} seeds"
    episodes = _many(len(report.evidence.rows), "episode")
    return f"Ego: {ego}. Testers: {_listed(testers[:3])}. {episodes}, {seed}."


def label(told: Told, by: str) -> str:
    """A group in a word or two."""
    words = [told.agent] if by == "agent" else [told.agent, f"{by} {told.value or '(none)'}"]
    return JOINT.join([*([told.setting] if told.setting else []), *words])


def _who(told: Told, by: str) -> str:
    """A group as the subject of a sentence."""
    return label(told, by).replace(JOINT, ": ", 1) if told.setting else label(told, by)


def answers(report: Report) -> list[str]:
    """The results of each group, the answer first."""
    found = [answer(one, _who(one, report.by)) for one in report.rates[:ANSWERS]]
    if len(report.rates) > ANSWERS:
        found.append(f"{len(report.rates) - ANSWERS} more groups are in the table.")
    for drive in report.driving[:ANSWERS]:
        if drive.warning:
            found.append(f"{_who(drive, report.by)}: {drive.warning}.")
    return found or ["The results hold no episodes yet."]


def answer(one: Rates, who: str) -> str:
    """The results of a group, as a sentence."""
    tests, failures = one.tests, one.preventable if one.reference else one.failures
    if not tests.total:
        return f"{who} played no valid episode."
    if not tests.count:
        return f"{who} found no test in {_many(tests.total, 'episode')}, {_share(tests)}."
    found = f"{who} found {_many(tests.count, 'test')} in {_many(tests.total, 'episode')}"
    found += f", {_share(tests)}"
    if one.reference and one.failures.count:
        return f"{found}; {_many(failures.count, 'failure')}, {_share(failures)}, {_judged(one)}."
    if not failures.count:
        passed = "it" if tests.count == 1 else "all of them"
        return f"{found}; the ego passed {passed}: it failed {_share(failures)}."
    of = "it" if tests.count == 1 else f"{failures.count} of them"
    return f"{found}; the ego failed {of}, {_share(failures)}."


def _judged(one: Rates) -> str:
    """The driver that would have prevented the failures, and apart from them the others."""
    ideal = one.by_ideal.count if one.by_ideal else None
    rest = others(one.unpreventable.count, one.not_judged, ideal)
    return f"preventable by {driver(one.reference)}{rest}"


def certainty(report: Report) -> str:
    """The kinds of the intervals."""
    methods = {name for one in report.rates for name in one.tests.intervals}
    if not methods:
        return ""
    how = "In brackets: 95 % intervals in per cent"
    if methods == {SEQUENTIAL}:
        return f"{how}, as confidence sequences, which are valid at any stopping time."
    if SEQUENTIAL in methods:
        return (
            f"{how}, by Wilson; confidence sequences for batches that could stop on what they "
            "found."
        )
    return f"{how}, by Wilson."


def excluded(report: Report) -> str:
    """Unfair, invalid and error episodes."""
    unfair = sum(one.unfair.count for one in report.rates)
    invalid = sum(one.invalid for one in report.rates)
    missing = sum(one.errors for one in report.rates)
    episodes = sum(one.episodes for one in report.rates)
    said = "No episode was unfair" if not unfair else f"{_many(unfair, 'episode')} of {episodes} "
    if unfair:
        said += "were unfair: " if unfair > 1 else "was unfair: "
        said += "the ego could not have stopped, so they count as episodes but not as tests"
    if invalid:
        said += f". {invalid} invalid: a tester broke the rules of the world, so they are left out"
    if missing:
        return f"{said}. {missing} could not be played (errors) and are left out."
    return f"{said}. Every episode could be played."


def errors(report: Report) -> list[str]:
    """The first messages of episodes that could not be played."""
    return _first(report, "error", "error")


def invalid(report: Report) -> list[str]:
    """The first breaches of the rules of the world that made an episode invalid."""
    return _first(report, "invalid", "breach")


def _first(report: Report, outcome: str, column: str) -> list[str]:
    """A column of the first episodes with an outcome."""
    rows = report.evidence.rows
    found = rows[rows["outcome"] == outcome].head(ERRORS).to_dict("records")
    return [f"{row['file']} run {row['run']}: {row[column]}" for row in found]


def facts(batch: Batch, episodes: int) -> Facts:
    """The scenario and versions of a batch."""
    plan, manifest, scenario = batch.plan, batch.manifest, batch.plan.scenario
    found = [
        ("Network", str(scenario.net)),
        ("Junction", str(manifest.get("junction") or scenario.junction or "")),
        ("Traffic", traffic_words(scenario)),
        ("Ego", _ego(scenario)),
        ("Tester agents", ", ".join(plan.agents)),
        ("Parameters", " ".join(f"{k}={v}" for k, v in plan.params.items())),
        ("Testers", _testers(scenario)),
        ("Asserted", ", ".join(scenario.assertions)),
        ("Episodes", f"{episodes} of {plan.size}, {manifest.get('status', '')}"),
        ("Seed of the batch", str(plan.seed)),
        ("Versions", _pairs(manifest.get("versions"))),
    ]
    return [(term, text) for term, text in found if text]


def told_batches(report: Report) -> Iterator[tuple[str, Facts, str]]:
    """The first batches: their files, facts and commands."""
    counts = report.evidence.rows["batch"].value_counts()
    for i, batch in enumerate(report.evidence.batches[:BATCHES]):
        yield str(batch.csv_file), facts(batch, int(counts.get(i, 0))), command(batch)


def command(batch: Batch) -> str:
    """The command or the Python call that made a batch, empty if it is not known."""
    words, call = batch.manifest.get("command"), batch.manifest.get("call")
    if isinstance(call, str):
        return call
    return shlex.join(map(str, words)) if isinstance(words, list) else ""


def _testers(scenario: Scenario) -> str:
    """The number of testers of each kind."""
    return f"{scenario.testers} x {scenario.kind}"


def _ego(scenario: Scenario) -> str:
    """The ego; one that cannot be loaded here by its recorded name."""
    try:
        return ego_words(scenario)
    except CavsumoError:
        return " ".join((scenario.ego, *(f"{k}={v}" for k, v in scenario.ego_params.items())))


def _pairs(found: object) -> str:
    """Names with their versions."""
    return ", ".join(f"{k} {v}" for k, v in found.items()) if isinstance(found, dict) else ""


def _share(share: Share) -> str:
    """A share with its first interval."""
    found = f"{percent(share.value)} {interval(next(iter(share.intervals.values())))}"
    return found.replace(" ", "\N{NO-BREAK SPACE}")


def _many(count: int, what: str) -> str:
    """So many of them."""
    return f"{count:,} {what}{'' if count == 1 else 's'}".replace(",", " ")


def _listed(words: Sequence[str]) -> str:
    """Words with an "and" before the last."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1]))) if words else ""
