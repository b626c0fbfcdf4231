"""Several instances of one agent in one batch, told apart by labels."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from xml.etree import ElementTree

import pytest
from support import rows

from cavsumo.cli import main
from cavsumo.model.labels import cast_of
from cavsumo.model.scenario_file import read_config
from cavsumo.results.reading import read_manifest


def test_a_label_stands_before_the_name() -> None:
    """Without one the name is it; a "=" behind a colon belongs to a file's name."""
    words = ["timing", "late=timing", "policy:a=b.npz", "trained=policy:a=b.npz"]
    assert cast_of(words) == {
        "timing": "timing",
        "late": "timing",
        "policy:a=b.npz": "policy:a=b.npz",
        "trained": "policy:a=b.npz",
    }


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["timing", "timing"], "'timing' is named twice"),
        (["late=timing", "late=election"], "'late' is named twice"),
        (["=timing"], "'=timing' must be NAME or LABEL=NAME"),
        (["late="], "'late=' must be NAME or LABEL=NAME"),
        (["a.b=timing"], "a label of letters, digits"),
        (["a b=timing"], "a label of letters, digits"),
        (["late=timming"], "unknown agent 'timming'; did you mean 'timing'?"),
        (["election=timing"], "agent election=timing: the label is the name of another agent"),
        (["late=timing", "--param", "timing.aim=0.4"], "did you mean 'late.aim'?"),
        (["late=timing", "--param", "late.ain=0.4"], "did you mean 'late.aim'?"),
        (["late=timing", "--param", "late.aim=7"], "aim"),
        (["late=policy:nowhere.npz"], "No such file"),
    ],
)
def test_bad_labels_are_one_sentence(
    words: list[str], said: str, refused: Callable[..., str]
) -> None:
    """With what was expected; nothing is written."""
    agents = [word for word in words if not word.startswith("--") and ".ai" not in word]
    rest = words[len(agents) :]
    assert said in refused(*(w for agent in agents for w in ("--agent", agent)), *rest)


def test_the_file_of_a_labelled_policy_is_relative_to_the_scenario(tmp_path: Path) -> None:
    """As that of one without a label."""
    file = tmp_path / "scenario.toml"
    file.write_text('agents = ["policy:a.npz", "b=policy:b.npz", "c=timing"]\n', encoding="utf-8")
    assert read_config(file)["agents"] == [
        f"policy:{tmp_path}/a.npz",
        f"b=policy:{tmp_path}/b.npz",
        "c=timing",
    ]


def test_labelled_agents_play_as_they_would_alone(
    networks: Mapping[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each with its own parameters and memory, under its label in rows, manifest and replay."""
    monkeypatch.chdir(tmp_path)
    place = ["run", "-n", str(networks["pedestrians"]), "-r", "none", "--ego", "constant"]
    place += ["--testers", "2", "--runs", "2", "--end", "9", "-q", "--exit-zero"]
    own = ["--param", "late.aim=1", "--param", "wild.epsilon=1", "--param", "aim=0.5"]
    four = ["timing", "late=timing", "tame=q-learning", "wild=q-learning"]
    assert main([*place, *(w for a in four for w in ("--agent", a)), *own, "-j", "2"]) == 0
    assert main([*place, "--agent", "timing", "--param", "aim=1", "-o", "late.csv"]) == 0
    wild = [*place, "--agent", "q-learning", "--param", "epsilon=1", "-o", "wild.csv"]
    assert main(wild) == 0
    found = rows(Path("results.csv"))
    assert [row["agent"] for row in found] == ["timing", "late", "tame", "wild"] * 2
    for label in ("late", "wild"):
        mine = [row for row in found if row["agent"] == label]
        other = {"run": "", "agent": "", "trace": ""}
        assert [row | other for row in mine] == [row | other for row in rows(Path(f"{label}.csv"))]
    learned = read_manifest(Path("results.csv"))["learned"]
    assert learned["wild"] == read_manifest(Path("wild.csv"))["learned"]["q-learning"]
    assert learned["tame"] != learned["wild"]
    assert main(["replay", "results.csv", "7"]) == 0
    assert main(["run", "--resume", "-q", "--exit-zero"]) == 0
    assert main(["report", "results.csv", "--junit", "results.xml", "-o", "report.txt"]) == 0
    cases = ElementTree.parse("results.xml").iter("testcase")
    assert {case.get("classname") for case in cases} == {"timing", "late", "tame", "wild"}
