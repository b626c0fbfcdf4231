"""The summary of a batch, and what it has in common with the report of the same file."""

from __future__ import annotations

import dataclasses
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from report_files import FAILED, HELD, NOTHING, UNFAIR, judged, write

from cavsumo.batch.ended import Ended
from cavsumo.batch.searching import SearchFacts
from cavsumo.batch.sentences import exit_reason
from cavsumo.batch.stopping import stopping_rule
from cavsumo.batch.summary import summarise
from cavsumo.batch.tally import Tally
from cavsumo.cli import main
from cavsumo.cli.commands.run import exit_status
from cavsumo.errors import Exit, InputError
from cavsumo.model.scenario import plan_from
from cavsumo.report.analysis import analyse
from cavsumo.report.pages.report.words import answers
from cavsumo.results.reading import read_rows

# One agent: a failure of each kind, a test that was held, episodes without a test.
EACH = [[judged(0)], [NOTHING], [judged(1)], [FAILED], [HELD], [UNFAIR], [NOTHING], [NOTHING]]
STOOD = {"outcome": NOTHING, "arrived": 0, "lost_s": 59.0, "stood_s": 58.0, "frozen": "stood"}
CREPT = {"outcome": NOTHING, "arrived": 0, "lost_s": 50.0, "stood_s": 0.0, "frozen": "crawled"}
DROVE = {"outcome": NOTHING, "arrived": 1, "lost_s": 2.0, "stood_s": 0.0}


def batch(file: Path, outcomes: Sequence[Sequence[Any]], reference: str = "human") -> Ended:
    """A batch of one agent as it ended, with its file."""
    write(file, outcomes, agents=["timing"], reference=reference)
    tally = Tally()
    for row in read_rows(file):
        tally.add(row)
    return Ended("", file, tally, reference=reference)


def shown(ended: Ended, capsys: pytest.CaptureFixture[str]) -> str:
    """The summary as it is printed."""
    summarise([ended])
    return capsys.readouterr().out


def table(text: str) -> dict[str, str]:
    """The first line of the table by its titles, which are two blanks apart."""
    titles, cells = (re.split(r" {2,}", line.strip()) for line in text.splitlines()[:2])
    return dict(zip(titles, cells, strict=True))


def test_the_preventable_failures_lead(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In the first column, in the first sentence and in what is pointed to; others stand apart."""
    said = shown(batch(tmp_path / "r.csv", EACH), capsys)
    cells = table(said)
    assert list(cells)[:4] == ["agent", "runs", "preventable", "of tests [95 %]"]
    assert (cells["preventable"], cells["unpreventable"], cells["not judged"]) == ("1", "1", "1")
    assert cells["of tests [95 %]"].startswith("25.0 % [")
    assert "\n1 preventable failure, 4 tests in 8 episodes." in said
    who = "preventable by a careful human driver (UN R157)"
    assert f"\n1 failure {who}; apart from that 1 unpreventable, 1 not judged\n" in said
    assert "first preventable failure: run 2 (timing)" in said


def test_failures_that_only_an_ideal_driver_avoids_are_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """They stay unpreventable; nothing is said where the ideal driver was not asked, or judged."""
    asked = [
        [judged(human) | {"avoidable_ideal": ideal}] for human, ideal in ((1, 1), (0, 1), (0, 0))
    ]
    said = shown(batch(tmp_path / "r.csv", asked), capsys)
    more = "an ideal driver (full braking at once) would have avoided 1 more"
    assert f"; apart from that 2 unpreventable; {more}\n" in said
    assert table(said)["unpreventable"] == "2"
    assert "more\n" not in shown(batch(tmp_path / "r.csv", EACH), capsys)
    assert "more\n" not in shown(batch(tmp_path / "r.csv", asked, "ideal"), capsys)


def test_without_a_reference_failures_are_failures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nobody judged, so nothing is said of what was preventable."""
    said = shown(batch(tmp_path / "r.csv", [[NOTHING], [FAILED], [HELD]], "none"), capsys)
    assert table(said)["failures"] == "1"
    assert "\n1 failure, 2 tests in 3 episodes." in said
    assert "first failure: run 1 (timing)" in said
    assert "preventable" not in said
    assert "judged" not in said


def test_no_preventable_failure_has_its_bound(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also beside an unpreventable one, but not beside one that nobody could judge."""
    held = [[HELD]] * 9
    said = shown(batch(tmp_path / "a.csv", [*held, [judged(0)]]), capsys)
    assert "\nno preventable failure in 10 tests: at most 27.8 % (95 %)\n" in said
    assert "first unpreventable failure: run 9" in said
    assert "no preventable" not in shown(batch(tmp_path / "b.csv", [*held, [FAILED]]), capsys)
    none = shown(batch(tmp_path / "c.csv", held, "none"), capsys)
    assert "\nno failure in 9 tests: at most" in none


def test_tests_that_a_search_chose_have_no_bound(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The search says itself what its random points prove."""
    found = SearchFacts(9, 90.0, 0, 0, None, "", 0, 0.5)
    one = dataclasses.replace(batch(tmp_path / "a.csv", [[HELD]] * 9), searches={"search": found})
    said = shown(one, capsys)
    assert "search: no preventable failure in 9 episodes" in said
    assert "at most" not in said


def test_exit_status_1_says_what_it_stands_for(tmp_path: Path) -> None:
    """A violation is a violation; whether it was preventable is told first."""
    one = batch(tmp_path / "a.csv", EACH)
    assert exit_status([one], interrupted=False, exit_zero=False) == Exit.VIOLATED
    said = "the ego violated an assertion, preventably in 1 episode, otherwise in 2"
    assert exit_reason(one.tally.all, judged=True) == said
    alone = batch(tmp_path / "b.csv", [[judged(0)]])
    assert exit_status([alone], interrupted=False, exit_zero=False) == Exit.VIOLATED
    said = "the ego violated an assertion, preventably in 0 episodes, otherwise in 1"
    assert exit_reason(alone.tally.all, judged=True) == said
    assert exit_reason(one.tally.all, judged=False) == "the ego violated an assertion in 3 episodes"


@pytest.mark.parametrize(
    ("reference", "last", "said"),
    [("human", 2, "first preventable failure: run 2"), ("none", 0, "first failure: run 0")],
)
def test_the_first_failure_that_stops_is_preventable(
    tmp_path: Path, reference: str, last: int, said: str
) -> None:
    """Where a reference driver judges; without one it is the first of all."""
    rows = [[FAILED]] * 3 if reference == "none" else EACH
    write(tmp_path / "r.csv", rows, agents=["timing"], reference=reference)
    plan = plan_from({"net": "crossing", "first": True, "reference": reference}, "test")
    rule, tally = stopping_rule(plan), Tally()
    for row in read_rows(tmp_path / "r.csv"):
        tally.add(row)
        if reason := rule(tally):
            assert (int(row["run"]), reason) == (last, said)
            return
    pytest.fail("no rule stopped it")


def test_the_rate_to_be_known_may_be_that_of_preventable_failures() -> None:
    """Of tests; it needs somebody who judges."""
    settings = {"net": "crossing", "until_half_width": "0.4", "until_rate": "preventable"}
    rule, tally = stopping_rule(plan_from(settings, "test")), Tally()
    said = ""
    for run in range(20):
        row = {"run": run, "agent": "timing", "outcome": HELD, "trigger_time_s": 1.0}
        tally.add(row)
        said = rule(tally) or said
    assert said == "rate of preventable known to a half-width of 0.4"
    with pytest.raises(InputError, match="needs a reference driver"):
        plan_from({**settings, "reference": "none"}, "test")


def test_run_and_report_tell_the_same_median_and_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One definition of the median, with episodes without a test; runs have their own numbers."""
    rows = [[NOTHING], [HELD], [judged(1)], [HELD], [judged(0)]]
    ended = batch(tmp_path / "r.csv", rows)
    cells = table(shown(ended, capsys))
    time = analyse([ended.csv_file]).times[0]
    assert cells["median to test"] == f"{time.median:.1f} s" == "7.0 s"  # tests at 5, 6, 7, 8 s
    assert time.first_preventable == (str(ended.csv_file), 2)
    assert main(["report", str(ended.csv_file)]) == 0
    line = next(
        x for x in capsys.readouterr().out.splitlines() if x.split()[:3:2] == ["timing", "7.0"]
    )
    assert line.split()[-2:] == ["2", "1"]


def test_a_median_that_was_not_reached_has_a_bound(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Fewer than half of the episodes had a test; so summary and report say more than the last."""
    ended = batch(tmp_path / "r.csv", [[HELD], *[[NOTHING]] * 4])
    assert table(shown(ended, capsys))["median to test"] == "> 24.0 s"
    assert main(["report", str(ended.csv_file)]) == 0
    assert re.search(r"timing +4 +> 24\.0 ", capsys.readouterr().out)


def test_an_ego_that_stood_still_or_crawled_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the summary, the report, its page and JUnit; nobody takes it for a safe one."""
    ended = batch(tmp_path / "r.csv", [[DROVE], [STOOD], [STOOD], [CREPT]])
    warning = (
        "frozen: the ego stood still at the end of 2 and crawled in 1 of 4 valid episodes; "
        "that is not safe driving, it was hardly tested"
    )
    said = shown(ended, capsys)
    assert f"\n{warning}\n       first: cavsumo replay {ended.csv_file} 1 " in said
    assert "the ego lost 42.5 s an episode against a free drive" in said
    assert "it arrived in 1 of the 4 episodes that no verdict ended" in said
    report = analyse([ended.csv_file])
    drive = report.driving[0]
    assert (drive.arrived, drive.could_arrive, drive.lost_s) == (1, 4, 42.5)
    assert (drive.stood_still, drive.crawled, drive.warning) == (2, 1, warning)
    assert f"timing: {warning}." in answers(report)
    xml = tmp_path / "j.xml"
    assert main(["report", str(ended.csv_file), "--junit", str(xml)]) == 0
    assert "stood still at the end of 2" in " ".join(capsys.readouterr().out.split())
    cases = {case.get("name"): case for case in ET.parse(xml).iter("testcase")}
    skipped = cases["the ego drives"].find("skipped")
    assert skipped is not None
    assert skipped.get("message") == warning


def test_an_ego_that_drove_is_not_warned_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither in the summary nor as a case of its own."""
    ended = batch(tmp_path / "r.csv", [[DROVE], [HELD]])
    assert "frozen" not in shown(ended, capsys)
    assert main(["report", str(ended.csv_file), "--junit", str(tmp_path / "j.xml")]) == 0
    names = [case.get("name") for case in ET.parse(tmp_path / "j.xml").iter("testcase")]
    assert names == ["reaction-zone"]


def test_junit_tells_the_preventable_failures_first(tmp_path: Path) -> None:
    """In the message, among the runs and among the properties."""
    ended = batch(tmp_path / "r.csv", EACH)
    assert main(["report", str(ended.csv_file), "--junit", str(tmp_path / "j.xml")]) == 0
    root = ET.parse(tmp_path / "j.xml")
    failure = next(root.iter("failure"))
    message = failure.get("message", "")
    assert message.startswith("1 failure of 4 tests preventable by a careful human driver")
    assert "; apart from that 1 not judged, 1 unpreventable; first: run 2 (" in message
    assert re.findall(r"run (\d) \(seed \d+\), ([a-z ]+):", failure.text or "") == [
        ("2", "preventable"),
        ("3", "not judged"),
        ("0", "unpreventable"),
    ]
    names = [found.get("name") for found in root.iter("property")]
    assert names[0] == "timing.preventable"
    assert "timing.failures" not in names
