"""Stopping early: at the same row however many processes play, with intervals that stay valid."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import Troupe, rows

from cavsumo.batch.batch_run import BatchRun
from cavsumo.batch.executors import local_executor
from cavsumo.batch.prepared import manifest, prepare
from cavsumo.batch.stopping import looks_at_rows
from cavsumo.cli import main
from cavsumo.errors import InputError
from cavsumo.model.scenario import plan_from
from cavsumo.results.failures import failure_kind
from cavsumo.results.reading import read_manifest
from cavsumo.results.statistics import rate, sequential_rate
from cavsumo.results.writing import Recorder

RUNS = 12
AGENTS = ["timing", "election"]
Play = Callable[..., Path]


@pytest.fixture(scope="module")
def settings(networks: Mapping[str, Path]) -> dict[str, Any]:
    """A crossing where about every second episode is a test and some are failures."""
    chosen = {"net": networks["crossing"], "routes": "none", "end": 12.0, "trace": "none"}
    return chosen | {"runs": RUNS, "agents": AGENTS}


@pytest.fixture(scope="module")
def play(settings: dict[str, Any]) -> Iterator[Play]:
    """Call with a file, the number of processes and rules: plays a batch that they end.

    With ``resume`` it goes on with the batch that lies there.
    """
    own = prepare(plan_from(settings, "test"))

    def played(file: Path, jobs: int = 2, *, resume: bool = False, **rules: Any) -> Path:
        prepared = prepare(plan_from({**settings, **rules}, "test"))
        with Recorder(file) as recorder:
            batch_run = BatchRun(prepared, recorder, troupes[jobs], jobs, lambda: False)
            now = manifest(prepared)
            batch_run.resume(read_manifest(file)) if resume else batch_run.begin(now)
            batch_run.play()
            batch_run.end()
        return file

    with local_executor(1) as one, local_executor(2) as two:
        troupes = {1: Troupe(own, one), 2: Troupe(own, two)}
        yield played


@pytest.fixture(scope="module")
def full(play: Play, tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, str]]:
    """The rows of the batch that no rule ends."""
    found = rows(play(tmp_path_factory.mktemp("full") / "r.csv"))
    assert len(found) == 2 * RUNS
    return found


@pytest.fixture(scope="module")
def stopped(play: Play, tmp_path_factory: pytest.TempPathFactory) -> Play:
    """Call with rules: the file of a batch that they ended, played once for each number of jobs."""
    files: dict[tuple[str, int], Path] = {}

    def played(jobs: int = 2, **rules: Any) -> Path:
        key = repr(rules), jobs
        if key not in files:
            files[key] = play(tmp_path_factory.mktemp("stopped") / "r.csv", jobs, **rules)
        return files[key]

    return played


def outcomes(found: list[dict[str, str]]) -> list[str]:
    """What came out, row by row."""
    return [row["outcome"] for row in found]


@pytest.mark.parametrize(
    ("rules", "said"),
    [
        ({"first": True}, "first preventable failure: run "),
        ({"until_tests": 5}, "5 tests found"),
        ({"until_half_width": "0.4"}, "rate of tests known to a half-width of 0.4"),
        ({"until_half_width": "95%"}, "rate of tests known to a half-width of 95%"),
        (
            {"until_half_width": "0.4", "until_rate": "failures"},
            "rate of failures known to a half-width of 0.4",
        ),
    ],
    ids=lambda value: None if isinstance(value, str) else " ".join(value),
)
def test_a_rule_stops_at_the_same_row_for_any_number_of_processes(
    stopped: Play, full: list[dict[str, str]], rules: dict[str, Any], said: str
) -> None:
    """What other processes have played beyond is dropped: the rows are the first of the batch."""
    one, two = (stopped(jobs, **rules) for jobs in (1, 2))
    assert rows(one) == rows(two)
    found = rows(one)
    assert found == full[: len(found)]
    assert 1 < len(found) < len(full)
    for file in (one, two):
        told = read_manifest(file)
        assert told["status"] == "stopped"
        assert told["stopped_by"].startswith(said)
        assert told["episodes"] == len(found)


def test_a_batch_stops_at_the_first_failure_and_not_before(
    stopped: Play, full: list[dict[str, str]]
) -> None:
    """The last row is the only preventable failure."""
    kinds = [failure_kind(row) for row in rows(stopped(first=True))]
    assert kinds.index("preventable") == len(kinds) - 1
    assert "preventable" in map(failure_kind, full)


def test_a_batch_stops_with_the_test_that_was_wanted(stopped: Play) -> None:
    """So many tests and the last row is one of them; failures are tests too."""
    found = outcomes(rows(stopped(until_tests=5)))
    assert sum(outcome in ("held", "violated") for outcome in found) == 5
    assert found[-1] in ("held", "violated")


@pytest.mark.parametrize(("text", "limit"), [("0.4", 0.4), ("95%", None)])
def test_a_batch_stops_when_the_last_agent_is_known_well_enough(
    stopped: Play, full: list[dict[str, str]], text: str, limit: float | None
) -> None:
    """Both agents' intervals are narrow enough at the last row, and not yet one row before."""
    found = rows(stopped(until_half_width=text))

    def narrow(some: list[dict[str, str]]) -> bool:
        for agent in AGENTS:
            mine = [row["outcome"] for row in some if row["agent"] == agent]
            tests = sum(outcome in ("held", "violated") for outcome in mine)
            known = sequential_rate(tests, len(mine))
            if known.value is None or known.low is None or known.high is None:
                return False
            if (known.high - known.low) / 2 > (limit or 0.95 * known.value):
                return False
        return True

    assert [narrow(full[:n]) for n in (len(found) - 1, len(found))] == [False, True]


def test_an_agent_that_has_not_played_yet_is_not_known(play: Play, tmp_path: Path) -> None:
    """However little is asked for, a comparison does not end before its second agent's turn."""
    found = rows(play(tmp_path / "r.csv", until_half_width="0.495"))
    assert {row["agent"] for row in found} == set(AGENTS)


def test_a_budget_ends_a_batch_with_whole_rows(
    play: Play, full: list[dict[str, str]], tmp_path: Path
) -> None:
    """Where it ends is chance, but what it wrote is how the batch begins."""
    file = play(tmp_path / "r.csv", budget_s=0.01)
    found = rows(file)
    assert 1 <= len(found) < len(full)
    assert found == full[: len(found)]
    assert read_manifest(file)["stopped_by"] == "budget of 0.01 s spent"
    assert read_manifest(file)["status"] == "stopped"


def test_a_rule_that_never_fires_changes_nothing(
    play: Play, full: list[dict[str, str]], tmp_path: Path
) -> None:
    """The batch is finished, and nothing is said to have stopped it."""
    file = play(tmp_path / "r.csv", until_tests=2 * RUNS)
    assert rows(file) == full
    assert (read_manifest(file)["status"], read_manifest(file)["stopped_by"]) == ("finished", None)


def test_a_stopped_batch_stays_stopped_until_its_rule_is_laxer(
    play: Play, stopped: Play, full: list[dict[str, str]], tmp_path: Path
) -> None:
    """Going on under the same rule adds nothing; under a laxer one it is as if it had held."""
    file = play(tmp_path / "r.csv", until_tests=3)
    before = file.read_bytes()
    play(file, resume=True, until_tests=3)
    assert file.read_bytes() == before
    assert read_manifest(file)["status"] == "stopped"
    play(file, resume=True, until_tests=5)
    assert file.read_bytes().startswith(before)
    assert rows(file) == rows(stopped(until_tests=5))
    play(file, resume=True)
    assert rows(file) == full
    assert read_manifest(file)["status"] == "finished"


def test_the_command_line_stops_goes_on_and_says_that_the_intervals_are_valid(
    networks: Mapping[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """--first stops, --resume stays there, --no-first goes on; only then are they Wilson's."""
    monkeypatch.chdir(tmp_path)
    words = ["run", "-n", str(networks["crossing"]), "-r", "none", "--end", "12", "--runs", "8"]
    assert main([*words, "--first"]) == 1
    assert "confidence sequences, valid whenever one stops" in capsys.readouterr().out
    stopped = (tmp_path / "results.csv").read_bytes()
    assert stopped.count(b",violated,") == 1
    assert main(["run", "--resume"]) == 1
    assert "confidence sequences, valid whenever one stops" in capsys.readouterr().out
    assert (tmp_path / "results.csv").read_bytes() == stopped
    assert main(["run", "--resume", "--no-first"]) == 1
    assert "confidence sequences" not in capsys.readouterr().out
    assert (tmp_path / "results.csv").read_bytes().count(b"\n") == 9
    assert json.loads((tmp_path / "results.json").read_text())["status"] == "finished"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--until-half-width", "0"], "until_half_width: must be a share such as 0.02"),
        (["--until-half-width", "1.5"], "until_half_width: must be a share such as 0.02"),
        (["--until-half-width", "x%"], "until_half_width: must be a share such as 0.02"),
        (["--until-half-width", "nan"], "until_half_width: must be a share such as 0.02"),
        (["--until-half-width", "100%"], "until_half_width: must be a share such as 0.02"),
        (["--until-tests", "0"], "until_tests: "),
        (["--until-tests", "-3"], "until_tests: "),
        (["--until-tests", "many"], "--until-tests: invalid int value: 'many'"),
        (["--budget", "-1"], "budget_s: "),
        (["--budget", "0"], "budget_s: "),
        (["--budget", "inf"], "budget_s: "),
        (["--until-rate", "violations"], "until_rate: unknown value 'violations'"),
    ],
)
def test_a_rule_that_makes_no_sense_is_refused(
    refused: Callable[..., str], words: list[str], said: str
) -> None:
    """Exit 2 and one sentence that names the option, before anything starts."""
    assert said in refused(*words)


def test_a_half_width_in_a_file_is_a_number_too(settings: dict[str, Any]) -> None:
    """TOML's 0.05 is the command line's; a number that is no share is refused there as well."""
    plan = plan_from({**settings, "until_half_width": 0.05}, "test")
    assert plan.until_half_width == "0.05"
    assert looks_at_rows(plan)
    assert not looks_at_rows(plan_from(settings, "test"))
    with pytest.raises(InputError, match="until_half_width"):
        plan_from({**settings, "until_half_width": 2}, "test")


# The intervals that make this right ---------------------------------------------------------------


def log_ratio(count: int, total: int, p: float) -> float:
    """The logarithm of the mixed likelihood over that of p, by the gamma function alone."""

    def log_beta(a: float, b: float) -> float:
        return math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)

    mixed = log_beta(0.5 + count, 0.5 + total - count) - log_beta(0.5, 0.5)
    likelihood = count * math.log(p) if count else 0.0
    likelihood += (total - count) * math.log1p(-p) if total > count else 0.0
    return mixed - likelihood


@pytest.mark.parametrize(
    ("count", "total"), [(0, 1), (1, 1), (0, 50), (50, 50), (5, 10), (3, 100), (120, 400)]
)
def test_the_sequential_interval_holds_the_rates_that_a_bet_does_not_refute(
    count: int, total: int
) -> None:
    """On a fine grid: inside the interval the ratio is below 20, outside it is not."""
    found = sequential_rate(count, total)
    assert found.low is not None
    assert found.high is not None
    step = 1e-4
    held = [p for p in np.arange(step, 1.0, step) if log_ratio(count, total, p) < math.log(20.0)]
    assert found.low == pytest.approx(held[0] if held[0] > step else 0.0, abs=step)
    assert found.high == pytest.approx(held[-1] if held[-1] < 1 - 1.5 * step else 1.0, abs=step)
    assert all(b - a < 1.5 * step for a, b in pairwise(held))


def test_the_sequential_interval_has_its_limits() -> None:
    """Nothing tried is nothing known; nothing found in n trials has a bound in closed form."""
    nothing = sequential_rate(0, 0)
    assert (nothing.value, nothing.low, nothing.high) == (None, None, None)
    none = sequential_rate(0, 100)
    assert (none.value, none.low) == (0.0, 0.0)
    log_c = math.lgamma(100.5) - math.lgamma(0.5) - math.lgamma(101.0)  # B(1/2, 100.5)/B(1/2, 1/2)
    assert none.high == pytest.approx(1.0 - math.exp((log_c - math.log(20.0)) / 100.0), rel=1e-6)
    every = sequential_rate(100, 100)
    assert (every.value, every.high) == (1.0, 1.0)
    assert every.low == pytest.approx(1.0 - none.high, rel=1e-6)
    huge = sequential_rate(3, 10_000_000)
    assert huge.low is not None
    assert huge.high is not None
    assert 0.0 < huge.low < 3e-7 < huge.high < 3e-6


@pytest.mark.parametrize("total", [1, 2, 7, 40, 1000])
def test_a_sequential_interval_is_the_wider_one(total: int) -> None:
    """It holds the share and Wilson's interval: what it promises costs width, never the estimate.

    Its limits rise with the count, and it is the same seen from the other side.
    """
    shares = sorted({round(total * i / 20) for i in range(21)})
    found = [sequential_rate(count, total) for count in shares]
    for count, known in zip(shares, found, strict=True):
        wilson, mirrored = rate(count, total), sequential_rate(total - count, total)
        assert None not in (known.low, known.high, wilson.low, wilson.high, mirrored.high)
        assert 0.0 <= (known.low or 0.0) <= (wilson.low or 0.0) <= count / total
        assert count / total <= (wilson.high or 0.0) <= (known.high or 0.0) <= 1.0
        assert known.low == pytest.approx(1.0 - (mirrored.high or 0.0), abs=1e-9)
    for below, above in pairwise(found):
        assert (below.low or 0.0) <= (above.low or 0.0)
        assert (below.high or 0.0) <= (above.high or 0.0)


LOOKS = range(10, 301, 10)


@pytest.mark.parametrize("p", [0.05, 0.5])
def test_whoever_stops_at_will_is_still_right_in_95_of_100(p: float) -> None:
    """Of 2,000 batches watched all the time, so many hold the true rate whenever they stop.

    Wilson's intervals, made for a number of trials that was fixed before, miss it at some time
    in far more than one of 20: stopping when they look good would publish wrong rates.
    """
    trials = np.random.default_rng(20_26).random((2_000, max(LOOKS))) < p
    counts = trials.cumsum(axis=1)

    @cache
    def misses(count: int, total: int) -> tuple[bool, bool]:
        known = sequential_rate(count, total), rate(count, total)
        first, second = (not i.overlaps(p, p) for i in known)
        return first, second

    missed = np.zeros((len(counts), 2), dtype=bool)
    for total in LOOKS:
        missed |= [misses(int(count), total) for count in counts[:, total - 1]]
    sequential, wilson = missed.mean(axis=0)
    assert sequential <= 0.05
    assert wilson > 0.15
