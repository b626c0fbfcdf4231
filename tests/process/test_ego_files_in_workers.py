"""The files that an ego writes, seen by each process that plays after it."""

from __future__ import annotations

from pathlib import Path

import pytest
from ego_writer import WRITER, run, writer_in
from support import rows


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with the ego that writes; each process plays one episode."""
    monkeypatch.setattr("cavsumo.batch.worker.LIFETIME", 1)
    monkeypatch.chdir(tmp_path)
    return writer_in(tmp_path)


def test_a_worker_that_is_replaced_does_not_mind(networks: dict[str, Path], here: Path) -> None:
    """One episode a process: each checks the files that the egos before it wrote to."""
    (here / "log.txt").write_text("from an earlier run\n")
    assert run(networks["pedestrians"], "--runs", "3") == 0
    assert [row["outcome"] for row in rows(here / "r.csv")] == ["not_triggered"] * 3


def test_a_program_that_changes_under_a_batch_ends_it(
    networks: dict[str, Path], here: Path
) -> None:
    """A program that rewrites itself is another ego in the next process."""
    script = here / "writer.py"
    script.write_text(WRITER + "    open('writer.py', 'a').write('#')\n", encoding="utf-8")
    assert run(networks["pedestrians"], "--runs", "3") == 3
    assert len(rows(here / "r.csv")) < 3
