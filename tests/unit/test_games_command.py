"""``cavsumo game solve``: what it prints, its exit status, its pictures."""

from __future__ import annotations

import importlib
import itertools
import json
import os
from pathlib import Path

import numpy as np
import pytest
from support import DATA, ROOT

from cavsumo.cli import main

CASES = {
    case["id"]: case for case in json.loads((DATA / "ssp_games.json").read_text("utf-8"))["cases"]
}
KEYS = ("id", "n_states", "goal", "initial", "transitions")


def write(name: str, folder: Path) -> str:
    """A vector as a file of its own."""
    file = folder / f"{name}.json"
    file.write_text(json.dumps({key: CASES[name][key] for key in KEYS}), encoding="utf-8")
    return str(file)


def test_json_has_one_entry_a_state(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The keys of docs/games.md, in reading A by default."""
    assert main(["game", "solve", write("figure2_like", tmp_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["solvable"] is True
    assert found["proper_region"] == [True] * 6
    assert found["sure_region"] == [2, 3, 1, 2, 1, 0]
    assert found["policy"] == [0, 0, 0, 0, 0, None]
    values = [-13 / 3, -4, -2, -43 / 30, -6, 0]
    for low, value, high in zip(found["lower"], values, found["upper"], strict=True):
        assert low <= value <= high <= low + 1e-6
    assert found["witness"] is None


def test_readings_b_and_c(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """B prints weights, C a reply to each action of the ego; A refuses with status 1."""
    file = write("rock_paper_scissors", tmp_path)
    assert main(["game", "solve", file, "--json", "--reading", "B", "--precision", "1e-8"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["policy"][0] == pytest.approx({"0": 1 / 3, "1": 1 / 3, "2": 1 / 3})
    assert found["upper"][0] - found["lower"][0] <= 1e-8
    assert main(["game", "solve", file, "--json", "--reading", "C"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["policy"] == [{"0": 1, "1": 2, "2": 0}, None, {"0": 0}]
    assert main(["game", "solve", file, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["solvable"] is False
    assert found["witness"]["trap"] == [0, 2]
    assert found["lower"] is found["upper"] is found["policy"] is None
    assert found["proper_region"] == [False, True, False]
    assert found["sure_region"] == [None, 0, None]


def test_the_table_says_it_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Bounds rounded outward, how a goal is forced, and the trap of an unsolvable game."""
    assert main(["game", "solve", write("geometric", tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "forced almost surely from every state" in said
    assert "-2.0000004   -1.9999996   almost sure" in said
    assert main(["game", "solve", write("ego_blocks", tmp_path)]) == 1
    assert "not solvable: in states 0, 1 the ego can keep" in capsys.readouterr().out
    assert main(["game", "solve", write("ego_blocks", tmp_path), "--trim"]) == 1
    assert "-inf" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere.json"], "No such file"),
        (["--precision", "0", "FILE"], "--precision: expected a positive number"),
        (["--precision", "nan", "FILE"], "--precision: expected a positive number"),
        (["--reading", "D", "FILE"], "invalid choice"),
        (["--picture", "tree.bmp", "FILE"], "expected a name ending in .png"),
        (["--picture", "no/where.png", "FILE"], "no such folder 'no'"),
    ],
)
def test_a_mistake_gets_one_sentence(
    words: list[str],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Exit status 2, nothing written, no traceback."""
    file = write("geometric", tmp_path)
    monkeypatch.chdir(tmp_path)
    assert main(["game", "solve", *(file if word == "FILE" else word for word in words)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert said in captured.err
    assert captured.err.count("\n") == 1
    assert [f.name for f in tmp_path.iterdir()] == ["geometric.json"]


def test_a_long_solution_says_what_it_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A line now and then on stderr, with the seconds so far; none with --quiet."""
    monkeypatch.setattr("cavsumo.cli.commands.game.EVERY_S", 0.001)
    words = ["game", "solve", write("pursuit_line_7", tmp_path), "--reading", "B", "--json"]
    assert main(words) == 0
    lines = capsys.readouterr().err.splitlines()
    assert lines
    assert all(line.startswith("solving") and line.endswith(" s") for line in lines)
    assert any("residual" in line for line in lines)
    assert main([*words, "--quiet"]) == 0
    assert capsys.readouterr().err == ""


def test_a_precision_beyond_floats_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The bounds are printed and still hold, the exit status is 3."""
    file = write("slow_loop", tmp_path)
    assert main(["game", "solve", file, "--json", "--precision", "1e-15"]) == 3
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert found["lower"][0] <= -1 <= found["upper"][0]
    assert "floats are too coarse" in captured.err


def test_pictures_are_drawn_and_the_same_bytes(tmp_path: Path) -> None:
    """Tree and policy; a game too big for a tree is refused."""
    pytest.importorskip("matplotlib")
    file = write("figure2_like", tmp_path)
    drawn = []
    for i in range(2):
        tree, policy = (tmp_path / f"{what}{i}.png" for what in ("tree", "policy"))
        words = ["--picture", str(tree), "--policy-picture", str(policy)]
        assert main(["game", "solve", file, *words]) == 0
        drawn.append((tree.read_bytes(), policy.read_bytes()))
    assert drawn[0] == drawn[1]
    assert min(map(len, drawn[0])) > 5000
    big = write("pursuit_line_7", tmp_path)
    assert main(["game", "solve", big, "--reading", "B", "--picture", str(tmp_path / "x.png")]) == 2
    assert not (tmp_path / "x.png").exists()


def test_the_examples_of_the_documentation_run() -> None:
    """The file and the Python of docs/games.md."""
    text = (ROOT / "docs" / "games.md").read_text(encoding="utf-8")
    game = text.split("```json\n")[1].split("```")[0]
    example = ROOT / "examples" / "games" / "risky_or_safe.json"
    assert example.read_text(encoding="utf-8") == game
    assert main(["game", "solve", str(example)]) == 0
    exec(text.split("```python\n")[1].split("```")[0], {})


def test_a_time_limit_ends_the_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit status 3, one sentence that says what was being done, nothing on stdout."""
    file = write("pursuit_line_7", tmp_path)
    assert main(["game", "solve", file, "--json", "--time-limit", "1e-9"]) == 3
    said = capsys.readouterr()
    assert said.out == ""
    assert "not solved within 1e-09 s: it was at " in said.err
    assert main(["game", "solve", file, "--time-limit", "0"]) == 2
    assert "--time-limit: expected positive seconds, got 0" in capsys.readouterr().err


def test_json_is_all_that_stdout_holds(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A compiled library that prints while a game is solved is sent to stderr."""
    solving = importlib.import_module("cavsumo.games.solve")

    def noisy(*_: object) -> object:
        os.write(1, b" ** On entry to DTRSV  parameter number  6 had an illegal value\n")
        return start(*_)

    start = solving._start
    monkeypatch.setattr(solving, "_start", noisy)
    assert main(["game", "solve", write("figure2_like", tmp_path), "--json"]) == 0
    said = capfd.readouterr()
    assert json.loads(said.out)["solvable"] is True
    assert "DTRSV" in said.err


def test_no_library_has_anything_to_print(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Systems of improper pairs made BLAS print; none is solved any more."""
    from cavsumo.games import from_transitions, solve

    rng = np.random.default_rng(32)
    transitions = []
    many, wide = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    for key in itertools.product(range(41), range(many), range(wide)):
        to = rng.choice(42, size=int(rng.integers(1, 4)), replace=False)
        shares = rng.integers(1, 5, size=len(to))
        transitions.append(
            (
                *key,
                [
                    (int(t), f"{w}/{shares.sum()}", -int(rng.integers(1, 6)))
                    for t, w in zip(to, shares, strict=True)
                ],
            )
        )
    found = solve(from_transitions(42, [41], transitions), "B")
    assert found.precise
    assert capfd.readouterr() == ("", "")
