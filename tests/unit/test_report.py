"""cavsumo report: from results on disk to what is printed and written."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import pytest
from report_files import ERROR, FAILED, HELD, JUDGED, NOTHING, SOME, UNFAIR, write
from support import json_lines

from cavsumo.cli import main
from cavsumo.errors import InputError
from cavsumo.report.analysis import Report, analyse
from cavsumo.report.distinct import Cell, FailureCell, failure_cells
from cavsumo.report.events import Described, Event, side_ahead, side_hit
from cavsumo.report.formats import FORMATS, as_table
from cavsumo.results.columns import COLUMNS
from cavsumo.results.traces import read_moments

Says = Callable[..., str]


@pytest.fixture
def says(capsys: pytest.CaptureFixture[str]) -> Says:
    """Call with the words of ``cavsumo report`` for what it prints."""

    def said(*words: str | Path) -> str:
        assert main(["report", *map(str, words)]) == 0
        found = capsys.readouterr()
        written = [words[words.index(o) + 1] for o in ("--junit", "-o") if o in words]
        assert found.err == "".join(f"cavsumo: wrote {file}\n" for file in written)
        return found.out

    return said


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Says:
    """The same where it must say no: one sentence and exit status 2."""

    def said(*words: str | Path) -> str:
        assert main(["report", *map(str, words)]) == 2
        found = capsys.readouterr()
        assert found.out == ""
        assert found.err.count("\n") == 1, found.err
        return found.err

    return said


# What is said


@pytest.fixture
def some(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Report:
    """Two agents, four seeds, an error, an unfair episode."""
    monkeypatch.chdir(tmp_path)
    return analyse([write(Path("some.csv"), SOME)])


def test_shares_by_hand(some: Report) -> None:
    """An error is no valid episode; failures are of tests; everything is counted."""
    random, timing = some.rates
    assert (random.episodes, random.errors) == (4, 1)
    assert (random.tests.count, random.tests.total) == (1, 3)
    assert (random.failures.count, random.failures.total) == (0, 1)
    assert (random.unfair.count, random.unfair.total) == (1, 3)
    assert (timing.tests.count, timing.tests.total) == (4, 4)
    assert timing.failures.value == 0.5
    assert list(timing.tests.intervals) == ["Wilson", "Clopper-Pearson"]


def test_what_could_have_been_avoided_and_who_is_to_blame(tmp_path: Path, says: Says) -> None:
    """Of the tests, apart from other failures; a failure without a rule broken counts too."""
    file = write(tmp_path / "judged.csv", JUDGED, reference="human")
    random, timing = analyse([file]).rates
    assert (random.preventable.count, random.preventable.total) == (2, 2)
    assert (timing.preventable.count, timing.preventable.total) == (1, 3)
    assert (timing.unpreventable.count, timing.not_judged, timing.failures.count) == (1, 1, 3)
    assert timing.reference == "human"
    assert {rule: share.count for rule, share in random.blame.items()} == {"ego:speed": 2}
    assert {rule: share.count for rule, share in timing.blame.items()} == {
        "no rule": 2,
        "tester:stepped-out": 1,
    }
    assert {share.total for share in timing.blame.values()} == {3}
    lines = [line.split() for line in says(file).splitlines()]
    assert ["timing", "preventable", "(human)", "1", "of", "3", "tests"] in [x[:7] for x in lines]
    assert ["unpreventable", "1", "of", "3", "tests"] in [line[:5] for line in lines]
    assert ["not", "judged", "1", "of", "3", "failures"] in lines
    assert ["tester:stepped-out", "1", "of", "3", "failures"] in [line[:5] for line in lines]
    assert ["invalid", "1", "of", "3", "episodes"] in lines
    data = json.loads(says(file, "--format", "json"))
    assert data["rates"][0]["blame"]["ego:speed"]["count"] == 2
    assert "blame ego:speed: count,2," in says(file, "--format", "csv")


def test_failures_that_only_an_ideal_driver_avoids_are_told(tmp_path: Path, says: Says) -> None:
    """Apart from the preventable ones, in every format; not where nobody asked."""
    asked = [
        (JUDGED[1][0], {**JUDGED[1][1], "avoidable_ideal": 1}),
        (JUDGED[2][0], {**JUDGED[1][1], "avoidable_ideal": 0}),
    ]
    file = write(tmp_path / "asked.csv", asked, reference="human")
    random, timing = analyse([file]).rates
    assert random.by_ideal is None
    assert timing.by_ideal is not None
    assert (timing.by_ideal.count, timing.by_ideal.total, timing.unpreventable.count) == (1, 2, 2)
    lines = [line.split() for line in says(file).splitlines()]
    assert ["preventable", "(ideal", "only)", "1", "of", "2", "tests"] in [x[:7] for x in lines]
    assert json.loads(says(file, "--format", "json"))["rates"][1]["by_ideal"]["count"] == 1
    junit = tmp_path / "r.xml"
    says(file, "--junit", junit)
    assert "timing.preventable-ideal-only" in junit.read_text(encoding="utf-8")


def test_pairs_leave_out_what_either_could_not_play(some: Report) -> None:
    """Of four seeds one is an error of random's: three pairs; the later agent comes first."""
    failures, tests = some.comparisons
    assert (tests.first, tests.second, tests.event) == ("timing", "random", "tests")
    assert tests.pairs == (1, 2, 0, 0)
    assert tests.ratio == 3.0
    assert failures.pairs == (0, 2, 0, 1)
    assert (tests.p, tests.p_holm) == (0.5, 1.0)


def test_times_by_hand(some: Report) -> None:
    """Tests at their trigger, others censored at their end, errors left out."""
    random, timing = some.times
    assert random.curve is not None
    assert list(random.curve.times) == [4.0, 22.0, 24.0]  # test, nothing, unfair
    assert list(random.curve.share) == pytest.approx([2 / 3] * 3)
    assert random.median is None
    assert (random.first_test, random.first_failure) == (("some.csv", 0), None)
    assert timing.curve is not None
    assert list(timing.curve.times) == [5.0, 7.0, 9.0, 11.0]
    assert timing.median == 7.0
    assert (timing.first_test, timing.first_failure) == (("some.csv", 1), ("some.csv", 3))
    assert timing.limit == random.limit == 11.0


def test_seconds_by_hand(some: Report) -> None:
    """Errors take real time and no simulated time."""
    random, timing = some.efforts
    assert (random.simulated_s, random.real_s) == (20 + 22 + 24, 2.0)
    assert random.tests_simulated.value == pytest.approx(1 / 66)
    assert timing.failures_real.value == pytest.approx(2 / 2.0)


def test_without_traces_cells_are_not_known(some: Report, says: Says) -> None:
    """The report says so instead of guessing."""
    assert [d.tests.known for d in some.distinct] == [0, 0]
    assert some.failures == []
    assert "Where no trace was kept the cell is not known." in says("some.csv")


def test_early_stopping_changes_the_intervals(tmp_path: Path, says: Says) -> None:
    """A batch that may stop on what it finds has confidence sequences, and says why."""
    file = write(tmp_path / "s.csv", SOME, "stopped", first=True)
    data = json.loads(file.with_suffix(".json").read_text(encoding="utf-8"))
    data["stopped_by"] = "first failure: run 3"
    file.with_suffix(".json").write_text(json.dumps(data), encoding="utf-8")
    report = analyse([file])
    assert list(report.rates[0].tests.intervals) == ["confidence sequence"]
    assert all(c.sequential for c in report.comparisons)
    said = " ".join(says(file).split())
    assert "was stopped: first failure: run 3. Its intervals of rates and ratios" in said
    assert "Wilson" not in said
    assert "exact McNemar" not in said


@pytest.mark.parametrize(
    "outcomes",
    [
        [],
        [(ERROR, ERROR)],
        [(NOTHING, NOTHING)] * 3,
        [(UNFAIR, ERROR)],
        [(HELD, HELD)],
        [(FAILED, NOTHING)],
    ],
    ids=["empty", "errors", "nothing", "unfair", "one test", "one failure"],
)
@pytest.mark.parametrize("form", FORMATS)
def test_little_is_no_reason_to_fail(
    tmp_path: Path, says: Says, outcomes: list[tuple[str, str]], form: str
) -> None:
    """An empty batch, one of errors, one without a test: a report all the same."""
    file = write(tmp_path / "little.csv", outcomes, "interrupted", runs=9)
    said = says(file, "--format", form, "--junit", tmp_path / "j.xml")
    assert "nan" not in said
    if form == "table":
        assert f"{2 * len(outcomes)} of 18" in said
        assert "is unfinished" in said
    if form == "json":
        assert len(json.loads(said)["rates"]) == (2 if outcomes else 0)
    if form == "csv":
        assert all(len(line) == 9 for line in csv.reader(io.StringIO(said)))


def test_one_agent_has_nobody_to_be_compared_with(tmp_path: Path, says: Says) -> None:
    """No comparison, and no empty table of one."""
    said = says(write(tmp_path / "one.csv", [(HELD,), (FAILED,)], agents=["timing"]))
    assert "on the same seeds" not in said
    assert "timing" in said


def test_a_torn_last_row_is_left_out(tmp_path: Path, says: Says) -> None:
    """As resuming does: a batch under way can be looked at."""
    file = write(tmp_path / "torn.csv", SOME, "running")
    with file.open("a") as stream:
        stream.write("8,random,su")
    assert "8 of 8" in says(file)


# Several files, and columns


def test_shards_and_seeds_of_one_scenario_are_told_together(tmp_path: Path) -> None:
    """Same scenario, other seeds: one setting with all episodes; pairs never cross files."""
    files = [write(tmp_path / f"{seed}.csv", SOME, seed=seed) for seed in (1, 2)]
    report = analyse(files)
    assert [(g.setting, g.agent) for g in report.groups] == [("", "random"), ("", "timing")]
    assert report.rates[1].tests.total == 8
    assert report.comparisons[0].pairs.total == 6


def test_other_scenarios_are_told_apart(tmp_path: Path, says: Says) -> None:
    """Another number of testers is another setting, named by its file."""
    one = write(tmp_path / "one.csv", SOME)
    other = write(tmp_path / "other.csv", SOME, testers=5)
    report = analyse([one, other])
    assert [g.setting for g in report.groups] == [str(one)] * 2 + [str(other)] * 2
    assert {c.setting for c in report.comparisons} == {str(one), str(other)}
    assert "setting" in says(one, other)


def test_the_same_agents_against_another_ego(tmp_path: Path, says: Says) -> None:
    """--by ego: the egos are compared for each agent, on the same seeds."""
    calm = [(NOTHING, HELD)] * 4
    files = [
        write(tmp_path / "a.csv", SOME),
        write(tmp_path / "b.csv", calm, ego="time-gap", ego_params={"gap": 2}),
    ]
    report = analyse(files, "ego")
    assert [(g.agent, g.value) for g in report.groups] == [
        ("random", "sumo"),
        ("timing", "sumo"),
        ("random", "time-gap"),
        ("timing", "time-gap"),
    ]
    failures = [c for c in report.comparisons if c.event == "failures"]
    assert [(c.agent, c.first, c.second) for c in failures] == [
        ("random", "time-gap", "sumo"),
        ("timing", "time-gap", "sumo"),
    ]
    assert failures[1].pairs == (0, 0, 2, 2)
    assert "time-gap : sumo" in says(*files, "--by", "ego")


def test_files_can_be_compared(tmp_path: Path) -> None:
    """--by file: whatever differs between them, the same seeds are paired."""
    files = [write(tmp_path / f"{n}.csv", SOME, testers=n) for n in (1, 2)]
    found = analyse(files, "file").comparisons
    assert {(c.agent, c.pairs.total) for c in found} == {("random", 3), ("timing", 4)}


@pytest.mark.parametrize(
    "by", ["net", "testers", "outcome", "assertion", "trigger_time_s", "error"]
)
def test_any_column_will_do(tmp_path: Path, says: Says, by: str) -> None:
    """Every column of the results can tell rows apart; a cell without a value is (none)."""
    file = write(tmp_path / "some.csv", SOME)
    counts = json.loads(says(file, "--by", by, "--format", "json"))["rates"]
    assert sum(one["episodes"] for one in counts) == 8
    said = says(file, "--by", by)
    assert by in said
    assert ("(none)" in said) == (by in ("assertion", "trigger_time_s", "error"))


def test_an_episode_counts_once(tmp_path: Path, refused: Says) -> None:
    """A copy of a batch, or the same file twice, would make evidence out of nothing."""
    one, copy = write(tmp_path / "one.csv", SOME), write(tmp_path / "copy.csv", SOME[:2])
    said = refused(one, copy)
    assert f"run 0 of {str(one)!r} and run 0 of {str(copy)!r} are the same episode" in said
    assert "named twice" in refused(one, tmp_path / "." / "one.csv")


# What is wrong


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--by", "egoo"], "--by: unknown column 'egoo'; did you mean 'ego'?"),
        (["--format", "html"], "invalid choice: 'html'"),
        (["-o", "nowhere/out"], "no such folder 'nowhere'"),
        (["-o", "some.csv"], "is one of the results"),
        (["--junit", "some.json"], "is one of the results"),
        (["gone.csv"], "manifest 'gone.json': cannot be read"),
    ],
)
def test_wrong_words_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: Says, words: list[str], said: str
) -> None:
    """One sentence that names the option and what was expected; nothing is written."""
    monkeypatch.chdir(tmp_path)
    before = write(Path("some.csv"), SOME).read_bytes()
    assert said in refused("some.csv", *words)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["some.csv", "some.json"]
    assert Path("some.csv").read_bytes() == before


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda text: "a,b\n1,2\n", "line 1 does not hold the columns"),
        (lambda text: text.replace("not_triggered", "passed"), "outcome is 'passed', expected one"),
        (lambda text: text.replace("20.000", "soon"), "time_s is 'soon', expected a number"),
        (lambda text: text.replace("20.000", "inf"), "time_s is 'inf', expected a number"),
        (lambda text: text.replace("fresh,,,", "fresh,,,1.5"), "expected a whole number"),
        (lambda text: text.replace("0,random", "x,random"), "line 2 begins with 'x'"),
        (lambda text: text.replace(",held,", ",held"), f"{len(COLUMNS) - 1} cells, expected"),
        (lambda text: text.replace("tester0,,,,4.000", "tester0,,,,"), "trigger_time_s is ''"),
        (lambda text: text.replace("random", "rand\xff"), None),
    ],
)
def test_damaged_results_are_refused(
    tmp_path: Path, refused: Says, says: Says, damage: Callable[[str], str], said: str | None
) -> None:
    """The file, and the line or the run; a name that is only odd is no damage."""
    file = write(tmp_path / "some.csv", SOME)
    file.write_text(damage(file.read_text(encoding="utf-8")), encoding="utf-8")
    if said is None:
        assert "rand\xff" in says(file)
    else:
        assert said in refused(file)


def test_too_many_groups_are_no_report(tmp_path: Path) -> None:
    """A column in which every row differs."""
    file = write(tmp_path / "many.csv", [(HELD, HELD)] * 150)
    with pytest.raises(InputError, match="--by run: 300 groups, expected a column with few"):
        analyse([file], "run")


@pytest.mark.parametrize("damage", ["", "{}\n{}\n", "{}\nno frame\n"])
def test_a_damaged_trace_is_refused(tmp_path: Path, refused: Says, damage: str) -> None:
    """A trace that is named and cannot be read is damage, not absence."""
    file = write(tmp_path / "some.csv", [(HELD, NOTHING)])
    text = file.read_text(encoding="utf-8").splitlines()
    cells = text[1].split(",")
    cells[list(COLUMNS).index("trace")] = "t.jsonl"
    file.write_text("\n".join([text[0], ",".join(cells), text[2]]) + "\n", encoding="utf-8")
    assert "trace" in refused(file)
    (tmp_path / "t.jsonl").write_text(damage, encoding="utf-8")
    assert "cannot be read" in refused(file)


# Traces


def test_moments_of_a_trace(tmp_path: Path) -> None:
    """The nearest frames, and the way driven along a bend: 3 m, then 4 m."""
    places = [(0.0, 0.0), (3.0, 0.0), (3.0, 4.0)]
    frames = [
        {"step": i, "time_s": i / 10, "ego": [x, y, 1.0, 0.0], "steering": 0.0}
        | {"testers": {}, "background": {}, "lights": ""}
        for i, (x, y) in enumerate(places)
    ]
    head = {"format": "cavsumo-trace-1", "memory": None, "memory_kept": True, "bodies": []}
    head |= {key: {} for key in ("plan", "sha256", "versions", "sumo_options")}
    head["row"] = {
        "run": "0",
        "seed": "1",
        "agent": "timing",
        "outcome": "not_triggered",
        "time_s": "0.2",
    }
    file = tmp_path / "t.jsonl"
    file.write_text(json_lines(head, *frames), encoding="utf-8")
    moments = read_moments(file, [0.1, 0.26, 0.0])
    assert [(driven, frame["step"]) for driven, frame in moments] == [(3.0, 1), (7.0, 2), (0.0, 0)]


@pytest.mark.parametrize("turn", [0.0, 2.0])
@pytest.mark.parametrize(
    ("ahead", "left", "hit", "zone"),
    [
        (2.7, 0.0, "front", "front"),
        (2.6, 0.95, "front", "left"),
        (2.0, 1.0, "left", "left"),
        (0.0, -1.1, "right", "right"),
        (-2.8, 0.2, "rear", "front"),
        (9.0, -1.0, "front", "right"),
    ],
)
def test_sides_of_the_ego(turn: float, ahead: float, left: float, hit: str, zone: str) -> None:
    """A box of 5 m by 1.8 m, whatever its heading."""
    ego = [10.0, 5.0, 8.0, turn]
    c, s = math.cos(turn), math.sin(turn)
    other = [10.0 + ahead * c - left * s, 5.0 + ahead * s + left * c, 1.0, 0.0]
    assert side_hit(ego, other) == hit
    assert side_ahead(ego, other) == zone


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        (11, "1 failure in 1 more cell is not shown."),
        (12, "2 failures in 2 more cells are not shown."),
    ],
)
def test_the_rest_of_the_cells_is_counted_in_words(some: Report, cells: int, said: str) -> None:
    """One failure in one cell is a singular."""
    places = [Cell("", "pedestrian", "front", 2.0 * i, 10.0) for i in range(cells)]
    found = [FailureCell(cell, 1, 0, "some.csv", i, ("a",)) for i, cell in enumerate(places)]
    assert said in as_table(dataclasses.replace(some, failures=found))


def test_failures_that_are_preventable_come_first_in_cells_and_runs(tmp_path: Path) -> None:
    """A cell that was preventable once stands before one that never was, with that run."""
    file = write(tmp_path / "r.csv", JUDGED, reference="human")
    report = analyse([file])
    where = Event(3.0, "front", 20.0, 0.0, 0.0)
    tests = {i: Described(where, where) for i in report.tests}
    (cell,) = failure_cells(report.groups, tests, report.evidence.batches)
    assert (cell.count, cell.preventable, cell.run) == (5, 3, 1)


# JUnit


def test_junit_of_some(tmp_path: Path, says: Says) -> None:
    """A suite a file, a case an agent and assertion; failures with their replay commands."""
    file, xml = write(tmp_path / "a b.csv", SOME), tmp_path / "j.xml"
    says(file, "--junit", xml)
    root = ET.parse(xml).getroot()
    assert (root.get("tests"), root.get("failures"), root.get("errors")) == ("3", "1", "1")
    suite = root.find("testsuite")
    assert suite is not None
    assert suite.get("name") == str(file)
    cases = {(c.get("classname"), c.get("name")): c for c in suite.iter("testcase")}
    assert list(cases[("random", "reaction-zone")]) == []
    failure = cases[("timing", "reaction-zone")].find("failure")
    error = cases[("random", "episodes can be played")].find("error")
    assert failure is not None
    assert failure.text is not None
    assert error is not None
    assert "2 of 4 tests failed; first: run 3" in failure.get("message", "")
    assert f"collision at 8.0 s with tester0: cavsumo replay '{file}' 3" in failure.text
    assert "1 of 4 episodes could not be played; first: run 6: SUMO crashed" in error.get(
        "message", ""
    )
    told = {p.get("name"): p.get("value", "") for p in suite.iter("property")}
    assert told["timing.failures"].startswith("2 of 4 tests, 50.0 %, 95 % interval by Wilson [15.0")


def test_junit_escapes_what_xml_cannot_hold(tmp_path: Path, says: Says) -> None:
    """Markup and control characters in messages: whatever reads it gets them back, or a sign."""
    file, xml = write(tmp_path / "<&>.csv", [(ERROR, HELD)]), tmp_path / "j.xml"
    text = file.read_text(encoding="utf-8")
    bad = "]]> & <b> é \x1b[0m "
    file.write_text(text.replace("SUMO crashed (SIGSEGV)", bad), encoding="utf-8")
    says(file, "--junit", xml)
    error = next(ET.parse(xml).getroot().iter("error"))
    assert error.text == "run 0: ]]> & <b> é �[0m "


def test_junit_of_an_assertion_never_put_to_the_test(tmp_path: Path, says: Says) -> None:
    """Nothing triggered is skipped, never passed."""
    xml = tmp_path / "j.xml"
    says(write(tmp_path / "n.csv", [(NOTHING, UNFAIR)] * 3), "--junit", xml)
    skipped = [s.get("message", "") for s in ET.parse(xml).getroot().iter("skipped")]
    assert skipped == ["no test of it in 3 valid episodes: nothing is known"] * 2


# Formats


def test_the_csv_and_the_json_hold_the_same_figures(tmp_path: Path, says: Says) -> None:
    """One figure a line, in full precision, with the method of its interval."""
    file = write(tmp_path / "some.csv", SOME)
    lines = list(csv.DictReader(io.StringIO(says(file, "--format", "csv"))))
    data = json.loads(says(file, "--format", "json"))
    share = data["rates"][1]["failures"]
    found = next(
        line
        for line in lines
        if (line["agent"], line["quantity"], line["method"])
        == ("timing", "failures: share", "Clopper-Pearson")
    )
    assert float(found["value"]) == share["value"]
    assert [float(found["low"]), float(found["high"])] == share["intervals"]["Clopper-Pearson"]
    ratio = [line for line in lines if line["quantity"] == "ratio"][1]
    assert (ratio["section"], ratio["group"]) == ("comparison of tests", "timing : random")
    assert float(ratio["value"]) == data["comparisons"][1]["ratio"] == 3.0
    assert data["comparisons"][0]["interval"][1] is None  # no bound above
    assert data["format"] == "cavsumo-report-1"


def test_markdown_escapes_its_own_signs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, says: Says
) -> None:
    """A name with a bar or a tag stays one cell of text."""
    monkeypatch.chdir(tmp_path)
    said = says(write(Path("a|b<i>.csv"), SOME), "--format", "markdown")
    assert "| a\\|b\\<i\\>.csv |" in said
    rows = [line for line in said.splitlines() if line.startswith("| timing")]
    assert rows


def test_wide_figures_are_never_cut(tmp_path: Path, says: Says) -> None:
    """Long names fold, figures stay whole, whatever the width takes."""
    agents = ["programmed-random", "election"]
    file = write(tmp_path / "w.csv", [(HELD, FAILED)] * 3, agents=agents)
    said = says(file)
    assert "election : programmed-random" in said
    other = write(tmp_path / "other.csv", [(HELD, FAILED)] * 3, testers=2, first=True)
    both = says(file, other)
    titles = next(line for line in both.splitlines() if "Wilson" in line)
    expected = "setting agent of what count share Wilson Clopper-Pearson confidence sequence"
    assert titles.split() == expected.split()
    assert "…" not in said + both
