"""A large batch that goes on: what is read of it by columns is what is read row by row."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

import pytest
from report_files import JUDGED, SOME, write
from test_columnar import CHANGES, Change

from cavsumo.batch.resume_large import TakenUp, taken_up
from cavsumo.batch.tally import Tally
from cavsumo.results import columnar
from cavsumo.results.reading import check_cells, read_manifest
from cavsumo.results.writing import Recorder

ACCEPTED = ("nothing", "torn", "header alone", "a quoted comma", "other letters")


@pytest.fixture(params=[200, 1 << 20], ids=["several blocks", "one block"])
def file(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A batch that is read in blocks of some bytes."""
    monkeypatch.setattr(columnar, "BLOCK", request.param)
    return write(tmp_path / "r.csv", [*SOME, *JUDGED], reference="human")


def damaged(file: Path, change: Change) -> bytes:
    """The content of a batch that was changed."""
    file.write_text(change(file.read_text(encoding="utf-8")), encoding="utf-8", newline="")
    return file.read_bytes()


def gone_on(file: Path, content: bytes, resume: Callable[[Recorder], Tally]) -> dict[str, Any]:
    """The state of a recorder and the counts, when a batch of that content has been taken up."""
    file.write_bytes(content)
    with Recorder(file) as recorder:
        tally = resume(recorder)
        own = {name: vars(recorder)[name] for name in ("_last", "traces", "manifest")}
        recorder._rows.check()
        left, counts = file.read_bytes(), repr(vars(tally))  # as text nan is like nan
        return own | {
            "size": recorder._rows.size,
            "sum": recorder._rows.sum.hexdigest(),
            "left": left,
            "counts": counts,
        }


@pytest.mark.parametrize("name", CHANGES)
def test_a_batch_goes_on_as_if_read_row_by_row(file: Path, name: str) -> None:
    """The same counts, files and next episodes; what is not as we write it is not taken."""
    content, manifest = damaged(file, CHANGES[name]), read_manifest(file)
    found = taken_up(file, iter(range(50)))
    assert (found is not None) >= (name in ACCEPTED)
    if found is None:
        return
    rest: list[list[int]] = [list(islice(found.todo, 2))]

    def by_columns(recorder: Recorder) -> Tally:
        assert isinstance(found, TakenUp)
        recorder.resume_after(manifest, found.written)
        return found.tally

    def by_rows(recorder: Recorder) -> Tally:
        tally, todo = Tally(), iter(range(50))
        for row in recorder.resume(manifest, todo):
            check_cells(file, row)
            tally.add(row)
        rest.append(list(islice(todo, 2)))
        return tally

    assert gone_on(file, content, by_columns) == gone_on(file, content, by_rows)
    assert rest[0] == rest[1]


@pytest.mark.parametrize("runs", [range(1, 50), range(3)])
def test_rows_of_another_batch_are_not_taken(file: Path, runs: range) -> None:
    """Whose episodes begin elsewhere, or are fewer."""
    assert taken_up(file, iter(runs)) is None
