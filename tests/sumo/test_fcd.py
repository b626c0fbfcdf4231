"""Traces as SUMO's floating car data, beside what SUMO itself writes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import sumolib
from support import frame, json_lines

from cavsumo.agents.recorded import Recorded
from cavsumo.batch.replay import Record
from cavsumo.errors import InputError
from cavsumo.interop.fcd import write_fcd
from cavsumo.network.site import Site
from cavsumo.results.traces import Trace, parsed, trace_head
from cavsumo.sumo import connection
from cavsumo.sumo.options import OPTIONS
from cavsumo.sumo.world import World

Seen = dict[str, tuple[str, float, float, float, float]]  # element, x, y, angle, speed by id


def read(file: Path) -> list[Seen]:
    """Everybody in every timestep, as sumolib reads it."""
    return [
        {
            str(one.id): (element, *(float(getattr(one, k)) for k in ("x", "y", "angle", "speed")))
            for element in ("vehicle", "person")
            for one in getattr(timestep, element) or ()
        }
        for timestep in sumolib.xml.parse(str(file), "timestep")
    ]


def test_it_is_what_sumo_writes_itself(
    open_world: Callable[..., World], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The ego and the background: the same elements, points, angles and speeds as SUMO's own.

    Without testers: SUMO crashes when it writes the lane of a body that is on none.
    """
    theirs, ours = tmp_path / "sumo.xml", tmp_path / "ours.xml"
    monkeypatch.setattr(connection, "OPTIONS", {**OPTIONS, "fcd-output": str(theirs)})
    with open_world("crossing", routes="auto") as world:
        snapshots = [world.reset(1, (), ())]
        for _ in range(50):
            snapshot = world.step((), None)
            assert snapshot is not None
            snapshots.append(snapshot)
    write_fcd(
        Trace(trace_head({}, {}, None, snapshots, Recorded(0, ())), [frame(s) for s in snapshots]),
        ours,
    )
    frames, simulated = read(ours), read(theirs)
    entered = next(i for i, seen in enumerate(simulated) if "ego" in seen)
    assert len(simulated) - entered == len(frames) == 51
    for mine, seen in zip(frames, simulated[entered:], strict=True):
        assert mine.keys() == seen.keys()
        for name in mine:
            assert mine[name][0] == seen[name][0]
            assert mine[name][1:] == pytest.approx(seen[name][1:], abs=3e-6)
    assert {element for element, *_ in frames[0].values()} == {"vehicle", "person"}


def test_testers_are_among_them(shown: tuple[Record, Trace, Site], tmp_path: Path) -> None:
    """A tester pedestrian is a person, at the middle of the front edge of its box."""
    trace, file = shown[1], tmp_path / "fcd.xml"
    write_fcd(trace, file)
    frames = read(file)
    assert len(frames) == len(trace.frames)
    x, y, v, o = trace.frames[0]["testers"]["tester2"]
    assert o == pytest.approx(0.0224, abs=1e-4)  # nearly east, so the front is nearly east of it
    element, *found = frames[0]["tester2"]
    assert element == "person"
    assert found == pytest.approx([x + 0.65625 / 2, y, 90.0 - 1.2846, v], abs=0.01)


def test_times_and_names_are_sumos(shown: tuple[Record, Trace, Site], tmp_path: Path) -> None:
    """Timesteps carry their times, and any name survives the way through XML."""
    trace, file, odd = shown[1], tmp_path / "fcd.xml", 'a "b" <c> & d'
    text = json_lines(trace.head, *trace.frames[:3])
    changed = parsed(text.replace("bg_car0", odd.replace('"', '\\"')))
    write_fcd(changed, file)
    assert [t.time for t in sumolib.xml.parse(str(file), "timestep")] == ["0.000", "0.100", "0.200"]
    assert odd in read(file)[0]


def test_a_file_that_cannot_be_written_is_refused(
    shown: tuple[Record, Trace, Site], tmp_path: Path
) -> None:
    """One sentence with the option's name."""
    with pytest.raises(InputError, match=r"--fcd .*: Is a directory"):
        write_fcd(shown[1], tmp_path)


def test_everybody_has_a_type(shown: tuple[Record, Trace, Site], tmp_path: Path) -> None:
    """The kind of body stands where SUMO has the vehicle type."""
    file = tmp_path / "fcd.xml"
    write_fcd(shown[1], file)
    first: Any = next(iter(sumolib.xml.parse(str(file), "timestep")))
    types = {v.id: v.type for v in first.vehicle}
    assert types["ego"] == "car"
    assert types["bg_car0"] == "passenger"
