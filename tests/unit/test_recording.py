"""What traces hold for playing back, read strictly: any damage is one sentence."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import frame, json_lines

from cavsumo.agents.recorded import Recorded, RecordedAgent
from cavsumo.errors import ResultsError
from cavsumo.model.bodies import CAR, NOOP, Action, Body
from cavsumo.model.carriageway import StartRecord
from cavsumo.model.departures import Demand, Stage, Trip, Walk
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.results.traces import parsed, read_moments, read_trace, trace_head

DEMAND = Demand(
    (Trip(0.3, "a", "t", ("e", "f"), 1, 5.1, 8.0, 1.0417),),
    (Walk(2.0, "p", "DEFAULT_PEDTYPE", "e", 3.5, 0.9, (Stage(("e",), 7.25),)),),
    {"t": {"vClass": "truck", "sigma": "0.1"}},
)
STARTS = (
    StartRecord(1.0, 2.0, 0.1, None, 0, -0.25, False, ("e", "f")),
    StartRecord(5.5, 6.0, -3.0, 2.5, 3, 0.0, True, ("g",)),
)
ACTIONS = [(Action(0.5, -0.1), NOOP), (NOOP, Action(-1.4, 0.3))]
PLAYED = Recorded(77, ACTIONS, STARTS, STARTS[::-1], DEMAND, ("crossing",))
ORIGIN: dict[str, Any] = {"plan": {}, "sha256": {}, "versions": {}, "sumo_options": {}}
ROW = {"run": 0, "seed": 77, "outcome": "not_triggered", "time_s": 0.2}
Damage = Callable[[dict[str, Any], list[dict[str, Any]]], Any]


def text(played: Recorded = PLAYED, damage: Damage = lambda *_: None) -> str:
    """The trace of two timesteps, perhaps damaged."""
    ego = BodyState(Body("ego", CAR), 1.0, 2.0, 3.0, 0.5)
    testers = tuple(BodyState(Body(f"tester{i}", CAR), 9.0 * i, 0.0, 1.0, 0.0) for i in range(2))
    seen = [Snapshot(i, i / 10, ego, 0.0, testers) for i in range(3)]
    head = trace_head(ORIGIN, ROW, None, seen, played)
    frames = [frame(s, a) for s, a in zip(seen, (*played.actions, ()), strict=True)]
    head, *frames = json.loads(json.dumps([head, *frames]))
    damage(head, frames)
    # Python's JSON, in which a file may also hold what is no number
    return json_lines(head, *frames)


def test_a_record_comes_back_from_its_trace() -> None:
    """Every number, name and place; the last frame has no actions, or some that led nowhere."""
    assert repr(parsed(text()).recording()) == repr(_as_tuples(PLAYED))
    ended = parsed(text(damage=lambda _, frames: frames[-1].update(actions=[[1, 0], [0, 0]])))
    assert len(ended.recording().actions) == 3
    unknown = parsed(text(Recorded(77, ACTIONS, STARTS))).recording()
    assert (unknown.departures, unknown.waited, unknown.approaches) == (None, (), ())


def _as_tuples(played: Recorded) -> Recorded:
    """A record with its actions as tuples, as they are read."""
    return Recorded(played.seed, tuple(played.actions), *list(vars(played).values())[2:])


def test_agents_begin_and_act_as_recorded() -> None:
    """Each knows its own bodies; what it remembers is plain data and survives JSON."""
    memories = json.loads(json.dumps(PLAYED.memories(((1,), (0,)))))
    for memory, body in zip(memories, (1, 0), strict=True):
        agent = RecordedAgent()
        agent.remember(memory)
        assert agent.recorded_starts == [STARTS[body]]
        assert agent.recorded_waits == [STARTS[1 - body]]
        assert agent.recall()["actions"] == [(joint[body],) for joint in ACTIONS]
    (both,) = PLAYED.agents(((0, 1),))
    assert both.recorded_starts == list(STARTS)


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda h, _: h.pop("starts"), "starts: Field required"),
        (lambda h, _: h.pop("departures"), "departures: Field required"),
        (lambda h, _: h.update(starts=[]), "0 starts"),
        (lambda h, _: h["starts"].pop(), "1 starts and 2 places to wait at"),
        (lambda h, _: h["starts"][0].__setitem__(0, "1.0"), r"starts\.0\.0"),
        (lambda h, _: h["starts"][0].__setitem__(7, "e f"), r"starts\.0"),
        (lambda h, _: h["departures"].update(more=1), r"departures\.more"),
        (lambda h, _: h["departures"]["trips"][0].__setitem__(3, []), "'a': without edges"),
        (lambda h, _: h["departures"]["walks"][0][6][0].__setitem__(0, []), "'p': a walk without"),
        (lambda h, _: h["departures"]["types"]["t"].update(imgFile="x"), "attribute 'imgFile'"),
        (lambda h, _: h["departures"]["types"]["t"].update({'a="" b': ""}), "unknown attribute"),
        (lambda h, _: h["departures"]["types"]["t"].update(sigma=1), r"departures\.types\.t"),
        (lambda _, f: f[0]["actions"].pop(), "step 0: 1 actions of 2 testers"),
        (lambda _, f: f[1].update(actions=[]), "step 1: 0 actions of 2 testers"),
        (lambda _, f: f.clear(), "no frames"),
    ],
)
def test_a_damaged_record_is_refused(damage: Damage, words: str) -> None:
    """Where, and what was expected; the frames can still be shown."""
    line = text(damage=damage)
    with pytest.raises(ResultsError, match=words) as error:
        parsed(line).recording()
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_numbers_that_json_does_not_have_are_refused(number: float) -> None:
    """Python writes and reads them; a trace has none."""
    line = text(damage=lambda head, _: head["starts"][0].__setitem__(1, number))
    with pytest.raises(ValueError, match=r"line 1: (NaN|Infinity) is no number"):
        parsed(line)


@pytest.mark.parametrize("action", ["[1.0]", "[1, 2, 3]", '["1", 2]', "7", "null", "{}"])
def test_actions_that_are_none_are_refused(tmp_path: Path, action: str) -> None:
    """A pair of numbers for each body, in every line of format 2."""
    file = tmp_path / "t.jsonl"
    file.write_text(text().replace("[0.5, -0.1]", action), encoding="utf-8")
    with pytest.raises(ResultsError, match=r"trace '.*t\.jsonl'"):
        read_trace(file)
    file.write_text(text().replace('"actions"', '"act"'), encoding="utf-8")
    with pytest.raises(ResultsError, match="line 2: actions: Field required"):
        read_trace(file)


def test_a_trace_of_format_1_is_read_and_holds_no_record(tmp_path: Path) -> None:
    """Its lines have no actions."""

    def older(head: dict[str, Any], frames: list[dict[str, Any]]) -> None:
        head["format"] = "cavsumo-trace-1"
        for key in ("starts", "waited", "departures", "approaches"):
            del head[key]
        for one in frames:
            del one["actions"]

    file = tmp_path / "t.jsonl"
    file.write_text(text(damage=older), encoding="utf-8")
    old, new = read_trace(file), parsed(text())
    assert (old.has_recording, new.has_recording) == (False, True)
    assert [f["ego"] for f in old.frames] == [f["ego"] for f in new.frames]
    assert read_moments(file, [0.1])[0][1]["step"] == 1


@pytest.mark.parametrize("reader", [read_trace, lambda file: read_moments(file, [0.0])])
def test_a_trace_of_another_format_is_refused(tmp_path: Path, reader: Callable[..., Any]) -> None:
    """One sentence that names both, whoever reads it."""
    file = tmp_path / "x.jsonl"
    file.write_text(text(damage=lambda h, _: h.update(format="cavsumo-trace-9")), encoding="utf-8")
    with pytest.raises(ResultsError) as error:
        reader(file)
    assert str(error.value) == (
        f"trace {str(file)!r}: format cavsumo-trace-9, this version reads cavsumo-trace-1 and "
        "cavsumo-trace-2"
    )
