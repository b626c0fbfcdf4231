"""``cavsumo import``: an exported episode becomes a trace again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cavsumo.batch.judged import Judged, judged
from cavsumo.batch.located import located
from cavsumo.batch.replay import Record
from cavsumo.batch.shown import shown_site
from cavsumo.batch.trust import check_trust
from cavsumo.cli.requests.imports import ImportEpisodeOptions
from cavsumo.cli.steps import say_written
from cavsumo.errors import Exit, InputError
from cavsumo.interop.imports import read_exported
from cavsumo.results.recorded_plan import plan_in
from cavsumo.results.rows import cell
from cavsumo.results.trace_file import packed
from cavsumo.results.traces import Trace, trace_text

SAID = ("outcome", "assertion", "tester", "violation_time_s")


def import_episode(wanted: ImportEpisodeOptions) -> int:
    """Read an episode, judge its tracks once more, and write it as a trace."""
    trace = read_exported(wanted.file)
    record = _here(trace, wanted)
    allowed = None if wanted.trust else ()
    check_trust(record.plan.scenario, wanted.file, allowed, ego=False)
    found = judged(record.plan, trace, shown_site(record.plan, trace))
    row = _row(trace.row, found)
    _say(trace.row, row)
    _write(wanted.output, trace, record, row)
    say_written([wanted.output])
    return Exit.OK


def _here(trace: Trace, wanted: ImportEpisodeOptions) -> Record:
    """The record of the episode, with its network where it is now."""
    plan = plan_in(trace.head, f"{str(wanted.file)!r}")
    record = Record(plan, trace.row, trace, trace.head, wanted.file, alone=True)
    return located(record, wanted.net, shown=True)


def _row(row: Mapping[str, str], found: Judged) -> dict[str, str]:
    """The row of the episode; columns that may not be those of another verdict are empty."""
    said = found.judgement
    new = {
        "outcome": found.outcome,
        "assertion": said.assertion,
        "tester": said.tester,
        "trigger_time_s": cell(said.trigger_time),
        "violation_time_s": cell(said.violation_time),
    }
    if all(row[name] == new[name] for name in SAID):
        return dict(row)
    known = ("run", "agent", "ego", "testers", "seed", "reset", "embodiment", "time_s", "steps")
    return {name: "" for name in row} | {name: row[name] for name in known} | new


def _say(was: Mapping[str, str], row: Mapping[str, str]) -> None:
    """One line about the verdict."""
    same = all(was[name] == row[name] for name in SAID)
    end = "as in the file" if same else f"the file says {_words(was)}"
    print(f"run {row['run']} ({row['agent']}): {_words(row)}: {end}")


def _words(row: Mapping[str, str]) -> str:
    """A verdict."""
    when = f" at {row['violation_time_s']} s" if row["violation_time_s"] else ""
    whose = f" with {row['tester']}" if row["tester"] else ""
    return f"{row['outcome']}, {row['assertion'] or 'no assertion'}{whose}{when}"


def _write(file: Path, trace: Trace, record: Record, row: Mapping[str, str]) -> None:
    """Write the trace, with the present path of its network."""
    head: dict[str, Any] = {**trace.head, "row": row}
    scenario = record.plan.scenario
    named, there = str(scenario.net), str(scenario.net_file)
    plan = {**head["plan"], "scenario": {**head["plan"]["scenario"], "net": there}}
    sums = {there if name == named else name: sha for name, sha in head["sha256"].items()}
    head |= {"plan": plan, "sha256": sums}
    frames = "".join(f"{json.dumps(frame)}\n" for frame in trace.frames)
    try:
        file.write_bytes(packed(trace_text(head, frames)))
    except OSError as error:
        raise InputError(f"{str(file)!r}: cannot be written: {error.strerror}") from error
