"""The Python interface: the rows of the command, as tables, pages and words."""

from __future__ import annotations

import gc
import math
import re
import shutil
import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pandas
import pytest
from own_objects import Sprinter, Tiring, of_objects
from support import content, rows, traces, untold

import cavsumo
from cavsumo import Results
from cavsumo.batch import progress
from cavsumo.batch.sentences import many
from cavsumo.batch.worker import close_all
from cavsumo.cli import main
from cavsumo.results.columns import COLUMNS
from cavsumo.results.reading import read_manifest

ROOT = Path(__file__).parents[2]
DOCS = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
WORDS = "-n crossing --agent timing --agent proximity --runs 5 --seed 3 --trace all -q --exit-zero"
BATCH: dict[str, Any] = {"agents": ["timing", "proximity"], "runs": 5, "seed": 3, "trace": "all"}


@pytest.fixture(scope="module")
def by_command(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A batch of the command's, with tests and failures."""
    file = tmp_path_factory.mktemp("command") / "results.csv"
    assert main(["run", *WORDS.split(), "-j", "2", "-o", str(file)]) == 0
    return file


@pytest.fixture(scope="module")
def results() -> Results:
    """The same batch from Python."""
    return cavsumo.run("crossing", **BATCH)


# The package


def test_the_public_names_are_those_of_the_docs() -> None:
    """``__all__`` is the table of docs/python.md, and every name of it is there."""
    table = DOCS.split("<!-- names -->")[1].split("<!-- end -->")[0]
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == list(cavsumo.__all__)
    for name in cavsumo.__all__:
        assert getattr(cavsumo, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'ran'"):
        _ = cavsumo.ran  # type: ignore[attr-defined]


def test_the_examples_of_the_docs_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All of them, one after another, as in a notebook; only the first batch is shortened."""
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", DOCS, re.DOTALL)
    source = "".join(blocks).replace("runs=20", "runs=2").replace("runs=4", "runs=1")
    found: dict[str, Any] = {"__name__": "notebook"}
    exec(compile(source, "docs/python.md", "exec"), found)
    assert set(found["mine"].rows["agent"]) == {"runner", "timing"}
    assert found["mine"].rows["error"].isna().all()
    assert {"run3.html", "report.html", "results.csv"} <= {file.name for file in tmp_path.iterdir()}


# A batch


def test_the_rows_and_traces_are_those_of_the_command(results: Results, by_command: Path) -> None:
    """Byte for byte but for the real time, with one process as with two."""
    assert rows(results.file) == rows(by_command)
    assert traces(results.file) == traces(by_command)


def test_nothing_is_said_or_left_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """No file in the working folder, no word on a pipe; the temporary folder goes in the end."""
    monkeypatch.chdir(tmp_path)
    played = cavsumo.run("pedestrians", runs=1, end=2.0, routes="none")
    folder = played.file.parent
    assert len(played) == 1
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")
    del played
    gc.collect()
    assert not folder.exists()


def test_a_scenario_file_and_an_output_are_taken(by_command: Path, tmp_path: Path) -> None:
    """The keywords win over the file, an executor plays, and the results lie where wanted."""
    config = tmp_path / "scenario.toml"
    config.write_text('agents = ["timing", "proximity"]\nruns = 9\nseed = 3\ntrace = "all"\n')
    output = tmp_path / "out.csv"
    with ThreadPoolExecutor(2) as executor:
        played = cavsumo.run(config=config, output=output, runs=2, executor=executor)
    close_all()
    assert untold(rows(output)) == untold(rows(by_command)[:4])
    assert cavsumo.load(output).rows.equals(played.rows)
    assert read_manifest(output)["call"].startswith("cavsumo.run(agents=['timing', 'proximity']")
    again = cavsumo.run(config=config, output=output, runs=3, resume=True)
    assert len(again) == 6


def test_a_scenario_is_played_again_with_another_ego(results: Results) -> None:
    """What was played is where the next batch begins; its roads have the same traffic."""
    other = cavsumo.run(results.scenario, ego="time-gap", agents="timing", runs=1, seed=3)
    assert other.scenario.model_copy(update={"ego": "sumo"}) == results.scenario
    assert other.rows["ego"].tolist() == ["time-gap"]


def test_an_interrupt_keeps_what_ran(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What runs is finished, then KeyboardInterrupt is raised; the output goes on from there."""
    output = tmp_path / "out.csv"
    update = progress.Progress.update

    def interrupting(self: progress.Progress, tally: Any) -> None:
        update(self, tally)
        if tally.rows == 2:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(progress.Progress, "update", interrupting)
    short: dict[str, Any] = {"routes": "none", "end": 2.0, "runs": 9, "output": output}
    with pytest.raises(KeyboardInterrupt):
        cavsumo.run("pedestrians", **short)
    stopped = cavsumo.load(output)
    assert 2 <= len(stopped) < 9
    assert "interrupted" in repr(stopped)
    monkeypatch.undo()
    assert len(cavsumo.run("pedestrians", resume=True, **short)) == 9


def test_a_study_gives_the_results_of_each_batch(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By name, with and without an output; ``run`` says what plays it."""
    config = tmp_path / "study.toml"
    config.write_text('net = "pedestrians"\nend = 2.0\nruns = 1\n[vary]\ntesters = [1, 2]\n')
    played = cavsumo.run_study(config, ego="constant", output=tmp_path / "all.csv")
    assert list(played) == ["testers1", "testers2"]
    for count, (name, results) in enumerate(played.items(), 1):
        assert results.file == tmp_path / f"all-{name}.csv"
        assert results.scenario.testers == count
        assert list(results.rows["ego"]) == ["constant"]
    again = cavsumo.run_study(config, ego="constant")
    assert again["testers2"].rows["seed"].equals(played["testers2"].rows["seed"])
    file = again.pop("testers1").file
    assert again["testers2"].replay(0).run == 0  # its folder is there as long as one of them is
    assert file.is_file()
    with pytest.raises(cavsumo.InputError, match="run_study plays them"):
        cavsumo.run(config=config)
    with pytest.raises(cavsumo.InputError, match="testers, which is given beside the file"):
        cavsumo.run_study(config, testers=3)
    assert capsys.readouterr() == ("", "")


# Wrong arguments


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"net": "crosing"}, "run: unknown network 'crosing'; did you mean 'crossing'?"),
        ({"net": 3}, "run: net: expected a name, a file or a Scenario, got 3"),
        ({"agent": "timing"}, "run: unknown key 'agent'; did you mean 'agents'?"),
        ({"agents": "tming"}, "unknown agent 'tming'; did you mean 'timing'?"),
        ({"agents": [3]}, "agent object:int@"),
        ({"ego": object()}, "has no method act(snapshot)"),
        ({"assertions": [object()]}, "has no method observe(snapshot)"),
        ({"ego": threading.Lock()}, "object lock: cannot be sent to a process"),
        ({"runs": 0}, "runs: Input should be greater than or equal to 1, got 0"),
        ({"jobs": 0}, "jobs: expected a number of at least 1, got 0"),
        ({"executor": "processes"}, "executor: expected a concurrent.futures.Executor"),
        ({"output": "results.txt"}, "expected a name that ends in .csv"),
        ({"resume": True}, "go on with an output"),
        ({"config": "nowhere.toml"}, "config 'nowhere.toml': cannot be read: No such file"),
    ],
)
def test_a_wrong_argument_is_one_sentence(
    arguments: dict[str, Any], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """InputError, and nothing was written."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(cavsumo.InputError) as refused:
        cavsumo.run(**arguments)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)
    assert list(tmp_path.iterdir()) == []


# Results


def test_rows_have_numbers_and_columns_are_explained(results: Results, by_command: Path) -> None:
    """A row by the number of its run; what is missing is NaN; load reads the same of the file."""
    table = results.rows
    assert table.index.tolist() == table["run"].tolist() == list(range(10))
    assert list(table.columns) == list(results.columns.index) == list(COLUMNS)
    kinds = {name: table[name].dtype.kind for name in COLUMNS}
    assert {name for name, kind in kinds.items() if kind in "if"} == {
        name for name, column in COLUMNS.items() if not column.words
    }
    assert (kinds["run"], kinds["seed"], kinds["min_gap_m"]) == ("i", "i", "f")
    assert math.isnan(table.loc[table["outcome"] != "violated", "violation_time_s"].iloc[0])
    assert results.columns.loc["min_gap_m", "unit"] == "m"
    loaded = cavsumo.load(by_command).rows
    assert loaded.drop(columns="wall_s").equals(table.drop(columns="wall_s"))


def test_failures_come_preventable_ones_first(tmp_path: Path, by_command: Path) -> None:
    """Then those that were not judged, then those that nobody would have avoided."""
    shutil.copy(by_command.with_suffix(".json"), tmp_path / "r.json")
    lines = rows(by_command)
    for row, avoidable in zip(lines, ("0", "", "1", "0", "1"), strict=False):
        row |= {"outcome": "violated", "avoidable": avoidable}
    pandas.DataFrame(lines).assign(wall_s="").to_csv(tmp_path / "r.csv", index=False)
    failures = cavsumo.load(tmp_path / "r.csv").failures
    assert failures["run"].tolist()[:5] == [2, 4, 1, 0, 3]


def test_a_replay_is_a_table_and_a_page(results: Results, tmp_path: Path) -> None:
    """Played again, played back or taken as recorded, the frames are the same."""
    again, kept = results.replay(3), results.replay(3, recorded=True)
    back = results.replay(3, playback=True)
    assert back.frames.equals(kept.frames)
    assert back.record.plan == kept.record.plan
    assert list(again.frames.columns) == ["time", "body", "x", "y", "v", "o"]
    assert again.frames.equals(kept.frames)
    assert (again.run, again.row["agent"]) == (3, "proximity")
    ego = again.frames[again.frames.body == "ego"]
    assert ego["time"].tolist() == [frame["time_s"] for frame in again.trace.frames]
    again.html(tmp_path / "run3.html")
    assert "Run 3 (proximity), crossing" in (tmp_path / "run3.html").read_text(encoding="utf-8")
    assert repr(again).startswith("<RecordedEpisode: Run 3 (proximity), crossing: ")
    assert "Tester agent" in again._repr_html_()
    with pytest.raises(cavsumo.InputError, match="no run 99"):
        results.replay(99)
    with pytest.raises(cavsumo.InputError, match="recorded=True plays nothing"):
        results.replay(3, recorded=True, playback=True)


def test_a_report_has_the_format_of_its_name(
    results: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the command's, in a notebook too; another ending is refused before anything is read."""
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    results.report(tmp_path / "report.md")
    results.report(tmp_path / "report.xml")
    results.report(tmp_path / "report.txt")
    assert "Shares, with 95 % intervals" in (tmp_path / "report.txt").read_text(encoding="utf-8")
    assert "| timing" in (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "<testsuite" in (tmp_path / "report.xml").read_text(encoding="utf-8")
    with pytest.raises(cavsumo.InputError, match=r"ends in \.html, \.xml, \.md"):
        results.report(tmp_path / "report.pdf")
    with pytest.raises(cavsumo.InputError, match="no such folder"):
        results.report(tmp_path / "nowhere" / "report.md")


def test_results_say_what_was_found(results: Results, by_command: Path) -> None:
    """In one line, and as tables for a notebook."""
    failures = int((results.rows["outcome"] == "violated").sum())
    preventable = int((results.rows["avoidable"] == 1).sum())
    assert repr(results).startswith("<Results: 10 episodes on crossing, ego sumo: ")
    preventable = int((results.failures["avoidable"] == 1).sum())
    assert f"{many(preventable, 'preventable failure')} in " in repr(results)
    assert str(by_command) in repr(cavsumo.load(by_command))
    shown = results._repr_html_()
    assert "<td>proximity</td><td>5</td>" in shown
    assert ("Failures, preventable ones first" in shown) == (failures > 0)


def test_what_files_hold_is_shown_and_not_executed(by_command: Path, tmp_path: Path) -> None:
    """Names from a file are text in a notebook."""
    nasty = "<script>alert(1)</script>"
    text = by_command.read_text(encoding="utf-8").replace("proximity", nasty)
    (tmp_path / "r.csv").write_text(text.replace("reaction-zone", nasty), encoding="utf-8")
    shutil.copy(by_command.with_suffix(".json"), tmp_path / "r.json")
    shown = cavsumo.load(tmp_path / "r.csv")._repr_html_()
    assert "&lt;script&gt;" in shown
    assert "<script" not in shown


def test_damaged_results_are_one_sentence(by_command: Path, tmp_path: Path) -> None:
    """No file, no manifest, a word where a number is expected."""
    with pytest.raises(cavsumo.InputError, match=r"manifest '.*nowhere\.json'"):
        cavsumo.load(tmp_path / "nowhere.csv")
    shutil.copy(by_command.with_suffix(".json"), tmp_path / "r.json")
    lines = by_command.read_text(encoding="utf-8").splitlines()
    lines[2] = lines[2].replace(",", ",many,", 3).replace("many,", "", 2)
    (tmp_path / "r.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(cavsumo.InputError, match="line 3"):
        cavsumo.load(tmp_path / "r.csv")


# Objects


def test_results_of_objects_outlive_their_session(tmp_path: Path) -> None:
    """Later the frames are shown, and a replay says in one sentence what is missing."""
    of_objects(output=tmp_path / "r.csv")
    gc.collect()
    before = content(tmp_path)
    later = cavsumo.load(tmp_path / "r.csv", trust=True)
    assert len(later.replay(2, recorded=True).frames) > 0
    with pytest.raises(cavsumo.InputError) as refused:
        later.replay(2)
    assert str(refused.value).startswith("agent object:Sprinter@")
    assert "an object of the Python session that played it, which no file holds" in str(
        refused.value
    )
    assert content(tmp_path) == before


def test_a_class_is_built_with_the_parameters(capfd: pytest.CaptureFixture[str]) -> None:
    """An object has its own already, and one that SUMO drives is no controller."""
    from cavsumo.egos.sumo import SumoEgo

    short: dict[str, Any] = {"routes": "none", "end": 3.0, "runs": 1, "agents": Sprinter}
    quick = cavsumo.run("pedestrians", params={"pace": 5.0}, ego=Tiring, **short)
    assert quick.rows["error"].isna().all()
    assert quick.rows["agent"].tolist() == ["Sprinter"]
    driven = cavsumo.run("pedestrians", ego=SumoEgo(actionStepLength=0.0), **short)
    assert driven.rows["error"].isna().all()
    with pytest.raises(cavsumo.InputError, match="unknown parameter 'paces'; did you mean 'pace'"):
        cavsumo.run("pedestrians", params={"paces": 5.0}, **short)
    with pytest.raises(cavsumo.InputError, match=r"ego object:Tiring@\w+: cannot be built"):
        cavsumo.run("pedestrians", ego=Tiring(), ego_params={"speed": 3.0}, **short)


def test_what_an_object_does_wrong_is_an_error_row() -> None:
    """Errors of episodes stay rows, with what was raised."""

    class Broken:
        def act(self, snapshot: Any) -> Any:
            raise RuntimeError("no steering")

    broken = cavsumo.run("pedestrians", routes="none", ego=Broken(), runs=1, end=3.0)
    assert broken.rows["outcome"].tolist() == ["error"]
    assert "act raised RuntimeError: no steering" in broken.rows["error"][0]
    with pytest.raises(cavsumo.InputError, match="ended in an error, there is nothing to show"):
        broken.replay(0)
