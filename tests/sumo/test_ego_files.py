"""The files that an ego's command names: what is an input and what the ego writes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from ego_writer import NAMES, run, writer_in
from support import rows, traces

from cavsumo.batch.prepared import PreparedBatch
from cavsumo.cli.command_line import main
from cavsumo.egos.ego_files import OutputWatch, data_files
from cavsumo.results.reading import read_manifest


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with the ego that writes."""
    monkeypatch.chdir(tmp_path)
    return writer_in(tmp_path)


@pytest.mark.parametrize("there", [[], NAMES], ids=["new", "old"])
@pytest.mark.parametrize("jobs", ["1", "2", "3"])
def test_what_an_ego_writes_does_not_stop_a_batch(
    networks: dict[str, Path], here: Path, jobs: str, there: list[str]
) -> None:
    """With several at a time, the files there before or not; the manifest names them."""
    for name in there:
        (here / name).write_text("from an earlier run\n")
    assert run(networks["pedestrians"], "--runs", "6", "-j", jobs) == 0
    assert [row["outcome"] for row in rows(here / "r.csv")] == ["not_triggered"] * 6
    found = read_manifest(here / "r.csv")
    assert found["ego_outputs"] == sorted(NAMES)
    assert {"writer.py", "gain.txt"} <= set(found["sha256"])
    assert not set(NAMES) & set(found["sha256"])


def test_the_traces_are_the_same_for_any_number_of_workers(
    networks: dict[str, Path], here: Path
) -> None:
    """Heads included: they name the inputs as they were when the batch began."""
    for name in NAMES:
        (here / name).write_text("from an earlier run\n")
    found = []
    for jobs in ("1", "2"):
        assert run(networks["pedestrians"], "--runs", "4", "-j", jobs, output=f"r{jobs}.csv") == 0
        (here / "did").unlink()
        for name in NAMES:
            (here / name).write_text("from an earlier run\n")
        found.append(traces(here / f"r{jobs}.csv"))
    assert found[0] == found[1]
    assert len(found[0]) == 4


def test_resume_replay_and_merge_do_not_mind_outputs(
    networks: dict[str, Path], here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What the ego wrote is no input of the batch that goes on, or is played again."""
    net = networks["pedestrians"]
    assert run(net, "--runs", "2") == 0
    assert main(["run", "--resume", "--runs", "4", "-o", "r.csv", "-q"]) == 0
    assert len(rows(here / "r.csv")) == 4
    capsys.readouterr()
    assert main(["replay", "r.csv", "1", "--trust"]) == 0
    out, err = capsys.readouterr()
    assert "the same" in out
    assert err == ""
    for i in (1, 2):
        assert run(net, "--runs", "4", "--shard", f"{i}/2", output=f"part{i}.csv") == 0
    assert main(["merge", "part1.csv", "part2.csv", "-o", "whole.csv", "-q"]) == 0
    assert rows(here / "whole.csv") == [
        row | {"trace": row["trace"].replace("r/", "whole/")} for row in rows(here / "r.csv")
    ]


@pytest.mark.parametrize("name", ["gain.txt", "writer.py"])
def test_an_input_that_changes_is_noticed(
    networks: dict[str, Path], here: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    """The program or what it reads: --resume refuses, replay says so."""
    assert run(networks["pedestrians"], "--runs", "1") == 0
    (here / name).write_text((here / name).read_text() + "\n")
    capsys.readouterr()
    assert main(["run", "--resume", "--runs", "2", "-o", "r.csv", "-q"]) == 2
    assert f"sha256: {name} was" in capsys.readouterr().err
    assert main(["replay", "r.csv", "0", "--trust"]) == 0
    assert f"sha256: {name} was" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("command", "data"),
    [
        ("python3 writer.py gain.txt", ["gain.txt"]),
        ("/usr/bin/python3.11 -u writer.py gain.txt", ["gain.txt"]),
        ("python3 -m writer gain.txt", ["gain.txt"]),
        ("./writer.py gain.txt", ["gain.txt"]),
        ("my-stack --log gain.txt --map writer.py", ["gain.txt", "writer.py"]),
        ("node writer.py", []),
        ("my-stack --log nothing.txt", []),
    ],
)
def test_the_program_is_told_from_its_data(here: Path, command: str, data: list[str]) -> None:
    """The first word, and what an interpreter executes, are the program."""
    assert [str(file) for file in data_files(f"exec:{command}")] == data


def test_other_egos_have_no_data_files(here: Path) -> None:
    """A class, a port, a built-in ego."""
    for spec in ("sumo", "tcp:127.0.0.1:5000", "writer:Writer"):
        assert data_files(spec) == ()


def test_on_another_machine_every_input_must_be_the_same(
    set_up: Callable[..., PreparedBatch], here: Path
) -> None:
    """There the ego of this batch has written nothing yet."""
    import dataclasses

    from cavsumo.errors import InputError

    prepared = set_up("pedestrians", ego="exec:my-stack --log gain.txt")
    (here / "gain.txt").write_text("1.0")
    prepared.check_here()
    with pytest.raises(InputError, match=r"gain\.txt is .* expected"):
        dataclasses.replace(prepared, machine="another").check_here()


def test_a_file_is_read_again_only_when_it_was_touched(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Weights of a gigabyte are not read after every episode."""
    read: list[Path] = []
    monkeypatch.setattr(
        "cavsumo.egos.ego_files.readable_checksum", lambda file: str(read.append(file))
    )
    watch = OutputWatch("exec:my-stack gain.txt", {"gain.txt": "None"})
    assert [watch.outputs(), watch.outputs()] == [[], []]
    assert len(read) == 1
    (here / "gain.txt").write_text("12")
    assert watch.outputs() == []
    assert len(read) == 2
