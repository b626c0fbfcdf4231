"""The command estimate with real SUMO: the same digits however it is played, and replays."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from support import rows

import cavsumo
from cavsumo.batch.estimated import estimated
from cavsumo.cli import main
from cavsumo.errors import Exit
from cavsumo.report.estimates import as_json
from cavsumo.report.estimates import words as sentences

Capture = pytest.CaptureFixture[str]
MOST = 100  # from which pilots learn
OFTEN = "[attention]\ninattentive = 1.0\n[arrivals]\nwithin_s = 6.0\n"


def _estimate(file: Path, *more: str, most: int = MOST) -> int:
    words = ["estimate", "--net", "pedestrians", "--ego", "constant", "--trace", "none"]
    words += ["--max-episodes", str(most), "--half-width", "0.05", "-o", str(file)]
    return main([*words, *more])


FAST = """
[speed_mps]
distribution = "normal"
mean = 9.0
sd = 0.1
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two exposures: an ego that never brakes fails often, and nobody can walk."""
    found = tmp_path_factory.mktemp("estimate")
    (found / "often.toml").write_text(OFTEN, encoding="utf-8")
    (found / "fast.toml").write_text(FAST, encoding="utf-8")
    return found


@pytest.fixture(scope="module")
def found(folder: Path) -> Path:
    """The results of an estimate."""
    file = folder / "found.csv"
    assert _estimate(file, "-q", "--exposure", str(folder / "often.toml")) == Exit.OK
    return file


def test_digits_do_not_depend_on_how_it_is_played(
    found: Path, folder: Path, tmp_path: Path
) -> None:
    """Two at a time; and cut off in the middle of a generation and continued."""
    often = "--exposure", str(folder / "often.toml")
    both = folder / "both.csv"
    assert _estimate(both, "-q", "-j", "2", *often) == Exit.OK
    assert rows(both) == rows(found)
    parts = shutil.copytree(folder, tmp_path / "cut") / found.name
    kept = parts.read_bytes().splitlines(keepends=True)[: 1 + 17]
    parts.write_bytes(b"".join(kept))
    assert estimated(parts).refused == "it was cut short; --resume goes on"
    assert _estimate(parts, "-q", "--resume", *often) == Exit.OK
    assert rows(parts) == rows(found)
    assert as_json(estimated(parts)) == as_json(estimated(found))


def test_a_finished_estimate_is_not_played_on(found: Path, folder: Path, capsys: Capture) -> None:
    """Resumed with more episodes than it needed, it prints the same result."""
    file = folder / "ended.csv"
    often = "--exposure", str(folder / "often.toml"), "--bound", "0.9", "-q", "--json"
    assert _estimate(file, *often, most=400) == Exit.OK
    first = json.loads(capsys.readouterr().out)
    assert first["ended"] == "the upper bound is at most 0.9"
    assert first["episodes"] < 400
    assert _estimate(file, *often, "--resume", most=400) == Exit.OK
    assert json.loads(capsys.readouterr().out) == first


def test_an_encounter_is_replayed_from_the_rows(found: Path, capsys: Capture) -> None:
    """Without a trace, as the rows before it tell the estimator what to ask for."""
    run = next(row["run"] for row in rows(found)[20:] if row["outcome"] == "violated")
    assert main(["replay", str(found), run]) == 0
    assert "the same" in capsys.readouterr().out


def test_the_result_is_that_of_the_rows(found: Path, folder: Path, capsys: Capture) -> None:
    """The share of preventable failures, an hour's number, and a picture of the looks."""
    often, picture, most = folder / "often.toml", folder / "picture.svg", 40
    words = "--exposure", str(often), "--method", "monte-carlo", "--picture", str(picture)
    assert _estimate(folder / "plain.csv", *words, most=most) == Exit.OK
    said = capsys.readouterr().out
    failed = [r for r in rows(folder / "plain.csv") if r["grade"] and float(r["grade"]) >= 0.0]
    assert failed
    assert f"an encounter: {len(failed) / most:.3g} [" in said
    assert f"in an hour of exposure (60 arrivals): {60 * len(failed) / most:.3g} [" in said
    assert "<svg" in picture.read_text(encoding="utf-8")
    facts = as_json(estimated(folder / "plain.csv"))
    assert facts["failures"] == len(failed)
    assert facts["simulated_s"] == pytest.approx(
        sum(float(row["time_s"]) for row in rows(folder / "plain.csv"))
    )


def test_every_kind_of_violation_has_an_interval(folder: Path, capsys: Capture) -> None:
    """Those of two assertions, by the same method; the headline is as without the second."""
    words, most = ("--exposure", str(folder / "often.toml"), "--method", "monte-carlo"), 40
    more = "--assert", "reaction-zone", "--assert", "collision"
    assert _estimate(folder / "two.csv", *words, *more, "-q", "--json", most=most) == Exit.OK
    said = json.loads(capsys.readouterr().out)
    found = {(one["assertion"], one["kind"]): one for one in said["by_assertion"]}
    played = rows(folder / "two.csv")
    for name in ("reaction-zone", "collision"):
        violated = [row for row in played if f"{name}=violated" in row["verdicts"].split()]
        one = found[name, "violated"]
        assert one["episodes"] == len(violated)
        assert one["p"] == pytest.approx(len(violated) / most)
        assert one["lower"] <= one["p"] <= one["upper"]
        assert one["per_hour"]["value"] == pytest.approx(60 * one["p"])
        kinds = [k for n, k in found if n == name and k not in ("violated", "unfair")]
        assert sum(found[name, kind]["episodes"] for kind in kinds) == len(violated)
    assert found["collision", "violated"]["episodes"] > 0
    assert "each interval 95%, not all jointly" in sentences(estimated(folder / "two.csv"))


def test_no_failure_gives_a_bound(tmp_path: Path, capsys: Capture) -> None:
    """Everybody looks and accepts long gaps alone."""
    never = tmp_path / "never.toml"
    gaps = '[critical_gap_s]\ndistribution = "normal"\nmean = 40\nsd = 1'
    never.write_text(f"[attention]\ninattentive = 0.0\n{gaps}", encoding="utf-8")
    words = "--exposure", str(never), "--method", "monte-carlo", "--bound", "0.001"
    assert _estimate(tmp_path / "a.csv", *words, most=20) == Exit.OK
    said = capsys.readouterr().out
    assert "no preventable failure: at most 0.168 an encounter (95%); 3688 episodes" in said


def test_two_egos_meet_the_same_encounters(folder: Path, capsys: Capture) -> None:
    """Pairs of rows have the same seeds; few failures of one of them give no ratio."""
    file, often = folder / "pair.csv", str(folder / "often.toml")
    words = "--against", "time-gap", "--exposure", often, "--json", "-q"
    assert _estimate(file, *words, most=30) == Exit.OK
    said: dict[str, Any] = json.loads(capsys.readouterr().out)
    first, second = (rows(folder / f"pair-{name}.csv") for name in ("first", "second"))
    assert [row["seed"] for row in first] == [row["seed"] for row in second]
    assert [one["ego"] for one in said["estimates"]] == ["constant", "time-gap"]
    assert said["comparison"]["episodes"] == 30
    assert "too few for a ratio" in said["comparison"]["refused"]


def test_the_output_may_be_redirected_into_a_default_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The episodes lie beside it, in names of their own."""
    monkeypatch.chdir(tmp_path)
    words = ["estimate", "--net", "pedestrians", "--ego", "constant", "--trace", "none", "-q"]
    words += ["--max-episodes", "2", "--json"]
    for name, file in (("results.json", "episodes.csv"), ("episodes.json", "estimate.csv")):
        with Path(name).open("w", encoding="utf-8") as stream, monkeypatch.context() as patch:
            patch.setattr("sys.stdout", stream)
            assert main(words) == Exit.OK
        said = json.loads(Path(name).read_text(encoding="utf-8"))
        assert (said["results"], said["episodes"]) == (file, 2)
        assert len(rows(tmp_path / file)) == 2
        for there in tmp_path.glob("*.*"):
            there.unlink()


def test_the_output_may_go_by_a_pipe_into_results_json(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    """As ``--json | tee results.json``: the file is there before the episodes are named."""
    monkeypatch.chdir(tmp_path)
    Path("results.json").touch()
    words = ["estimate", "--net", "pedestrians", "--ego", "constant", "--trace", "none", "-q"]
    assert main([*words, "--max-episodes", "2", "--json"]) == Exit.OK
    assert json.loads(capsys.readouterr().out)["results"] == "episodes.csv"
    assert Path("results.json").read_bytes() == b""


def test_results_do_not_replace_the_redirected_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    """A results file that was named: the sentence says what collides."""
    with (tmp_path / "a.json").open("w", encoding="utf-8") as stream:
        monkeypatch.setattr("sys.stdout", stream)
        assert _estimate(tmp_path / "a.csv", "--overwrite", most=2) == Exit.USAGE
    assert "this command is redirected into" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["a.json"]


def test_beside_other_agents_all_play_equally_often(tmp_path: Path) -> None:
    """An exposure in a batch of two agents goes on after its estimate is over."""
    words = ["run", "--net", "pedestrians", "--ego", "constant", "--testers", "1", "--runs", "25"]
    words += ["--agent", "exposure", "--agent", "noop", "--trace", "none", "--exit-zero", "-q"]
    words += ["--param", "bound=0.99", "--param", "method=monte-carlo"]
    assert main([*words, "-o", str(tmp_path / "both.csv")]) == 0
    assert [row["agent"] for row in rows(tmp_path / "both.csv")] == ["exposure", "noop"] * 25


VEHICLES = """
[{kind}.arrivals]
within_s = 2.0
[{kind}.attention]
inattentive = {share}
"""


@pytest.mark.parametrize("kind", ["bicycle", "car"])
def test_vehicles_meet_the_ego(kind: str, tmp_path: Path, capsys: Capture) -> None:
    """Those who do not look go at once and are hit; those who look let the ego pass, and replay."""
    met = {}
    for share in ("0.0", "1.0"):
        file, exposure = tmp_path / f"{share}.csv", tmp_path / f"{share}.toml"
        exposure.write_text(VEHICLES.format(kind=kind, share=share), encoding="utf-8")
        words = ["estimate", "--net", "crossing", "--routes", "none", "--ego", "constant"]
        words += ["--kind", kind, "--method", "stratified", "--max-episodes", "12", "-q"]
        words += ["--half-width", "1e-6", "--exposure", str(exposure), "-o", str(file)]
        assert main(words) == Exit.OK
        met[share] = [row["outcome"] for row in rows(file)]
        assert not {"error", "invalid"} & {*met[share]}
        assert estimated(file).per_hour == {"bicycle": 30.0, "car": 120.0}[kind]
    assert "violated" not in met["0.0"]
    assert "violated" in met["1.0"]
    run = str(met["1.0"].index("violated"))
    assert main(["replay", str(tmp_path / "1.0.csv"), run]) == Exit.OK
    assert "frames: the same" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--half-width", "0"], "--half-width: expected a number above 0, got 0"),
        (["--bound", "1.5"], "--bound: expected a probability between 0 and 1, got 1.5"),
        (["--method", "splitting"], "argument --method: invalid choice: 'splitting'"),
        (["--exposure", "none.toml"], "none.toml"),
        (
            ["--exposure", "fast.toml"],
            "fast.toml': speed_mps: expected a distribution with mass bet",
        ),
        (["--agent", "timing"], "--agent: expected none"),
        (["--picture", "a.gif"], "--picture 'a.gif': expected a name that ends in .svg or .png"),
        (["--against", "sumo", "--method", "importance"], "--against: needs --method monte-carlo"),
        (["--kind", "bus"], "only pedestrian, bicycle and car have one"),
        (["--max-episodes", "0"], "runs"),
        (["--method", "importance", "--max-episodes", "60"], "at least 100 episodes, got 60"),
    ],
)
def test_an_estimate_that_is_impossible_is_refused(
    words: list[str],
    said: str,
    folder: Path,
    tmp_path: Path,
    capsys: Capture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One sentence, and nothing is written."""
    monkeypatch.chdir(folder)  # exposures
    assert _estimate(tmp_path / "no.csv", "-q", *words) == Exit.USAGE
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_python_estimates_alike(found: Path, folder: Path) -> None:
    """The same digits as the command; an agent cannot be chosen."""
    how: dict[str, Any] = {"ego": "constant", "trace": "none", "progress": False}
    how |= {"exposure": folder / "often.toml", "half_width": 0.05, "max_episodes": MOST}
    estimation = cavsumo.estimate("pedestrians", **how)
    assert estimation.facts == as_json(estimated(found))
    assert str(estimation).startswith("probability of a preventable failure an encounter: ")
    with pytest.raises(cavsumo.InputError, match="estimate: runs: expected max_episodes"):
        cavsumo.estimate("pedestrians", runs=3, **how)
