"""Shards: what several machines played, put together, is what one would have played."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from support import Troupe, content, rows, traces

from cavsumo.batch import merge
from cavsumo.batch.batch_run import BatchRun
from cavsumo.batch.executors import local_executor
from cavsumo.batch.prepared import manifest, prepare
from cavsumo.cli import main
from cavsumo.model.scenario import plan_from
from cavsumo.results.reading import read_manifest
from cavsumo.results.writing import Recorder

RUNS = 5
SHARDS = {"whole": None, "a": "1/2", "b": "2/2", "c1": "1/3", "c2": "2/3", "c3": "3/3"}


@pytest.fixture(scope="module")
def town(networks: Mapping[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A batch played as a whole, by halves and by thirds; and one of another seed."""
    settings: dict[str, Any] = {
        "net": networks["crossing"],
        "routes": "none",
        "end": 8.0,
        "trace": "all",
    }
    settings |= {"agents": ["timing", "random"], "runs": RUNS}
    folder = tmp_path_factory.mktemp("town")
    with local_executor(2) as threads:
        executor = Troupe(prepare(plan_from(settings, "test")), threads)

        def play(name: str, **more: Any) -> None:
            prepared = prepare(plan_from({**settings, **more}, "test"))
            with Recorder(folder / f"{name}.csv") as recorder:
                batch_run = BatchRun(prepared, recorder, executor, 2, lambda: False)
                batch_run.begin(manifest(prepared))
                batch_run.play()
                batch_run.end()

        for name, shard in SHARDS.items():
            play(name, **({"shard": shard} if shard else {}))
        play("other", shard="2/2", seed=2)
    for name in SHARDS:  # what an ego from outside printed in episode 3, wherever that was played
        if any(row["run"] == "3" for row in rows(folder / f"{name}.csv")):
            (folder / name / "run000003.ego.log").write_text("lost sight\n", encoding="utf-8")
    assert traces(folder / "a.csv")
    assert traces(folder / "b.csv")
    return folder


@pytest.fixture(params=[0, 1 << 60], ids=["by columns", "row by row"])
def home(
    request: pytest.FixtureRequest, town: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Path:
    """A copy of all that in the working folder, merged as large results are or as small ones."""
    monkeypatch.setattr(merge, "LARGE", request.param)
    shutil.copytree(town, tmp_path / "home")
    monkeypatch.chdir(tmp_path / "home")
    return tmp_path / "home"


@pytest.mark.parametrize(
    "parts", ["a b", "b a", "c1 c2 c3", "c3 c1 c2"], ids=lambda p: p.replace(" ", "+")
)
def test_shards_make_the_batch_that_one_run_makes(home: Path, parts: str) -> None:
    """Rows, traces and counts, in whatever order the parts are named."""
    files = [f"{part}.csv" for part in parts.split()]
    assert main(["merge", *files, "-o", "merged.csv", "-q"]) == 0
    whole, merged = home / "whole.csv", home / "merged.csv"
    expected = [row | {"trace": row["trace"].replace("whole/", "merged/")} for row in rows(whole)]
    assert rows(merged) == expected
    assert traces(merged) == traces(whole)
    told, single = read_manifest(merged), read_manifest(whole)
    for key in ("plan", "status", "episodes", "counts", "sha256", "versions", "junction"):
        assert told[key] == single[key], key
    assert told["merged_from"] == files


def test_every_shard_plays_its_own_share(town: Path) -> None:
    """Shards take turns, each with all agents, so that none is left without one of them."""
    assert [int(r["run"]) for r in rows(town / "a.csv")] == [0, 1, 4, 5, 8, 9]
    assert [int(r["run"]) for r in rows(town / "b.csv")] == [2, 3, 6, 7]
    assert sorted(int(r["run"]) for n in ("c1", "c2", "c3") for r in rows(town / f"{n}.csv")) == [
        *range(2 * RUNS)
    ]


def test_what_was_merged_is_a_batch_like_any_other(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is summed up, its episodes can be replayed, and it can be gone on with."""
    assert main(["merge", "a.csv", "b.csv", "-o", "merged.csv"]) == 0
    assert f"in {2 * RUNS} episodes" in capsys.readouterr().out
    test = next(row for row in rows(home / "merged.csv") if row["trace"])
    assert main(["replay", "merged.csv", test["run"]]) == 0
    assert "the same" in capsys.readouterr().out
    more = ["run", "--resume", "-q", "--runs", str(RUNS + 1), "-o"]
    assert main([*more, "merged.csv"]) in (0, 1)
    assert main([*more, "whole.csv"]) in (0, 1)
    merged, whole = rows(home / "merged.csv"), rows(home / "whole.csv")
    assert [r | {"trace": ""} for r in merged] == [r | {"trace": ""} for r in whole]
    assert len(merged) == 2 * RUNS + 2


def test_a_merged_batch_may_be_merged_again(home: Path) -> None:
    """The result of the same command before gives way, with its traces."""
    for _ in range(2):
        assert main(["merge", "a.csv", "b.csv", "-o", "merged.csv", "-q"]) == 0
    assert traces(home / "merged.csv") == traces(home / "whole.csv")


def damage(file: Path, change: Callable[[list[bytes]], list[bytes]]) -> None:
    """Change the lines of a file."""
    file.write_bytes(b"".join(change(file.read_bytes().splitlines(keepends=True))))


def untraced(home: Path) -> None:
    """Remove one trace of part b."""
    min((home / "b").glob("*.jsonl.gz")).unlink()


def foreign(home: Path) -> None:
    """A table that is none of ours in the place of part b, with b's manifest."""
    (home / "b.csv").write_text("x,y\n1,2\n", encoding="utf-8")


def alone(home: Path) -> None:
    """Part b without its manifest."""
    (home / "b.json").unlink()


def started(home: Path) -> None:
    """Part b killed when its manifest was new and the rows of a batch before still lay there."""
    file = home / "b.json"
    text = file.read_text(encoding="utf-8")
    assert '"status": "finished"' in text
    file.write_text(text.replace('"status": "finished"', '"status": "starting"'))


def torn(home: Path) -> None:
    """Part b as a kill leaves it."""
    damage(home / "b.csv", lambda lines: [*lines[:-1], lines[-1][:20]])


def short(home: Path) -> None:
    """A row of part b with a cell less."""
    damage(home / "b.csv", lambda lines: [*lines[:2], lines[2].replace(b",", b"", 1), *lines[3:]])


def shuffled(home: Path) -> None:
    """Two rows of part b, the later one first."""
    damage(home / "b.csv", lambda lines: [lines[0], lines[2], lines[1], *lines[3:]])


def beyond(home: Path) -> None:
    """A row behind the last episode in part b."""
    damage(home / "b.csv", lambda lines: [*lines, b"10" + lines[-1][1:]])


def taken(home: Path) -> None:
    """A table of somebody else where the whole should go."""
    (home / "out.csv").write_text("mine\n", encoding="utf-8")


def nothing(_: Path) -> None:
    """All is as it should be."""


@pytest.mark.parametrize(
    ("parts", "spoil", "said"),
    [
        ("a.csv", nothing, "the parts have gaps: no run 2, 3, 6, 7 of 10 episodes"),
        ("b.csv", nothing, "the parts have gaps: no run 0, 1, 4, 5, 8, ... of 10 episodes"),
        ("a.csv a.csv", nothing, "run 0 is there twice, in 'a.csv'"),
        ("a.csv b.csv whole.csv", nothing, "run 0 is there twice, in 'a.csv' and in 'whole.csv'"),
        ("a.csv other.csv", nothing, "are of different batches: seed was 1, is 2"),
        ("a.csv b.csv", foreign, "'b.csv': line 1 does not hold the columns of cavsumo"),
        ("a.csv b.csv", alone, "manifest 'b.json': cannot be read"),
        ("a.csv b.csv", started, "b.csv"),
        ("a.csv b.csv", torn, "the parts have gaps: no run 7 of 10 episodes"),
        ("a.csv b.csv", short, "'b.csv': line 3 has"),
        ("a.csv b.csv", shuffled, "'b.csv': run 2 stands behind run 3"),
        ("a.csv b.csv", beyond, "'b.csv': run 10 of a batch of 10 episodes"),
        ("a.csv b.csv", untraced, "'b.csv': trace of run "),
        ("a.csv b.csv", taken, "'out.csv' is there and not a batch of cavsumo"),
        ("a.csv nowhere.csv", nothing, "nowhere"),
        ("a.csv b.csv out.csv", nothing, "output 'out.csv': is one of the parts"),
        ("a.csv ./sub/../out.csv", nothing, "output 'out.csv': is one of the parts"),
    ],
)
def test_what_makes_no_whole_is_not_merged(
    home: Path,
    capsys: pytest.CaptureFixture[str],
    parts: str,
    spoil: Callable[[Path], None],
    said: str,
) -> None:
    """Gaps, doubles, strangers and damage: exit 2, the place in one sentence, nothing written."""
    (home / "sub").mkdir()
    spoil(home)
    before = content(home)
    assert main(["merge", *parts.split(), "-o", "out.csv", "-q"]) == 2
    printed = capsys.readouterr().err
    assert said in printed
    assert printed.count("\n") == 1
    assert content(home) == before


@pytest.mark.parametrize("shard", ["0/2", "3/2", "x", "1/0", "1", "-1/2", "1/2/3", "1.0/2", ""])
def test_a_shard_that_is_none_is_refused(refused: Callable[..., str], shard: str) -> None:
    """One sentence that says what a shard looks like, and no file."""
    printed = refused(f"--shard={shard}")
    assert "shard: must be I/N with 1 <= I <= N, such as 2/8" in printed
    assert repr(shard) in printed


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--agent q-learning", "q-learning learns from episode to episode, in sequence"),
        ("--agent random --agent q-learning", "q-learning learns from episode to episode"),
        ("--first", "a shard sees its own rows only"),
        ("--until-tests 3", "a shard sees its own rows only"),
        ("--until-half-width 0.1", "a shard sees its own rows only"),
    ],
)
def test_a_shard_of_what_goes_in_sequence_is_refused(
    refused: Callable[..., str], words: str, said: str
) -> None:
    """Who learns, or stops by what was found, needs all episodes before: parts would differ."""
    assert said in refused("--shard", "1/2", *words.split())


def test_a_shard_can_be_played_by_the_command_line(
    town: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, networks: Mapping[str, Path]
) -> None:
    """The rows are those of the shard, and --resume knows which part it is."""
    monkeypatch.chdir(tmp_path)
    line = f"-r none --end 8 --runs {RUNS} --agent timing --agent random --trace all --shard 2/2 -q"
    assert main(["run", "-n", str(networks["crossing"]), *line.split(), "-o", "b.csv"]) in (0, 1)
    assert rows(tmp_path / "b.csv") == rows(town / "b.csv")
    text = (tmp_path / "b.csv").read_bytes()
    assert main(["run", "--resume", "-q", "-o", "b.csv"]) in (0, 1)
    assert (tmp_path / "b.csv").read_bytes() == text
