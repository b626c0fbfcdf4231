"""Trace files and the text in them: compressed, deterministic, bounded."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import frame

from cavsumo.errors import ResultsError
from cavsumo.model.bodies import CAR, NOOP, PEDESTRIAN, Action, Body
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.results import trace_file
from cavsumo.results.frame_text import frames_text
from cavsumo.results.trace_file import is_trace, packed, read_trace_text, trace_name, unpacked

NUMBERS = st.floats(-1e9, 1e9)
TEXT = '{"a": "ä"}\n' * 100


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Where a trace will be."""
    return tmp_path / "run000001.jsonl.gz"


def test_the_bytes_depend_on_the_text_alone() -> None:
    """No time, no name; and any gzip reads them."""
    data = packed(TEXT)
    assert data == packed(TEXT)
    assert data[3:8] == bytes(5)  # flags, of which one would say that a name follows, and the time
    assert gzip.decompress(data).decode("utf-8") == TEXT
    assert len(data) < len(TEXT) / 3


@pytest.mark.parametrize(
    "data", [packed(TEXT), gzip.compress(TEXT.encode(), mtime=0), TEXT.encode()]
)
def test_compressed_and_plain_are_read_under_any_name(file: Path, data: bytes) -> None:
    """What a file holds is known by its first bytes, since people rename and unpack."""
    file.write_bytes(data)
    assert read_trace_text(file) == TEXT


def test_names() -> None:
    """Both endings are those of a trace; results are none."""
    assert trace_name(Path("a/r.csv"), 7) == "r/run000007.jsonl.gz"
    assert [is_trace(Path(n)) for n in ("a.jsonl", "a.jsonl.gz", "a.csv", "a.gz")] == [
        *(True, True, False, False)
    ]


def test_a_bomb_is_refused_before_it_is_large(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No more is decompressed than the bound, and a byte; one sentence."""
    monkeypatch.setattr(trace_file, "LARGEST_B", 5000)
    file.write_bytes(gzip.compress(bytes(5000)))
    assert len(read_trace_text(file)) == 5000
    file.write_bytes(gzip.compress(bytes(5_000_000)))
    with pytest.raises(ResultsError) as error:
        read_trace_text(file)
    said = "holds more than 5000 bytes, expected at most so many"
    assert str(error.value) == f"trace {str(file)!r}: {said}"


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (packed(TEXT)[:-9], "cannot be decompressed: it ends too early"),
        (packed(TEXT)[:2], "cannot be decompressed: it ends too early"),
        (packed(TEXT) + b"x", "cannot be decompressed: it goes on behind its end"),
        (packed(TEXT)[:20] + b"\xff\xff" + packed(TEXT)[22:], "cannot be decompressed: "),
        (packed(TEXT)[:-8] + bytes(8), "cannot be decompressed: .*incorrect data check"),
        (gzip.compress(b"a\n\xff", mtime=0), "line 2: no UTF-8, byte 0xff"),
        (b"\xff", "line 1: no UTF-8"),
    ],
)
def test_damage_is_one_sentence(file: Path, data: bytes, words: str) -> None:
    """With the name of the file."""
    file.write_bytes(data)
    with pytest.raises(ResultsError, match=f"^trace '.*run000001.jsonl.gz': {words}") as error:
        read_trace_text(file)
    assert "\n" not in str(error.value)


def test_it_says_which_trace_was_damaged() -> None:
    """A name that the caller gives."""
    with pytest.raises(ResultsError, match=r"^trace of run 7: cannot be decompressed"):
        unpacked(packed(TEXT)[:20], "trace of run 7")


# Frames


def moment(step: int, x: float = 1.0, v: float = 3.0) -> Snapshot:
    """An ego, a tester that stands, a car of an odd name and a pedestrian of the same."""
    ego = BodyState(Body("ego", CAR), x, 2.0, v, 0.5)
    tester = BodyState(Body("tester0", PEDESTRIAN), 5.0, 6.0, 0.0, -0.5)
    others = tuple((Body('a "é"\n', kind), x, 9.0, v, 3.0) for kind in (CAR, PEDESTRIAN))
    return Snapshot(step, 0.1 * step, ego, 0, (tester,), others, ("G", "r"))


@given(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=4))
def test_frames_are_what_json_makes_of_them(numbers: list[tuple[float, float]]) -> None:
    """Character by character, for every number, for ids of all sorts and bodies that stand."""
    seen = [moment(i, x, v) for i, (x, v) in enumerate(numbers)]
    chosen = [(NOOP, Action(*pair)) for pair in numbers][:-1]
    lines = frames_text([*seen, seen[-1]], chosen).splitlines(keepends=True)
    for line, snapshot, actions in zip(lines, [*seen, seen[-1]], [*chosen, (), ()], strict=True):
        assert line == json.dumps(found := json.loads(line)) + "\n"
        assert list(found) == ("step time_s ego steering testers background lights actions".split())
        assert found["ego"] == list(snapshot.ego[1:])
        assert found["testers"] == {"tester0": [5.0, 6.0, 0.0, -0.5]}
        assert found["background"] == {'a "é"\n': list(snapshot.raw_background[1][1:])}
        assert found["lights"] == "Gr"
        assert found["actions"] == [list(action) for action in actions]


def test_numbers_of_other_sorts() -> None:
    """Whole ones of users' agents stay whole, numpy's are written like Python's."""
    found = frame(moment(0), [Action(1, 0), Action(np.float64(0.5), np.float64(-1e-7))])  # type: ignore[list-item]
    assert json.dumps(found["actions"]) == "[[1, 0], [0.5, -1e-07]]"


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf")])
def test_numbers_that_json_does_not_have_are_not_written(number: float) -> None:
    """A trace that could not be read again is none."""
    with pytest.raises(ValueError, match="which JSON does not have"):
        frame(moment(0, number))
    with pytest.raises(ValueError, match="JSON"):
        frame(moment(0), [Action(0, number)])
