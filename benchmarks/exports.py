"""Exports of failures: valid, as recorded in another player, and the same collision there.

Plays batches on several networks until each has failures enough, exports them as OpenSCENARIO with
OpenDRIVE and as CommonRoad, imports them again, and asks others:

* the checkers asam-qc-openscenarioxml and asam-qc-opendrive, which hold the schemas, in an
  environment of their own (``--checkers``, its Python);
* esmini, a player of OpenSCENARIO: where is every body at every timestep, and who collides when?
* commonroad-io, in an environment of its own (``--commonroad``, its Python): is it valid by the
  schema, whose occupancies overlap that of the ego first, and does the collision checker of
  commonroad-drivability-checker say so too, where it is installed?

    python benchmarks/exports.py --failures 17 --net crossing --net junction --net FILE.net.xml \\
        --esmini esmini --checkers CHECKERS/bin/python --commonroad COMMONROAD/bin/python
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import io
import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cavsumo
from cavsumo.cli import main as command
from cavsumo.interop.commonroad import HEAD_COMMENT
from cavsumo.interop.tracks import at_axle, stays
from cavsumo.results.traces import Trace, read_trace, states

KINDS = ("pedestrian", "car")
COUNTS = "exported issues compared missing same tests commonroad checker imported".split()
OTHERS = Path(__file__).parent / "exports_by_others"  # scripts for environments of their own
ESMINI = (
    "--osc test.xosc --headless --csv_logger out.csv --collision --traj_filter 0 "
    "--logfile_path log.txt"
)
STEP_S = {"recorded": "0.01", "test": "0.05"}  # of esmini
CELLS = 11, 12, 24  # with x, y and heading, behind the cell with the name of a body
OF_A_BODY = 31  # cells


@dataclass
class Found:
    """Results of one network and kind of tester.

    Attributes:
        exported: failures.
        issues: of the checkers: errors and warnings.
        compared: places compared.
        far, turned: the largest deviations [m], [rad].
        missing: bodies that are there in one and not in the other.
        same: exports in which the same pair collides within a timestep.
        tests: exports as tests in which the ego and the tester collide.
        commonroad: those that are valid and in which the occupancies overlap as they did.
        checker: those in which the collision checker finds that pair too.
        imported: imports, of both formats, with the same tracks and verdict.
        seen: what the checkers said.
    """

    exported: int = 0
    issues: int = 0
    compared: int = 0
    far: float = 0.0
    turned: float = 0.0
    missing: int = 0
    same: int = 0
    tests: int = 0
    commonroad: int = 0
    checker: int = 0
    imported: int = 0
    seen: set[str] = field(default_factory=set)

    def add(self, other: Found) -> None:
        """Count those of another one too."""
        for name in COUNTS:
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.far, self.turned = max(self.far, other.far), max(self.turned, other.turned)
        self.seen |= other.seen


def main() -> None:
    """Print the table."""
    options, all_of_them = _parser().parse_args(), Found()
    heads = ("failures", "issues", "places", "m", "rad", "missing", "same pair", "as test",
             "commonroad", "checker", "imported")  # fmt: skip
    print(f"{'':<34}" + "".join(f"{head:>11}" for head in heads))
    for net in options.net or ["crossing", "junction", "pedestrians"]:
        for kind in KINDS:
            with TemporaryDirectory() as folder:
                found = _measured(net, kind, options, Path(folder))
            print(_line(f"{Path(net).name.removesuffix('.net.xml')}, {kind}", found), flush=True)
            all_of_them.add(found)
    print(_line("all", all_of_them))
    print(*sorted(all_of_them.seen), sep="\n", end="\n" if all_of_them.seen else "")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--failures", type=int, default=17, help="of each network and kind")
    parser.add_argument("--runs", type=int, default=60, help="episodes of each")
    parser.add_argument("--net", action="append", help="default: crossing, junction, pedestrians")
    parser.add_argument("--traffic", default="4", help="drawn background")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--esmini", default=shutil.which("esmini"), help="the player")
    parser.add_argument("--checkers", help="a Python with the checkers")
    parser.add_argument("--commonroad", help="a Python with commonroad-io")
    return parser


def _measured(net: str, kind: str, options: argparse.Namespace, folder: Path) -> Found:
    """The failures of one network and kind, exported and played."""
    file = folder / "batch.csv"
    results = cavsumo.run(
        net, kind=kind, agents=["timing"], ego="constant", traffic=options.traffic,
        reference="none", runs=options.runs, seed=options.seed, output=file, progress=False,
    )  # fmt: skip
    found, traces = Found(), dict[Path, Trace]()
    for run in results.failures["run"].head(options.failures):
        one = folder / f"run{run}"
        traces[one] = read_trace(folder / "batch" / f"run{run:06d}.jsonl.gz")
        for to, way in (("openscenario", "recorded"), ("openscenario", "test"),
                        ("commonroad", "recorded")):  # fmt: skip
            _export(file, run, to, one / (way if to == "openscenario" else to), way)
    found.exported = len(traces)
    if options.checkers and traces:
        _check(found, list(traces), options.checkers)
    if options.commonroad and traces:
        _read(found, traces, options.commonroad)
    for one, trace in traces.items():
        if options.esmini:
            _play(found, trace, one, options.esmini)
        for name in ("recorded/test.xosc", "commonroad/test.xml"):
            found.imported += _imported(one / name, net, trace)
    return found


def _call(*words: str) -> str:
    """Call a command of cavsumo, which must not fail; its output."""
    with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.redirect_stderr(said):
        if command(words) != 0:
            sys.exit(f"{' '.join(words)}: {said.getvalue()}")
    return said.getvalue()


def _export(file: Path, run: int, to: str, folder: Path, way: str) -> None:
    """Export an episode into a new folder."""
    folder.mkdir(parents=True)
    _call("export", str(file), str(run), "--to", to, "--as", way, "-o", str(folder))


def _imported(file: Path, net: str, trace: Trace) -> bool:
    """Whether an export, imported, has the same tracks to 1e-6 and the same verdict."""
    out = file.with_suffix(".jsonl.gz")
    said = _call("import", str(file), "--net", net, "-o", str(out))
    again = read_trace(out)
    return "as in the file" in said and len(again.frames) == len(trace.frames) and all(
        alike(one, other) for one, other in zip(trace.frames, again.frames, strict=True)
    )  # fmt: skip


def alike(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether the same bodies are in two frames, at the same places to 1e-6."""
    a, b = ({(part, name): pose for part, name, pose in states(f)} for f in (one, other))
    if one["time_s"] != other["time_s"] or a.keys() != b.keys():
        return False
    apart = [[x - y for x, y in zip(a[name], b[name], strict=True)] for name in a]
    return all(max(map(abs, (x, y, v, math.remainder(o, math.tau)))) < 1e-6 for x, y, v, o in apart)


def _check(found: Found, folders: Sequence[Path], python: str) -> None:
    """Ask the checkers about the scenarios, and about each road file once."""
    roads = {(one / "recorded" / "test.xodr").read_bytes(): one for one in folders}
    files = [one / way / "test.xosc" for one in folders for way in STEP_S]
    files += [one / "recorded" / "test.xodr" for one in roads.values()]
    subprocess.run([python, OTHERS / "check.py", *map(str, files)], check=True, capture_output=True)
    for file in files:
        text = file.with_name(f"{file.name}.xqar").read_text("utf-8")
        found.issues += text.count("<Issue ")
        found.seen |= {*re.findall(r'<Issue [^>]*ruleUID="([^"]+)"', text)}


def _play(found: Found, trace: Trace, folder: Path, esmini: str) -> None:
    """Play an export as recorded and as a test, and add what is seen."""
    far, turned, compared, missing = deviations(trace, play(folder / "recorded", esmini))
    found.far, found.turned = max(found.far, far), max(found.turned, turned)
    found.compared, found.missing = found.compared + compared, found.missing + missing
    tester, time = trace.row["tester"], float(trace.row["violation_time_s"])
    met = collisions(folder / "recorded").get(tester, math.inf)
    found.same += abs(met - time) <= step(trace) + 1e-6
    play(folder / "test", esmini, STEP_S["test"])
    found.tests += tester in collisions(folder / "test")


Played = Mapping[int, Mapping[str, tuple[float, float, float]]]  # by hundredths of a second


def play(folder: Path, esmini: str, step_s: str = STEP_S["recorded"]) -> Played:
    """Play an export: where every body is, by the time in hundredths of a second."""
    words = [esmini, *ESMINI.split(), "--fixed_timestep", step_s]
    subprocess.run(words, cwd=folder, capture_output=True, timeout=200, check=True)
    east, north = _offset(folder / "test.xodr")
    return {time: {name: (x - east, y - north, o) for name, (x, y, o) in bodies.items()}
            for time, bodies in _rows(folder / "out.csv")}  # fmt: skip


def _rows(file: Path) -> Iterator[tuple[int, dict[str, list[float]]]]:
    """The rows of esmini's table: the time, and the places of all bodies by their names."""
    with file.open(encoding="utf-8") as stream:
        for row in csv.reader(stream, skipinitialspace=True):
            if len(row) > OF_A_BODY and row[0].isdecimal():
                at = range(2, len(row) - CELLS[-1], OF_A_BODY)
                bodies = {row[i].strip(): [float(row[i + cell]) for cell in CELLS] for i in at}
                yield round(100 * float(row[1])), bodies


def _offset(file: Path) -> tuple[float, float]:
    """The offset of the road's coordinates, which esmini adds in its output."""
    found = re.search(r'<offset x="([-\d.e+]+)" y="([-\d.e+]+)"', file.read_text("utf-8"))
    return (float(found[1]), float(found[2])) if found else (0.0, 0.0)


def deviations(trace: Trace, played: Played) -> tuple[float, float, int, int]:
    """The largest deviation in m and rad, the places compared, and those that are missing."""
    far = turned = 0.0
    expected = set[tuple[int, str]]()
    for body in stays(trace):
        for one in (point for track in body.tracks for point in at_axle(body.shape, track)):
            time = round(100 * one.time)
            expected.add((time, body.name))
            if (there := played.get(time, {}).get(body.name)) is not None:
                far = max(far, math.dist(there[:2], (one.x, one.y)))
                turned = max(turned, abs(math.remainder(there[2] - one.heading, math.tau)))
    times = {time for time, _ in expected}
    there_too = {(time, name) for time in times for name in played.get(time, ())}
    return far, turned, len(expected & there_too), len(expected ^ there_too)


def collisions(folder: Path) -> dict[str, float]:
    """When the ego first touches which body [s]."""
    text = (folder / "log.txt").read_text(encoding="utf-8")
    found: dict[str, float] = {}
    for time, one, other in re.findall(
        r"\[([\d.]+)\] \[warn\] Collision between (\S+) and (\S+)", text
    ):
        if "ego" in (one, other):
            found.setdefault(other if one == "ego" else one, float(time))
    return found


def step(trace: Trace) -> float:
    """The length of a timestep [s]."""
    return float(trace.head["plan"]["scenario"]["step_length"])


def _read(found: Found, traces: Mapping[Path, Trace], python: str) -> None:
    """Ask commonroad-io about the exports."""
    files = [one / "commonroad" / "test.xml" for one in traces]
    done = subprocess.run(
        [python, OTHERS / "read.py", *map(str, files)], capture_output=True, text=True, check=True
    )
    for file, said, trace in zip(
        files, json.loads(done.stdout.splitlines()[-1]), traces.values(), strict=True
    ):
        head = HEAD_COMMENT.search(file.read_text("utf-8"))
        assert head is not None
        names = json.loads(head[1])["ids"]
        hits = {names[number]: at * step(trace) for number, at in said["hits"].items()}
        tester, when = trace.row["tester"], float(trace.row["violation_time_s"])
        right = abs(hits.get(tester, math.inf) - when) <= step(trace) + 1e-6
        whole = said["valid"] and said["lanelets"] > 0 and said["problems"] == 1
        found.commonroad += whole and right
        found.checker += tester in {names[str(one)] for one in said["checker"] or ()}


def _line(name: str, found: Found) -> str:
    """A row of the table."""
    counts = [getattr(found, name) for name in COUNTS]
    cells = [*counts[:3], f"{found.far:.5f}", f"{found.turned:.5f}", *counts[3:]]
    return f"{name:<34}" + "".join(f"{cell:>11}" for cell in cells)


if __name__ == "__main__":
    main()
