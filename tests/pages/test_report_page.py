"""cavsumo report --html: what the page says, what lies beside it, what it refuses."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from report_files import ERROR, FAILED, HELD, JUDGED, NOTHING, SOME, UNFAIR, judged, write

from cavsumo.cli import main
from cavsumo.errors import InputError
from cavsumo.report.analysis import analyse
from cavsumo.report.pages.report.document import write_report
from cavsumo.report.pages.report.links import chosen
from cavsumo.report.pages.report.places import FAILED as TRIGGER
from cavsumo.report.pages.report.places import IMPACT, PASSED, Spot, maps, merged
from cavsumo.report.pages.report.plots import Bar, ratios_plot, shares_plot, survival_plot
from cavsumo.report.pages.report.scenes import scenes
from cavsumo.report.pages.report.words import answers, certainty, excluded, headline
from cavsumo.results.kaplan_meier import kaplan_meier
from cavsumo.results.reading import read_rows

Page = Callable[..., str]


@pytest.fixture
def page(tmp_path: Path) -> Page:
    """Call with results for their page."""

    def made(*files: Path, replays: int = 0) -> str:
        write_report(analyse(files), tmp_path / "page.html", replays)
        return (tmp_path / "page.html").read_text(encoding="utf-8")

    return made


class Words(HTMLParser):
    """The tags and the text of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: object) -> None:
        """Note a tag."""
        self.tags.append(tag)

    def handle_data(self, data: str) -> None:
        """Note text."""
        self.text += data


# Words


def test_the_answer_comes_first(tmp_path: Path) -> None:
    """A sentence a group, with the figures of the report; unfair and errors are told."""
    report = analyse([write(tmp_path / "some.csv", SOME)])
    first, second = (text.replace("\N{NO-BREAK SPACE}", " ") for text in answers(report))
    assert first == (
        "random found 1 test in 3 episodes, 33.3 % [6.1, 79.2]; the ego passed it: it failed "
        "0.0 % [0.0, 79.3]."
    )
    assert second == (
        "timing found 4 tests in 4 episodes, 100.0 % [51.0, 100.0]; the ego failed 2 of them, "
        "50.0 % [15.0, 85.0]."
    )
    assert certainty(report) == "In brackets: 95 % intervals in per cent, by Wilson."
    assert excluded(report).startswith("1 episode of 8 was unfair: the ego could not have stopped")
    assert excluded(report).endswith("1 could not be played (errors) and are left out.")
    assert headline(report).endswith("Testers: 3 x pedestrian. 8 episodes, seed 1.")


def test_the_page_tells_preventable_failures_blame_and_invalid_episodes(
    tmp_path: Path, page: Page
) -> None:
    """With intervals and apart from errors; where nobody judged there is no such plot."""
    file = write(tmp_path / "judged.csv", JUDGED, reference="human")
    report = analyse([file])
    first, second = (text.replace("\N{NO-BREAK SPACE}", " ") for text in answers(report))
    who = "preventable by a careful human driver (UN R157)"
    assert first.endswith(f"; 2 failures, 100.0 % [34.2, 100.0], {who}.")
    apart = "apart from that 1 unpreventable, 1 not judged"
    assert second.endswith(f"; 1 failure, 33.3 % [6.1, 79.2], {who}; {apart}.")
    assert "1 invalid: a tester broke the rules of the world" in excluded(report)
    assert excluded(report).endswith("Every episode could be played.")
    text = Words(page(file)).text
    assert f"Invalid: {file} run 0: tester0 left the world at 3.0 s" in text
    assert "Preventable failures, of tests" in text
    assert "tester:stepped-out" in text
    assert "Preventable failures, of" not in Words(page(write(tmp_path / "some.csv", SOME))).text


def test_the_page_of_a_search_has_its_archive(tmp_path: Path, page: Page) -> None:
    """A field for each side, speed and place, with the best that came of it; alike failures."""
    course = {"from_side": "left", "tester_speed_mps": 0.6, "meets_m": 21.0}
    hit = {**judged(1), "grade": 3.0, **course}
    missed = {"outcome": "not_triggered", "grade": -3.5, **course, "meets_m": 42.0}
    text = page(write(tmp_path / "a.csv", [[hit], [missed]], agents=["search"], reference="human"))
    assert '<td class="band preventable" title="1 test; the best, run 0: preventable f' in text
    assert '<td class="band none"></td><td class="band missed" title="1 test; the best' in text
    words = Words(text).text
    assert "search: 2 of 12 fields have a test" in words
    assert "from the left, 0.6 m/s, 20 to 30 m along the ego's path, hit at 2 to 4 m/s" in words
    assert "What was searched" not in page(write(tmp_path / "some.csv", SOME))


def test_nothing_found_is_an_answer(tmp_path: Path) -> None:
    """No test, no valid episode, no row at all."""
    nothing = write(tmp_path / "a.csv", [[NOTHING, ERROR]] * 5)
    found = [text.replace("\N{NO-BREAK SPACE}", " ") for text in answers(analyse([nothing]))]
    assert found == [
        "random found no test in 5 episodes, 0.0 % [0.0, 43.4].",
        "timing played no valid episode.",
    ]
    empty = write(tmp_path / "b.csv", [], runs=4)
    assert answers(analyse([empty])) == ["The results hold no episodes yet."]


def test_an_early_stop_is_told(tmp_path: Path) -> None:
    """Wilson's interval does not hold then, and is not named."""
    file = write(tmp_path / "a.csv", [[HELD], [FAILED]], agents=["timing"], first=True)
    assert "confidence sequences" in certainty(analyse([file]))


@pytest.mark.parametrize(
    "outcomes", [[], [[ERROR, ERROR]], [[NOTHING, NOTHING]], [[UNFAIR, FAILED]]]
)
def test_little_makes_a_page_too(tmp_path: Path, page: Page, outcomes: list[list[str]]) -> None:
    """Without tests, without episodes, without the network: no plot of nothing, no failure."""
    text = page(write(tmp_path / "a.csv", outcomes, runs=4))
    assert not re.search(r"\bnan\b", text)
    assert ("SUMO crashed (SIGSEGV)" in text) == ([ERROR, ERROR] in outcomes)


def test_the_page_has_every_table(tmp_path: Path, page: Page) -> None:
    """All that is printed stands on the page, and nothing has an address outside."""
    file = write(tmp_path / "a.csv", SOME)
    text = page(file, write(tmp_path / "b.csv", SOME, ego="sumo", testers=2))
    words = Words(text)
    for title in (
        "Results",
        "Shares, with",
        "Tests on the same",
        "Time to the",
        "Found per",
        "How many are",
    ):
        assert title in words.text
    assert words.tags.count("table") >= 7
    without = re.sub(r'xmlns(:xlink)?="[^"]*"', "", text)
    assert "http" not in without.replace("http-equiv", "")


def test_the_same_report_is_the_same_page(tmp_path: Path, page: Page) -> None:
    """Byte for byte."""
    file = write(tmp_path / "a.csv", SOME)
    assert page(file) == page(file)


# Plots


def test_plots_keep_text_as_text_and_colours_by_name() -> None:
    """No glyphs as outlines, no fixed colour, no font that a reader has not."""
    bars = [Bar("a$x$ <b>", 0.5, 0.25, 0.75, "50 %"), Bar("none", None, None, None, "")]
    ratios = [Bar("a : b", float("inf"), 2.0, float("inf"), "∞"), Bar("c", 0.0, 0.0, 1.5, "0")]
    curve = kaplan_meier(np.array([1.0, 2.0, 3.0]), np.array([True, False, True]))
    assert curve is not None
    for svg in (shares_plot(bars, "x"), ratios_plot(ratios, "y"), survival_plot([curve], "z")):
        assert "<text" in svg
        assert not re.search(r"#[0-9a-fA-F]{6}\b(?!\")", svg), svg
        assert "var(--soft)" in svg
        assert "font-family: inherit" in svg
    assert "a$x$ &lt;b&gt;" in shares_plot(bars, "x")


# Where


def test_many_spots_are_few_dots() -> None:
    """A hundred thousand events stay below the bound, and none is lost."""
    spots = [
        Spot(i % 400 / 2, i // 400 % 250 / 2, i % 3, (PASSED, TRIGGER, IMPACT)[i % 3], i)
        for i in range(100_000)
    ]
    dots, apart = merged(spots)
    assert len(dots) <= 1500
    assert sum(dot.many for dot in dots) == 100_000
    assert apart > 0.5
    assert [dot.sort for dot in dots] == sorted(
        (d.sort for d in dots), key=[PASSED, TRIGGER, IMPACT].index
    )


def test_spots_apart_stay_apart() -> None:
    """Those of another group or another sort are never put together."""
    spots = [
        Spot(1.1, 1.1, 0, PASSED, 7),
        Spot(1.2, 1.2, 0, PASSED, 8),
        Spot(1.1, 1.1, 1, PASSED, 9),
    ]
    dots, apart = merged(spots)
    assert apart == 0.5
    assert [(d.group, d.many, d.run) for d in dots] == [(0, 2, 7), (1, 1, 9)]
    assert (dots[0].x, dots[0].y) == pytest.approx((1.15, 1.15))


# A batch that was played


def test_dots_lie_where_the_traces_say(found_failure: Path) -> None:
    """In metres from the upper left corner of the map; every test has its dots."""
    report = analyse([found_failure])
    (one,) = maps(report, scenes(report.evidence.batches))
    rates = report.rates
    many = {
        sort: sum(d.many for d in one.dots if d.sort == sort) for sort in (PASSED, TRIGGER, IMPACT)
    }
    failures = sum(r.failures.count for r in rates)
    assert many == {
        PASSED: sum(r.tests.count for r in rates) - failures,
        TRIGGER: failures,
        IMPACT: failures,
    }
    west = {
        d.run: report.tests[d.run].trigger.x - d.x
        for d in one.dots
        if d.many == 1 and d.sort != IMPACT
    }
    north = {
        d.run: report.tests[d.run].trigger.y + d.y
        for d in one.dots
        if d.many == 1 and d.sort != IMPACT
    }
    assert max(west.values()) - min(west.values()) < 0.011
    assert max(north.values()) - min(north.values()) < 0.011
    assert one.areas["road"].startswith("M")
    assert one.problem == ""


def test_replays_lie_beside_the_page(found_failure: Path, tmp_path: Path) -> None:
    """A page each, of failures and of half as many passed tests, linked relatively."""
    html = tmp_path / "out" / "my report.html"
    html.parent.mkdir()
    assert main(["report", str(found_failure), "--html", str(html), "-o", str(tmp_path / "t")]) == 0
    text = html.read_text(encoding="utf-8")
    links = set(re.findall(r'href="(my%20report_replays/run\d{6}\.html)"', text))
    pages = {f"my%20report_replays/{f.name}" for f in html.parent.glob("my report_replays/*")}
    assert links == pages
    tests = [r["run"] for r in read_rows(found_failure) if r["outcome"] in (HELD, FAILED)]
    assert len(pages) == len(tests)


def test_without_the_network_there_are_commands(
    found_failure: Path, tmp_path: Path, page: Page
) -> None:
    """The map says why it is bare, and each run how to make its page."""
    file = tmp_path / "moved.csv"
    shutil.copy(found_failure, file)
    shutil.copytree(
        found_failure.with_suffix(""), found_failure.parent / "again", dirs_exist_ok=True
    )
    text = found_failure.with_suffix(".json").read_text(encoding="utf-8")
    manifest = json.loads(text)
    net = manifest["plan"]["scenario"]["net"]
    gone = text.replace(json.dumps(net), json.dumps("gone/away.net.xml"))
    file.with_suffix(".json").write_text(gone, encoding="utf-8")
    shutil.copytree(found_failure.with_suffix(""), tmp_path / found_failure.stem)
    found = page(file, replays=5)
    assert "drawn without its network" in found
    assert "_replays" not in found
    assert not (tmp_path / "page_replays").exists()
    assert re.search(r"cavsumo replay \S*moved.csv \d+ --html run\d+.html", found)


def test_one_of_each_kind_comes_first(found_failure: Path) -> None:
    """The failures that stand for a cell, the most frequent first; passed tests are passed ones."""
    report = analyse([found_failure])
    failures, tests = chosen(report, 2)
    assert [look.run for look in failures[: len(report.failures)]] == [
        f.run for f in report.failures
    ]
    assert [look.alike for look in failures[: len(report.failures)]] == [
        f.count for f in report.failures
    ]
    assert len(tests) == 1
    assert {report.evidence.rows["outcome"][look.index] for look in tests} == {HELD}


# Refused


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--html", "gone/page.html"], "--html 'gone/page.html': no such folder"),
        (["--html", "a.csv"], "is one of the results"),
        (["--html", "page.html", "--replays", "-1"], "--replays: expected at least 0, got -1"),
    ],
)
def test_wrong_words_are_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    said: str,
) -> None:
    """In one sentence, and nothing is written."""
    monkeypatch.chdir(tmp_path)
    write(Path("a.csv"), SOME)
    before = sorted(tmp_path.iterdir())
    assert main(["report", "a.csv", *words]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


def test_a_folder_of_replays_that_cannot_be_made(found_failure: Path, tmp_path: Path) -> None:
    """A file is in the way: one sentence, and no page that would link nowhere."""
    (tmp_path / "page_replays").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match=r"page_replays"):
        write_report(analyse([found_failure]), tmp_path / "page.html", 5)
    assert not (tmp_path / "page.html").exists()
