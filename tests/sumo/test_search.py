"""The command search with real SUMO: the same rows however it is played, and replays."""

from __future__ import annotations

import dataclasses
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import rows, traces

import cavsumo
from cavsumo.batch import prepared
from cavsumo.cli import main
from cavsumo.errors import Exit, NetworkError
from cavsumo.model.bodies import PEDESTRIAN
from cavsumo.model.scenario import BatchPlan
from cavsumo.network.site import Site
from cavsumo.results.traces import read_trace
from cavsumo.searchers.space import space_of

Capture = pytest.CaptureFixture[str]
RUNS = 32


def _search(file: Path, *more: str, runs: int = RUNS, net: str = "pedestrians") -> int:
    words = ["search", "--net", net, "--ego", "constant", "--runs", str(runs), "-q"]
    return main([*words, "-o", str(file), *more])


def _folder(folder: Path) -> Path:
    """A results file of the same name in a folder of its own, as traces are named by it."""
    folder.mkdir()
    return folder / "found.csv"


def _point(file: Path, row: dict[str, str]) -> Any:
    """What the trace of an episode says that its agents played."""
    return read_trace(file.parent / row["trace"]).head["memory"]


def _continued(whole: Path, folder: Path, *more: str, runs: int = RUNS) -> None:
    """The same search, killed in the middle of a generation and continued, two at a time."""
    half = shutil.copytree(whole.parent, folder) / whole.name
    half.write_bytes(b"".join(half.read_bytes().splitlines(keepends=True)[: 1 + 13]))
    assert _search(half, "--resume", "-j", "2", *more, runs=runs) in (Exit.OK, Exit.VIOLATED)
    assert rows(half) == rows(whole)


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A search whose ego never brakes."""
    file = tmp_path_factory.mktemp("search") / "found.csv"
    assert _search(file) == Exit.VIOLATED
    return file


def test_rows_do_not_depend_on_how_it_is_played(found: Path, tmp_path: Path) -> None:
    """Two at a time; and stopped in the middle of a generation and continued."""
    both = _folder(tmp_path / "both")
    assert _search(both, "-j", "2") == Exit.VIOLATED
    assert rows(both) == rows(found)
    assert traces(both) == traces(found)
    _continued(found, tmp_path / "parts")


@pytest.mark.parametrize("method", ["tree", "explore", "diversity"])
def test_every_searcher_is_continued_from_its_rows(method: str, tmp_path: Path) -> None:
    """Its state is what it was told, in the order of the episodes; a row says how it is played."""
    whole = _folder(tmp_path / "whole")
    _search(whole, "--method", method, runs=18)
    _continued(whole, tmp_path / "half", "--method", method, runs=18)
    played = rows(whole)
    decided = [row["situations"] for row in played if row["situations"]]
    assert bool(decided) is (method != "diversity")
    assert main(["replay", str(whole), "16"]) == 0


def test_a_search_finds_preventable_failures(found: Path) -> None:
    """Every grade stands in its row, from 0 on for preventable failures alone."""
    played = rows(found)
    failed = [row for row in played if row["outcome"] == "violated" and row["avoidable"] == "1"]
    assert failed
    assert [row for row in played if float(row["grade"]) >= 0.0] == failed
    for row in failed:
        assert float(row["grade"]) == pytest.approx(float(row["impact_speed_mps"]), abs=2e-3)


def test_a_point_is_replayed_from_its_trace_and_from_the_rows(
    found: Path, tmp_path: Path, capsys: Capture
) -> None:
    """Without traces the rows before it tell the searcher what to ask for."""
    run = next(row["run"] for row in rows(found)[11:] if row["outcome"] == "violated")
    assert main(["replay", str(found), run]) == 0
    assert "the same" in capsys.readouterr().out
    bare = tmp_path / "bare.csv"
    assert _search(bare, "--trace", "none") == Exit.VIOLATED
    assert main(["replay", str(bare), run]) == 0
    assert "the same" in capsys.readouterr().out


@pytest.mark.parametrize("kind", ["car", "bicycle"])
def test_vehicles_are_searched_and_replayed(kind: str, tmp_path: Path, capsys: Capture) -> None:
    """With a second one; rows two at a time, and replays from trace and rows, are the same."""
    one, both = (_folder(tmp_path / name) for name in ("one", "both"))
    words = ["--kind", kind, "--testers", "2", "--exit-zero"]
    assert _search(one, *words, runs=10, net="crossing") == 0
    assert _search(both, *words, "-j", "2", "--trace", "none", runs=10, net="crossing") == 0
    bare = [row | {"trace": ""} for row in rows(one)]
    assert rows(both) == bare
    failed = [row for row in rows(one) if row["outcome"] == "violated"]
    assert any(row["avoidable"] == "1" for row in failed)
    capsys.readouterr()
    for file in (one, both):
        assert main(["replay", str(file), failed[-1]["run"]]) == 0
        assert "the same" in capsys.readouterr().out


def test_the_summary_names_common_features(tmp_path: Path, capsys: Capture) -> None:
    """How many failures, how many kinds, when the first came; with none, what was seen."""
    words = ["search", "--net", "pedestrians", "--runs", "10", "--method", "random"]
    out = ["-o", str(tmp_path / "a.csv")]
    assert main([*words, *out, "--ego", "constant", "--exit-zero"]) == 0
    said = capsys.readouterr().out
    assert "distinct, in 10 episodes and" in said
    assert "the first after" in said
    assert "in common: pedestrian from " in said
    assert main([*words, "-o", str(tmp_path / "b.csv"), "--ego", "time-gap", "--exit-zero"]) == 0
    said = capsys.readouterr().out
    assert "search: no preventable failure in 10 episodes" in said
    assert "of the 10 points drawn at random none failed, so at most 30.8% of the space" in said


def test_an_episode_ends_when_nobody_can_meet_the_ego(tmp_path: Path, capsys: Capture) -> None:
    """Outcomes and grades are those of the whole episodes; that the ego arrived is not known."""
    files = tmp_path / "cut.csv", tmp_path / "whole.csv"
    for file, words in zip(files, ([], ["--param", "cut=false"]), strict=True):
        _search(file, "--method", "random", "--trace", "all", *words, runs=16)
    cut, whole = map(rows, files)
    learned = "outcome", "verdicts", "avoidable", "impact_speed_mps", "trigger_time_s", "grade"
    assert [[r[c] for c in learned] for r in cut] == [[r[c] for c in learned] for r in whole]
    shorter = [i for i, r in enumerate(cut) if float(r["time_s"]) < float(whole[i]["time_s"])]
    assert shorter
    for i in shorter:
        assert (cut[i]["arrived"], cut[i]["lost_s"], whole[i]["arrived"]) == ("", "", "1")
    for words in ([], ["--playback"]):
        capsys.readouterr()
        assert main(["replay", str(files[0]), str(shorter[0]), *words]) == 0
        assert "the same" in capsys.readouterr().out


@pytest.mark.parametrize("method", ["portfolio", "cma", "explore"])
def test_a_search_begins_with_what_an_earlier_one_found(
    method: str, found: Path, tmp_path: Path
) -> None:
    """Its best points are played first; decisions are no points of a search by programmes."""
    earlier = ["--param", f"search.earlier={found}", "--method", method]
    whole = _folder(tmp_path / "whole")
    assert _search(whole, *earlier, runs=18) == Exit.VIOLATED
    _continued(whole, tmp_path / "half", *earlier, runs=18)
    first, best = rows(whole)[0], max(rows(found), key=lambda row: float(row["grade"]))
    assert bool(first["situations"]) is (method == "explore")
    assert method == "explore" or _point(whole, first) == _point(found, best)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--testers", "2"], "is of another space: testers was 1, is 2"),
        (["--ego", "sumo"], "or how often the ego decides was another one"),
        (
            ["--param", "search.within=side=left"],
            "is of another space: search.within was '', is 'side=left'",
        ),
    ],
)
def test_an_earlier_search_of_another_space_is_refused(
    more: list[str], said: str, found: Path, tmp_path: Path, capsys: Capture
) -> None:
    """One sentence, and nothing is written."""
    file = tmp_path / "no.csv"
    assert _search(file, "--param", f"search.earlier={found}", *more) == Exit.USAGE
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("method", ["portfolio", "random"])
def test_the_packages_that_chose_the_points_are_recorded(
    method: str, tmp_path: Path, capsys: Capture
) -> None:
    """Another version of them continues no search, and chose other points of an earlier one."""
    file = _folder(tmp_path / "r")
    assert _search(file, "--method", method, "--exit-zero", runs=1) == Exit.OK
    manifest = file.with_suffix(".json")
    recorded = json.loads(manifest.read_text(encoding="utf-8"))
    assert ("cma" in recorded["versions"]) is (method == "portfolio")
    assert main(["replay", str(file), "0"]) == Exit.OK
    assert "cma" not in capsys.readouterr().err
    recorded["versions"]["cma"] = "0.1"
    manifest.write_text(json.dumps(recorded), encoding="utf-8")
    again = ["--method", method, "--exit-zero"]
    assert _search(file, *again, "--resume", runs=2) == Exit.USAGE
    assert "versions: cma was 0.1, is" in capsys.readouterr().err
    other = tmp_path / "no.csv"
    assert _search(other, "--param", f"search.earlier={file}", *again) == Exit.USAGE
    assert "its points were chosen with cma 0.1, not" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--method", "explor"], "unknown method 'explor'; did you mean 'explore'?"),
        (["--param", "search.method=tre"], "unknown method 'tre'; did you mean 'tree'?"),
        (["--kind", "car", "--method", "tree"], "search.method tree: decides for pedestrian"),
        (["--param", "search.within=speed=1.2:0.4"], "is the wrong way round; write speed=0.4:1.2"),
        (["--shard", "1/2"], "shard 1/2: search"),
    ],
)
def test_a_search_that_is_impossible_is_refused(
    words: list[str], said: str, tmp_path: Path, capsys: Capture
) -> None:
    """One sentence, and nothing is written."""
    file = tmp_path / "no.csv"
    assert _search(file, *words) == Exit.USAGE
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_space_is_derived_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The check of a batch and its search share it."""
    derived = []
    monkeypatch.setattr(
        prepared, "space_of", lambda *a, **b: derived.append(a) or space_of(*a, **b)
    )
    assert _search(tmp_path / "found.csv", "--exit-zero", runs=2) == 0
    assert len(derived) == 1


@pytest.mark.parametrize("other", [("--testers", "2"), ("--param", "search.within=side=left")])
def test_another_space_is_not_continued(
    other: tuple[str, str], found: Path, capsys: Capture
) -> None:
    """Two testers have other points than one, and bounds make others of them."""
    assert _search(found, "--resume", *other) == Exit.USAGE
    key, *_ = other[1].split("=") if "=" in other[1] else ("testers",)
    assert key in capsys.readouterr().err


def test_a_bounded_search_is_continued(tmp_path: Path) -> None:
    """All bodies come from one side, slowly; the same rows after an interruption."""
    bounds = "--param", "search.within=side=left speed=0.3:0.6", "--exit-zero"
    whole = _folder(tmp_path / "whole")
    assert _search(whole, *bounds, runs=18) == 0
    _continued(whole, tmp_path / "half", *bounds, runs=18)
    met = [row for row in rows(whole) if row["from_side"]]
    assert {row["from_side"] for row in met} <= {"left"}
    assert met


def test_a_route_that_nobody_can_meet_is_refused(
    staged: Callable[..., tuple[BatchPlan, Site]],
) -> None:
    """The sentence names the network and the way out."""
    _, site = staged("pedestrians")
    with pytest.raises(NetworkError, match="a search finds no place for a pedestrian"):
        space_of(dataclasses.replace(site, areas=()), PEDESTRIAN, ((0,),))


def test_python_searches_alike(found: Path, tmp_path: Path) -> None:
    """The same rows as the command; an agent cannot be chosen."""
    how: dict[str, Any] = {"ego": "constant", "runs": RUNS, "progress": False}
    results = cavsumo.search("pedestrians", output=_folder(tmp_path / "api"), **how)
    assert rows(results.file) == rows(found)
    with pytest.raises(cavsumo.InputError, match="search: agents"):
        cavsumo.search("pedestrians", agents=["timing"], **how)
