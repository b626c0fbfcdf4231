"""What a run does with finished results in its place, and a run on several networks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from inline import Done, cavsumo
from support import rows

WORDS = ("run", "-n", "pedestrians", "-r", "none", "--end", "1", "-q", "--runs")


@pytest.fixture
def run(tmp_path: Path) -> Callable[..., Done]:
    """Call with words after ``--runs``: a short batch on the straight road."""

    def played(*words: str) -> Done:
        return cavsumo(tmp_path, *WORDS, *words)

    return played


def test_a_finished_batch_in_a_named_file_is_kept(run: Callable[..., Done], tmp_path: Path) -> None:
    file = tmp_path / "mine.csv"
    assert run("2", "-o", "mine.csv").returncode == 0
    before = file.read_bytes()
    refused = run("3", "-o", "mine.csv")
    assert refused.returncode == 2
    assert "another finished batch of 2 episodes (runs was 2, is 3); --overwrite" in refused.stderr
    assert refused.stderr.count("\n") == 1
    assert file.read_bytes() == before
    assert run("3", "-o", "mine.csv", "--overwrite").returncode == 0
    assert len(rows(file)) == 3


def test_the_same_batch_takes_its_own_place(run: Callable[..., Done], tmp_path: Path) -> None:
    first, second = run("2", "-o", "mine.csv"), run("2", "-o", "mine.csv", "--deadline", "99")
    assert (first.returncode, second.returncode) == (0, 0)
    assert second.stderr == ""


def test_the_file_of_a_run_without_a_name_is_replaced_and_that_is_said(
    run: Callable[..., Done], tmp_path: Path
) -> None:
    assert run("2").stderr == ""
    again = run("3")
    assert again.returncode == 0
    assert again.stderr == (
        "cavsumo: 'results.csv': another batch of 2 episodes is replaced; -o FILE keeps the next "
        "one\n"
    )
    assert len(rows(tmp_path / "results.csv")) == 3


def test_each_of_several_networks_is_played(tmp_path: Path) -> None:
    words = "run --net pedestrians --net crossing -r none --end 1 --runs 2 -o two.csv".split()
    done = cavsumo(tmp_path, *words)
    assert done.returncode == 0, done.stderr
    assert {f.name for f in tmp_path.glob("*.csv")} == {"two-crossing.csv", "two-pedestrians.csv"}
    assert "crossing" in done.stdout
    assert "pedestrians" in done.stdout
    again = cavsumo(tmp_path, "run", "-n", "crossing", *words[5:-1], "one.csv")
    assert again.returncode == 0
    assert rows(tmp_path / "one.csv") == rows(tmp_path / "two-crossing.csv")


def test_two_networks_of_one_name_are_refused(tmp_path: Path) -> None:
    done = cavsumo(tmp_path, "run", "--net", "crossing", "--net", "crossing", "-o", "two.csv")
    assert done.returncode == 2
    assert done.stderr == (
        "cavsumo: --net crossing: another network is called 'crossing' as well\n"
    )
    assert list(tmp_path.iterdir()) == []
