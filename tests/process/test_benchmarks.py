"""Every script of benchmarks/ and experiments/, played once at its smallest size."""

from __future__ import annotations

import importlib
import importlib.util
import json
import re
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from inline import cavsumo
from support import CHROMIUM, ROOT, benchmark

from cavsumo.assertions import ASSERTIONS, criticality_monitor

pytestmark = pytest.mark.usefixtures("inline")
NET = str(ROOT / "networks" / "pedestrians.net.xml")
Play = Callable[..., str]


@pytest.fixture
def play(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Iterator[Play]:
    """Call with a benchmark, its words and values of its constants: what it prints."""
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    own = set(ASSERTIONS)

    loaded: list[str] = []

    def played(name: str, *words: str, **constants: Any) -> str:
        monkeypatch.delitem(sys.modules, name, raising=False)
        module = importlib.import_module(name)
        loaded.append(name)
        for constant, value in constants.items():
            assert hasattr(module, constant)
            monkeypatch.setattr(module, constant, value)
        monkeypatch.setattr(sys, "argv", [f"{name}.py", *words])
        module.main()
        return capsys.readouterr().out

    yield played
    for name in set(ASSERTIONS) - own:  # a benchmark may register one
        del ASSERTIONS._entries[name]
        ASSERTIONS.names._others.discard(name)
    for name in loaded:
        sys.modules.pop(name, None)


def numbers(line: str) -> list[float]:
    """The numbers in a line."""
    return [float(word) for word in re.findall(r"-?\d+\.?\d*(?:e[-+]\d+)?", line)]


ELSEWHERE = {  # libraries, and the fuzz with its cases
    "rings": "unit/test_games.py",
    "storm": "unit/test_games_random.py",
    "fuzz": "sumo/test_fuzz.py",
    "fuzz_cases": "sumo/test_fuzz.py",
    "fuzz_inputs": "sumo/test_fuzz.py",
}


def test_every_benchmark_is_played_here() -> None:
    """Scripts that are added get a test, too, here or where ELSEWHERE says."""
    here = Path(__file__).read_text(encoding="utf-8")
    scripts = {file.stem for file in (ROOT / "benchmarks").glob("*.py")} - set(ELSEWHERE)
    for name, file in ELSEWHERE.items():
        assert name.split("_")[0] in (ROOT / "tests" / file).read_text(encoding="utf-8")
    assert scripts == set(re.findall(r'play\(\s*"(\w+)"', here))


@pytest.mark.parametrize("agent", ["search", "exposure"])
def test_early_end(play: Play, agent: str) -> None:
    """The same is learned of every point, in less time."""
    words = "--net", NET, "--ego", "constant", "--runs", "30", "--agent", agent
    found = play("early_end", *words).splitlines()[1]
    runs, cut, differ, whole, shorter = numbers(found)[:5]
    assert (runs, differ) == (30, 0)
    assert cut > 0
    assert shorter < whole


def test_searches(play: Play) -> None:
    """A search and another agent, two seeds each."""
    words = "--ego", "constant", "--runs", "10", "--seed", "1", "2"
    _, _, *found = play("searches", NET, *words).splitlines()
    assert [row.split()[1] for row in found] == ["search:portfolio", "timing"]
    assert all(row.split()[2] in ("0/2", "1/2", "2/2") for row in found)


def test_rare_events(play: Play) -> None:
    """Two replications of one process: the truth, and a gain."""
    _, row = play("rare_events", "--p3", "0.003", "--replications", "2").splitlines()
    assert numbers(row)[0] == 1.141e-05
    assert numbers(row)[6] > 1e3
    assert row.endswith("p3 0.003")


def test_estimators(play: Play) -> None:
    """Two replications of each method on each function; probabilities are known."""
    _, *found = play("estimators", "--replications", "2", "--episodes", "200").splitlines()
    assert [row.split()[2] for row in found[:6]] == [
        "auto", "monte-carlo", "stratified", "importance", "sobol", "subset",
    ]  # fmt: skip
    words = "--replications", "2", "--half-width", "5", "--method", "monte-carlo"
    _, early = play("estimators", *words, "--function", "corners").splitlines()
    assert float(early.split()[7]) < 2000
    assert {row.split()[0]: row.split()[1] for row in found} == {
        "corner": "1.0e-04", "corners": "1.0e-03", "ball": "1.2e-04", "scattered": "1.0e-03",
        "pedestrian": found[-7].split()[1], "lights": "2.1e-03",
    }  # fmt: skip


def test_estimates(play: Play) -> None:
    """A truth, and two estimates of few episodes by each method."""
    words = "--net", "pedestrians", "--ego", "constant", "--truth", "20"
    words += "--replications", "2", "--episodes", "20"
    words += "--method", "auto", "--method", "monte-carlo"
    truth, _, *methods = play("estimates", *words).splitlines()
    assert truth.startswith("truth: ")
    assert " in 20 episodes of " in truth
    assert [row.split()[0] for row in methods] == ["auto", "monte-carlo"]


def test_estimates_beside_a_kept_truth(play: Play) -> None:
    """Blocks of the long run are the estimates of Monte Carlo; another network is refused."""
    kept = "--kept", str(ROOT / "benchmarks" / "truth" / "crossing.json")
    truth, _, row = play("estimates", *kept, "--method", "monte-carlo").splitlines()
    assert truth.startswith("truth: 178 failures in 100000 episodes")
    assert row.split()[:2] == ["monte-carlo", "1.00"]
    with pytest.raises(SystemExit, match="is of net crossing, not junction"):
        play("estimates", *kept, "--net", "junction")


def test_drivers_under_an_exposure(play: Play, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two drivers, ten episodes each."""
    monkeypatch.syspath_prepend(str(ROOT / "experiments" / "search"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "experiments" / "search"))
    words = "--net", "pedestrians", "--ego", "constant", "--ego", "faulty_drivers:Careful"
    _, _, *rows = play("exposed_drivers", *words, "--max-episodes", "10").splitlines()
    assert [row.split(" | ")[0] for row in rows] == ["| constant", "| Careful"]
    assert all(row.split(" | ")[2] == "10" for row in rows)
    assert rows[1].split(" | ")[3] == "0"


def test_reference_tracks(play: Play) -> None:
    """One cell: the largest differences are within the tolerances."""
    test, everything = play("reference_tracks", "--only", "CPFA/60/50").splitlines()[1:]
    assert (test.split()[:2], everything.split()[0]) == (["CPFA", "1"], "all")
    place, speed, impact = numbers(everything)[1:]
    assert place < 0.05
    assert speed < 0.05
    assert impact < 0.02


def test_un_r157(play: Play) -> None:
    """The grid of decelerations, without a collision, as published."""
    (line,) = play("un_r157", "--test", "deceleration").splitlines()[1:]
    assert line.split() == ["deceleration", "1,121", "0", "0"]


def test_searched_vehicles(play: Play) -> None:
    """A line for each tester; nobody reaches a conclusion in two episodes."""
    wanted = ["--tester", "search:random", "--tester", "timing", "--runs", "2", "--seed", "1"]
    crossing = str(ROOT / "networks" / "crossing.net.xml")
    lines = play("searched_vehicles", crossing, "--kind", "bicycle", *wanted).splitlines()[2:]
    cells = [line.split()[:5] for line in lines]
    names = [["crossing", "bicycle", tester] for tester in ("search:random", "timing")]
    assert [row[:3] for row in cells] == names
    assert all(row[3] in ("0/1", "1/1") for row in cells)


def test_ast_crosswalk(play: Play) -> None:
    """A few episodes of each starting point, and one draw of each in SUMO."""
    lines = play("ast_crosswalk", "--episodes", "50", "--sumo", "1").splitlines()[1:]
    assert [line.split()[0] for line in lines] == ["start-1", "start-2", "start-3"]
    assert all("of 50" in line and line.endswith("alike 1") for line in lines)


def test_crosswalks(play: Play) -> None:
    """One estimate by each method on a starting point, with a truth that is given."""
    words = "start-2", "--counted", "107", "10000", "--runs", "200", "--replications", "2"
    truth, _, *found = play("crosswalks", *words).splitlines()
    assert truth.startswith("start-2: 107 failures in 10000 episodes: 0.0107 [")
    assert [row.split()[0] for row in found] == ["shifts", "splitting"]
    assert all(numbers(row)[5] > 1000 for row in found)


def test_street_suites(play: Play) -> None:
    """One draw of each tester and number of pedestrians in one suite."""
    lines = play("street_suites", "--suite", "chance-2019", "--draws", "1", "-j", "1").splitlines()
    assert len(lines) == 17
    assert lines[-1].split()[:3] == ["chance-2019", "election", "10"]


def test_avoidable(play: Play) -> None:
    """One ego, one agent, both reference drivers."""
    said = play("avoidable", "--runs", "1", "-j", "1", EGOS=("constant",), AGENTS=("random",))
    assert [line.split()[:2] for line in said.splitlines()[1:]] == [
        ["constant", "random"],
        ["constant", "all"],
    ]


def test_aims(play: Play) -> None:
    """Two episodes of each aim, of which the first explores."""
    words = "--runs", "2", "--explore", "1", "--net", NET
    found = play("aims", *words).splitlines()[1:]
    assert [line.split()[:3] for line in found] == [
        ["pedestrians", "preventable", "1"],
        ["pedestrians", "violation", "1"],
    ]


def test_best_response(play: Play) -> None:
    """One episode each of learning, of timing and of what was learned."""
    said = play(
        "best_response", "--train", "1", "--runs", "1", "--jobs", "1",
        "--net", "pedestrians", "--ego", "constant",
    )  # fmt: skip
    assert [line.split()[2] for line in said.splitlines()[1:]] == ["timing", "best-response"]
    assert "could not be played" not in said


def test_branching(play: Play, capsys: pytest.CaptureFixture[str]) -> None:
    """A few branches by both ways, one prefix, what is left of two, the verdicts of an episode."""
    words = "--net pedestrians --branches 5 --costs 1 --many 2 --failures 1".split()
    with pytest.raises(SystemExit) as ended:
        play("branching", *words, PREFIXES=(5,))
    said = capsys.readouterr().out
    assert ended.value.code == 0, said
    assert said.count("5 of 5 branches the same (0 errors), 1 of 1 episodes") == 2
    assert "refused  pedestrians" in said
    assert "by fork" in said
    before, after, _ = said.split("before 2 branches: ")[1].splitlines()[0].split("; ")
    assert before.rpartition(",")[0] == after.removeprefix("after: ").rpartition(",")[0]
    assert "verdicts the same" in said


def test_budget(play: Play) -> None:
    """Parts of a few episodes, which add up."""
    said = play("budget", "--net", NET, "--testers", "1", "--episodes", "5")
    parts, together = said.splitlines()[1:-1], said.splitlines()[-1]
    total = numbers(together)[-1]
    assert total > 0.0
    assert sum(numbers(line)[-1] for line in parts) == pytest.approx(total, abs=0.05 * len(parts))


def test_cav_gym(play: Play) -> None:
    """One episode a cell, and two of the timing tester."""
    said = play("cav_gym", "--runs", "1", "--timing-runs", "2")
    assert len(re.findall(r"^\S+ +[136] .*(?:yes|NO)$", said, re.MULTILINE)) == 12


def test_chaos(play: Play) -> None:
    """One episode, and no time for a kill: the batches are equal."""
    said = play("chaos", "--runs", "1", "--kills-every", "60", NET=NET)
    assert said.count("equal: True") == 2


def test_collisions(play: Play) -> None:
    """An episode of one setup."""
    said = play(
        "collisions", "--episodes", "1", "--examples",
        NETWORKS=("pedestrians",), AGENTS=("timing",), EGOS=("constant",), SHOWN=("wide-vehicle",),
    )  # fmt: skip
    assert said.startswith("1 episodes; 0 more in which SUMO died")


def test_criticality(play: Play, monkeypatch: pytest.MonkeyPatch) -> None:
    """An episode of each network."""
    for names in benchmark("criticality").PARTS.values():
        for name in names:  # so that it is put back afterwards
            monkeypatch.setattr(criticality_monitor, name, getattr(criticality_monitor, name))
    said = play("criticality", "--episodes", "1")
    assert [line.split()[0] for line in said.splitlines()[1:]] == [
        "crossing",
        "junction",
        "pedestrians",
    ]
    assert said.count("%") == 6


def test_environments(play: Play) -> None:
    """An episode in every form."""
    said = play("environments", "--episodes", "1", "--net", NET, ROUNDS=1)
    assert said.splitlines()[1].endswith("1.00 of play")
    assert len(said.splitlines()) == 5


def test_external_ego(play: Play) -> None:
    """An episode of each form, the same in all."""
    said = play("external_ego", "--episodes", "1", "--net", NET)
    assert said.startswith("1 episodes, ")
    assert "its exchange with a program that looks at nothing" in said


def test_forecasts(play: Play) -> None:
    """Two starts of each tester."""
    said = play("forecasts", "--runs", "2", "--timing-runs", "2")
    assert "right: 2 of 2" in said
    assert "tests in the first 2 starts" in said


def test_games(play: Play) -> None:
    """A small problem of each sort, without Storm."""
    said = play("games", "--mdp", "8", "--game", "16", "--rounds", "1", "--no-storm")
    assert [line.split()[:2] for line in said.splitlines()[1:3]] == [
        ["MDP", "120"],
        ["game", "1200"],
    ]


def test_memory(play: Play) -> None:
    """A hundred stubs and twenty real episodes of half a second."""
    said = play("memory", "--stubs", "100", "--episodes", "20")
    assert said.count("stubs: ") >= 2
    assert said.count("episodes: ") == 3


def test_minimise(play: Play) -> None:
    """A failure at the crossing, by force too, and with planted bodies."""
    said = play(
        "minimise", "--failures", "1", "--runs", "20", "--force", "1", "--planted", "1",
        "--setting", "crossing, pedestrians", PLANTED=5,
    )  # fmt: skip
    _, one, everything, force, planted = said.splitlines()
    assert one.split()[2:7] == ["1", "1", "1", "1", "1"]
    assert everything.split()[1:] == one.split()[2:]
    assert re.fullmatch(r"by force: 0 of \d+ single reductions of 1 results fail the same", force)
    assert planted.startswith("planted: 5 bodies in ")


def test_exports(play: Play) -> None:
    """A failure, exported and imported again; read by commonroad-io and played, where they are."""
    words = ["--net", "crossing", "--failures", "1", "--runs", "3"]
    there = importlib.util.find_spec("commonroad") is not None
    words += ["--commonroad", sys.executable] if there else []
    _, one, everything = play("exports", *words, KINDS=("pedestrian",)).splitlines()
    assert one.split()[2:] == everything.split()[1:]
    failures, issues, places, far, turned, missing, same, _, read, _, imported = numbers(everything)
    assert (failures, issues, missing, imported) == (1, 0, 0, 2)
    assert (far < 0.02, turned < 0.01) == (True, True)
    assert read == there
    if shutil.which("esmini"):
        assert (places > 100, same) == (True, 1)


def test_transfer(play: Play) -> None:
    """One test at one place, in each form."""
    said = play(
        "transfer", "--tests", "1", "--runs", "8", "--places", "1", "--seeds", "1",
        "--net", "crossing",
    )  # fmt: skip
    lines = said.splitlines()
    assert lines[0].startswith("1 minimal tests")
    assert [line.split("|")[1:3] for line in lines[3::2]] == [
        [" crossing, in the zone ", " 1 "],
        [" crossing, in the phase ", " 1 "],
    ]


def test_overlaps(play: Play) -> None:
    """An episode on the straight road, with drawn traffic."""
    said = play("overlaps", "--net", NET, "--agent", "timing", "--runs", "1")
    assert said.splitlines()[1].split()[:3] == ["pedestrians", "timing", "1"]


def test_places(play: Play) -> None:
    """One place, one ego, two agents of which one learns for an episode."""
    words = "--runs 1 --learn 1 --traffic 0 -j 1 --ego time-gap --agent timing"
    said = play("places", NET, *words.split(), "--agent", "best-response")
    lines = [line.split() for line in said.splitlines()[1:]]
    assert [line[:3] for line in lines] == [
        ["pedestrians", "time-gap", "timing"],
        ["pedestrians", "time-gap", "best-response"],
    ]
    assert {len(line) for line in lines} == {11}


def test_drivers(play: Play) -> None:
    """Two egos that are built in, and a program in the place of a planner."""
    words = "--runs 1 --traffic 0 --agent timing --ego time-gap --ego sumo:IDM/0 --planner"
    program = {"careful": "../egos/stop_for_pedestrians.py"}
    said = play("drivers", NET, *words.split(), f"careful={sys.executable}", SCRIPTS=program)
    lines = [line.split() for line in said.splitlines()[1:]]
    assert [(line[0], line[-1]) for line in lines] == [
        ("time-gap", "0"),
        ("sumo:IDM/0", "0"),
        ("careful", "0"),
    ]


def test_pages(play: Play) -> None:
    """Two seconds of an episode, on one screen."""
    if CHROMIUM is None:
        pytest.skip("no chromium here: apt-get install chromium")
    pytest.importorskip("playwright.sync_api", reason="no playwright: pip install playwright")
    module = benchmark("pages")
    settings = module.SETTINGS | {"end": 2.0, "assertions": ["collision"]}
    screens = {"laptop": module.SCREENS["laptop"]}
    said = play("pages", "--chromium", CHROMIUM, SETTINGS=settings, SCREENS=screens)
    assert said.count("between two drawings") == 1


def test_playback(play: Play) -> None:
    """An episode of one batch."""
    batches = {"straight": {"net": "pedestrians", "agents": ["timing"], "end": 5.0}}
    with pytest.raises(SystemExit) as ended:
        play("playback", "--runs", "1", BATCHES=batches)
    assert not ended.value.code


def test_refusals(play: Play) -> None:
    """The help and one refusal."""
    said = play("refusals", "--rounds", "1", COMMANDS=("--help", "agents timming"))
    assert "agents timming" in said


def test_replays(play: Play, capsys: pytest.CaptureFixture[str]) -> None:
    """Both episodes of one batch."""
    batches = {"straight": {"net": "pedestrians", "agents": ["timing", "noop"], "end": 5.0}}
    with pytest.raises(SystemExit) as ended:
        play("replays", "--replays", "2", "--runs", "1", BATCHES=batches)
    assert not ended.value.code
    assert numbers(capsys.readouterr().out.splitlines()[-2]) == [1, 1, 0]


def test_episode_server(
    play: Play, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three episodes of one setting; a thread that other tests have left holds nothing."""
    monkeypatch.setattr("cavsumo.batch.episode_server.can_fork", lambda: True)
    words = ["--net", NET, "--episodes", "1", "--relative", "1", "--many", "2"]
    with pytest.raises(SystemExit) as ended:
        play("episode_server", *words, SETTINGS={"defaults": {"end": 3.0}})
    said = capsys.readouterr().out.splitlines()
    assert not ended.value.code, said
    assert "3 of 3 the same" in said[0]
    assert "before and after 2 episodes" in said[1]
    assert said[-1].endswith("(1.00)")


def test_reading(play: Play) -> None:
    """A small network, once."""
    assert "1 site" in play("reading", "--net", NET, "--times", "1")


def test_scale(play: Play, capsys: pytest.CaptureFixture[str]) -> None:
    """Four episodes for eight rows, read by this checkout twice."""
    with pytest.raises(SystemExit) as ended:
        play("scale", "--rows", "8", "--played", "2", "--other", str(ROOT))
    said = capsys.readouterr().out
    assert ended.value.code == 0, said
    assert said.count("the same bytes") == 3


def test_soak(play: Play, capsys: pytest.CaptureFixture[str]) -> None:
    """Three episodes, and no time for a kill."""
    with pytest.raises(SystemExit) as ended:
        play("soak", "--episodes", "3", "--quiet", "2", "--kills-every", "1000", "-j", "1")
    said = capsys.readouterr().out
    assert ended.value.code == 0, said
    assert "0 errors, 0 after --retry-errors; 0 rows missing, in order: True" in said


def test_speed(play: Play) -> None:
    """Two episodes of this version beside itself, and the command."""
    words = ["--net", NET, "--testers", "1", "--episodes", "2", "--rounds", "1"]
    said = play("speed", *words, "--other", str(ROOT))
    lines = said.splitlines()
    assert len(lines) == 3
    for line in lines[1:]:
        bare, *others = numbers(line.partition(ROOT.name)[2])
        assert bare > 0.0
        assert len(others) == 6  # alone, whole, command, each with its ratio


def test_suite_drivers(play: Play) -> None:
    """Two drivers through one case."""
    words = ["--ego", "constant", "--ego", "sumo:IDM/0", "--only", "CPNA/30/50", "-j", "1"]
    _, first, second, _ = play("suite_drivers", *words).splitlines()
    assert first.split()[:4] == ["constant", "0", "of", "1"]
    assert second.split()[:4] == ["sumo:IDM/0", "1", "of", "1"]


def test_drivers_table(play: Play) -> None:
    """One driver, one case of each suite, one episode on one network."""
    words = [NET, "--ego", "constant", "--ncap", "372", "--r157", "36941", "--runs", "1"]
    _, _, line, _, head, _, by_test = play("drivers_table", *words, "--traffic", "0").splitlines()
    assert line.startswith("| constant | 0 of 1 [0, 79 %] | 10.0 | ")
    assert (head, by_test) == ("| ego | CPNA |", "| constant | 0/1, 10 |")


def test_ssm(play: Play) -> None:
    """It has no size: all encounters."""
    assert len(play("ssm").splitlines()) > 3


def test_throughput(play: Play) -> None:
    """Two episodes, with cars that wander about."""
    said = play("throughput", "--episodes", "2", "--cars", "2", "--net", NET)
    shares = [numbers(line)[-1] for line in said.splitlines() if line.endswith("%")]
    assert len(shares) == 8
    assert sum(shares) == pytest.approx(100.0, abs=0.5)
    assert "contacts and assertions" in said


def test_traces(play: Play) -> None:
    """One episode of one network."""
    said = play("traces", "--episodes", "1", "--rounds", "1", NETWORKS=("pedestrians",))
    lines = said.splitlines()
    assert lines[0].startswith("pedestrians: 1 traces, ")
    shares = [numbers(line)[1] for line in lines if "level" in line]
    assert len(shares) == 5
    assert shares[0] < 50.0
    assert shares == sorted(shares, reverse=True)


# Experiments --------------------------------------------------------------------------------------


def script(name: str) -> ModuleType:
    """A module of experiments/, which is no package."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "experiments" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


STUDY = f"""
net = "{NET}"
routes = "none"
agents = ["programmed-random", "nearest=election"]
runs = 2
end = 5
trace = "none"

[[vary.place]]
name = "straight"
ego = "constant"

[vary]
testers = [1, 3]
"""


@pytest.mark.parametrize(("name", "tables"), [("tables", 4), ("games", 1)])
def test_the_tables_of_the_experiments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, tables: int
) -> None:
    """Of a study of four episodes, on a page of its own."""
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    words = ["run", "-c", "study.toml", "-o", "small.csv", "-q", "--exit-zero"]
    assert cavsumo(tmp_path, *words).returncode == 0
    monkeypatch.syspath_prepend(str(ROOT / "experiments"))
    sys.modules.pop("tables", None)
    module = script(name)
    where = sys.modules.get("tables", module)
    written: dict[str, list[str]] = {}
    monkeypatch.setattr(
        module, "write_tables", lambda found: written.update({k: [*v] for k, v in found.items()})
    )
    (tmp_path / "peers.csv").write_bytes((ROOT / "experiments" / "peers.csv").read_bytes())
    monkeypatch.setattr(where, "HERE", tmp_path)
    files = [str(tmp_path / f"small-straight-testers{n}.csv") for n in (1, 3)]
    monkeypatch.setattr(sys, "argv", [name, *files])
    module.main()
    sys.modules.pop("tables", None)
    assert len(written) == tables
    assert len(written["rates" if name == "tables" else "games"]) == 2 + 2 * (1 + (name == "games"))
    assert (tmp_path / "agency.csv").is_file() == (name == "tables")


@pytest.mark.parametrize(
    ("drivers", "driver"),
    [("faulty_drivers", "SeesTheNearestOnly"), ("other_drivers", "YieldsToOne")],
)
def test_scores_against_faulty_drivers(
    drivers: str,
    driver: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    """One driver, ten episodes of a search and of timing; the table once more from the file."""
    monkeypatch.syspath_prepend(str(ROOT / "experiments" / "search"))
    monkeypatch.setenv("PYTHONPATH", "")
    file = str(tmp_path / "trials.jsonl")
    words = ["--drivers", drivers, "--driver", driver, "--seed", "1", "--episodes", "10", "-j", "1"]
    monkeypatch.setattr(sys, "argv", ["score.py", *words, "--net", "pedestrians", "-o", file])
    script("search/score").main()
    table = capsys.readouterr().out
    first, *_, last = table.splitlines()
    assert first.split() == ["driver", "portfolio", "timing"]
    assert last.startswith("timing: a faulty driver failed in ")
    assert " of 1 trials" in last
    trials = [json.loads(line) for line in Path(file).read_text(encoding="utf-8").splitlines()]
    assert [(t["driver"], t["testers"]) for t in trials] == [(driver, 2)] * 2
    monkeypatch.setattr(sys, "argv", ["score.py", "--read", file])
    script("search/score").main()
    assert capsys.readouterr().out == table
