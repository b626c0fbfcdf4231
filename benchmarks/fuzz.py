"""Damaged input of every sort given to the command line: refusals, tracebacks, hangs.

    python benchmarks/fuzz.py [--cases 10000] [--seed 1] [--sort NAME ...] [--show 3]

Everything is read and checked in this process as ``cavsumo`` does it; where a simulation would
start, a case is accepted. Each case is damaged input derived from a whole one (``fuzz_inputs``).
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import re
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from fuzz_inputs import json_lines, jsons, tables, tomls, xmls
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import manifest, prepare
from cavsumo.batch.worker import Worker
from cavsumo.cli import main as cavsumo
from cavsumo.egos.external import protocol
from cavsumo.errors import EgoError
from cavsumo.model.scenario import plan_from
from cavsumo.results.writing import Recorder

ROOT = Path(__file__).resolve().parent.parent
LIMIT_S = 20.0
LONGEST = 500  # characters of a message
STATUSES = (0, 1, 2, 3, 130)
# Words of Python that mean nothing to somebody whose file is damaged.
PYTHON = re.compile(
    r"\b\w*(Error|Exception|Warning|StopIteration)\b|object has no|NoneType|list index"
    r"|subscriptable|unhashable|object is not|Traceback|<class|unexpected keyword|positional arg"
    r"|recursion|set_int_max|codec can't|Errno|not iterable|unpack|int\(\)|float\(\)"
    r"|not supported between|datetime\.|<.* at 0x|Fraction\("
)


class Accepted(BaseException):
    """A simulation would start now."""


class Hang(BaseException):
    """A case took too long."""


@dataclass(frozen=True)
class Case:
    """A command in a folder: its words, and the files that are put there before."""

    words: tuple[str, ...]
    files: Mapping[str, bytes]


@dataclass(frozen=True)
class Verdict:
    """What became of a case.

    Attributes:
        end: refused, accepted, or what is wrong: traceback, hang, words, long, status, written.
        said: what was printed on stderr, or the traceback.
    """

    end: str
    said: str


GOOD = ("refused", "accepted")


@dataclass(frozen=True)
class Whole:
    """Whole files that cases are derived from: their contents by name."""

    files: Mapping[str, bytes]

    def text(self, name: str) -> str:
        """A file as text."""
        return self.files[name].decode()

    def tree(self, name: str) -> Any:
        """A JSON file as a document."""
        return json.loads(self.files[name])


def whole_files() -> Whole:
    """A small batch on the straight road with traces, a network, an extract, a game, a policy."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        folder = Path()
        shutil.copy(ROOT / "networks" / "pedestrians.net.xml", "road.net.xml")
        shutil.copy(ROOT / "networks" / "junction.net.xml", "junction.net.xml")
        shutil.copy(ROOT / "routes" / "pedestrians.rou.xml", "road.rou.xml")
        shutil.copy(ROOT / "tests" / "data" / "crossroads.osm", "cross.osm")
        _play(folder / "found.csv")
        cases = json.loads((ROOT / "tests" / "data" / "ssp_games.json").read_text())["cases"]
        game = min(
            (case for case in cases if case["n_states"] > 3 and "goal" in case),
            key=lambda c: len(str(c)),
        )
        (folder / "game.json").write_text(json.dumps(game))
        shutil.copy(ROOT / "examples" / "train_tester" / "tester.npz", "tester.npz")
        files = [f for f in folder.rglob("*") if f.is_file()]
        return Whole({str(f): f.read_bytes() for f in files})


def _play(csv_file: Path) -> None:
    """Three episodes of an ego that keeps its speed."""
    given = {"net": "road.net.xml", "routes": "none", "ego": "constant", "runs": 3, "end": 8.0}
    prepared = prepare(plan_from(given | {"trace": "all", "testers": 2, "seed": 3}, "fuzz"))
    with EpisodeRunner(prepared.plan, prepared.site) as runner, Recorder(csv_file) as recorder:
        recorder.begin(manifest(prepared))
        for run in range(3):
            recorder.write(runner.play(job(prepared.plan, run))[0])
        recorder.finish("finished", {"episodes": 3, "counts": {}})


def strategies(whole: Whole) -> dict[str, st.SearchStrategy[Case]]:
    """Cases of every sort."""
    scenario = {
        "net": "road.net.xml",
        "routes": "road.rou.xml",
        "additional": [],
        "agents": ["timing", "a=random"],
        "runs": 2,
        "seed": 3,
        "ego": "time-gap",
        "ego_params": {"time_gap_s": 1.5},
        "params": {"a.between": "repeat"},
        "ego_sensor": {"range_m": 30.0},
        "testers": 2,
        "end": 8.0,
        "step_length": 0.1,
        "assertions": ["reaction-zone"],
        "assertion_params": {"max_decel": 8.0},
        "formulas": {"apart": "always (gap_m > 0.5)"},
        "shard": "1/2",
    }
    drawn = {k: v for k, v in scenario.items() if k not in ("routes", "shard", "formulas")}
    drawn |= {"traffic": [4.0, 2.0], "traffic_seed": 1, "ego_route": "straight", "kind": "bicycle"}
    vary = {
        "testers": [1, 3],
        "place": [{"name": "a", "net": "road.net.xml"}, {"name": "b", "end": 4}],
    }
    study = {"net": "road.net.xml", "runs": 2, "vary": vary}
    base = {k: v for k, v in whole.files.items()}
    lines = [json.loads(line) for line in whole.text("found/run000000.jsonl").splitlines()[:6]]
    net, osm = whole.text("road.net.xml"), whole.text("cross.osm")

    def case(name: str, data: Any, *words: str) -> st.SearchStrategy[Case]:
        commands = st.sampled_from([tuple(w.split()) for w in words])
        return st.builds(lambda d, c: Case(c, base | {name: d}), data, commands)

    return {
        "scenario": case("c.toml", tomls(scenario) | tomls(drawn), "run -c c.toml -q"),
        "study": case("c.toml", tomls(study), "run -c c.toml -q"),
        "manifest": case(
            "found.json",
            jsons(whole.tree("found.json")),
            "report found.csv",
            "report found.csv --format json --junit j.xml",
            "report found.csv --html p.html --replays 1",
            "merge found.csv -o whole.csv",
            "replay found.csv 1",
            "replay found.csv 1 --recorded --fcd f.xml",
            "run --resume -o found.csv -n road.net.xml",
            "run --retry-errors -o found.csv -n road.net.xml",
            "run -o found.csv -n road.net.xml",
            "certify found.csv 1",
        ),
        "rows": case(
            "found.csv",
            tables(whole.text("found.csv")),
            "report found.csv",
            "report found.csv --by ego --format csv --junit j.xml",
            "report found.csv --html p.html --replays 1",
            "merge found.csv -o whole.csv",
            "replay found.csv 1",
            "replay found.csv 1 --recorded --html p.html",
            "certify found.csv timing",
        ),
        "trace": case(
            "found/run000001.jsonl",
            json_lines(lines),
            "replay found/run000001.jsonl",
            "replay found/run000001.jsonl --recorded --html p.html",
            "replay found/run000001.jsonl --recorded --fcd f.xml",
            "replay found.csv 1 --recorded --html p.html --fcd f.xml",
            "report found.csv --html p.html --replays 3",
            "merge found.csv -o whole.csv",
        ),
        "network": case(
            "road.net.xml",
            xmls(net),
            "inspect road.net.xml",
            "inspect road.net.xml --json",
            "run -n road.net.xml -r none -q",
            "run -n road.net.xml -r road.rou.xml --jaywalk --ego-route eastbound -q",
            "run -n road.net.xml --traffic 4 --kind car --agent random -q",
        ),
        "junction": case(
            "junction.net.xml",
            xmls(whole.text("junction.net.xml")),
            "inspect junction.net.xml",
            "run -n junction.net.xml -r none -q --ego-route left",
            "run -n junction.net.xml -r none -q --signal red",
            "run -n junction.net.xml --traffic 4 --kind car --agent random -q",
        ),
        "routes": case(
            "road.rou.xml", xmls(whole.text("road.rou.xml")), "run -n road.net.xml -r road.rou.xml"
        ),
        "extract": case("cross.osm", xmls(osm), "import-osm cross.osm -o made.net.xml"),
        "game": case("game.json", jsons(whole.tree("game.json")), "game solve game.json --json"),
        "policy": case(
            "tester.npz",
            policies(whole.files["tester.npz"]),
            "agents policy:tester.npz",
            "run --agent policy:tester.npz -n road.net.xml",
        ),
        "words": command_lines().map(lambda words: Case(words, base)),
        "reply": replies().map(lambda line: Case(("reply",), {"line": line})),
    }


@st.composite
def policies(draw: Any, whole: bytes) -> bytes:
    """A policy file with its header or one of its arrays damaged, or its bytes."""
    arrays = dict(np.load(io.BytesIO(whole)))
    header = draw(jsons(json.loads(str(arrays["header"])))).decode("utf-8", "replace")
    if draw(st.booleans()):
        arrays["header"] = np.array(header[:20000])
    else:
        name = draw(st.sampled_from(sorted(arrays)))
        odd: list[Any] = [np.zeros(0), np.zeros((2, 2, 2)), np.full(3, np.nan), np.array("x")]
        odd += [np.array(5), arrays[name][:1] if arrays[name].ndim else np.array([1j])]
        odd += [np.array([b"x"]), np.array(["2020"], dtype="datetime64[Y]"), np.ones(3, bool)]
        arrays[name] = odd[draw(st.integers(0, len(odd) - 1))]
        if draw(st.integers(0, 4)) == 0:
            del arrays[draw(st.sampled_from(sorted(arrays)))]
    file = io.BytesIO()
    np.savez(file, **arrays)
    data = file.getvalue()
    if draw(st.integers(0, 4)) == 0:
        at = draw(st.integers(0, len(data) - 1))
        return data[:at] if draw(st.booleans()) else data[:at] + b"\xff\x00" + data[at + 2 :]
    return data


WORDS = (
    *("0", "-1", "1", "nan", "inf", "1e999", "9" * 400, "", " ", "x", "x" * 300, "../x", ".", "/"),
    *("found.csv", "found.json", "found/run000001.jsonl", "road.net.xml", "cross.osm", "game.json"),
    *(
        "a=1",
        "a=",
        "=",
        "x=nan",
        "range_m=nan",
        "a=always (",
        "a=" + "(" * 3000,
        "always",
        "\udcff",
    ),
    *(
        "timing",
        "random",
        "a=timing",
        "policy:x",
        "policy:" + "x" * 300,
        "no:Such",
        "exec:",
        "tcp:",
    ),
    *(
        "exec:'",
        "tcp:x:99999",
        "tcp:[:1",
        "straight",
        "eastbound",
        "red",
        "bus",
        "crossing",
        "none",
    ),
    *("1/2", "0/0", "²/²", "10%", "4,2", "4,,2", "1,2,3,4", "nan,1,2,3", "٣", "c\u0000d", "\n"),
)
COMMANDS = (
    *("run", "run", "run", "replay", "report", "merge", "certify", "check-ego", "inspect"),
    *("import-osm", "game solve", "agents", "egos", "assertions", ""),
)
OPTIONS = (
    *(
        "-n -r --traffic -a -c --ego --ego-param --ego-sensor --ego-route --junction --signal"
    ).split(),
    *(
        "--assert --assert-param --formula --reference --agent --testers --param --kind --jaywalk"
    ).split(),
    *(
        "--tester-sensor --approach --bodies-per-agent --sumo-width --start-speed --runs --seed"
    ).split(),
    *("-e --step-length --deadline --reset -j --shard -x --until-tests --until-half-width").split(),
    *("--until-rate --budget -o --trace --resume --retry-errors --overwrite --by --format").split(),
    *(
        "--junit --html --replays --recorded --trust --fcd --top --json --picture --bbox --zebra"
    ).split(),
    *("--trim --reading --apart --level --egos --help --version -q --zzz -").split(),
)


@st.composite
def command_lines(draw: Any) -> tuple[str, ...]:
    """A command with words and options, some of which it has."""
    words = draw(st.sampled_from(COMMANDS)).split()
    word = st.sampled_from(WORDS)
    words += draw(st.lists(word, max_size=2))
    for _ in range(draw(st.integers(0, 4))):
        words.append(draw(st.sampled_from(OPTIONS)))
        words += draw(st.lists(word, max_size=1))
    return tuple(words)


def replies() -> st.SearchStrategy[bytes]:
    """Lines that an ego may answer."""
    whole = (
        {"type": "hello", "version": 1},
        {"type": "ready"},
        {"acceleration": 0.5, "step": 3},
        {"throttle": 0.5, "steering": -0.1},
        {"error": "no"},
    )
    return st.one_of(*map(jsons, whole)) | st.binary(max_size=40)


# Played -------------------------------------------------------------------------------------------


def tried(case: Case, folder: Path) -> Verdict:
    """A case in a folder of its own, in this process."""
    for name, data in case.files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(data)
    before = _listing(folder)
    err = io.StringIO()
    try:
        with contextlib.chdir(folder), _limited(), contextlib.redirect_stderr(err):
            status = _called(case)
    except Accepted:
        return Verdict("accepted", "")
    except Hang:
        return Verdict("hang", traceback.format_exc())
    except SystemExit as end:  # --help, --version
        return Verdict("accepted" if end.code == 0 else "status", err.getvalue())
    except BaseException:
        return Verdict("traceback", traceback.format_exc())
    said = err.getvalue()
    if status in (0, 1):
        return Verdict("accepted", said)
    return Verdict(_wrong(status, said, before != _listing(folder)) or "refused", said)


def _called(case: Case) -> int:
    """The exit status of a case."""
    if case.words == ("reply",):
        return _replied(case.files["line"])
    with (
        mock.patch.object(Worker, "_launch", side_effect=Accepted),
        contextlib.redirect_stdout(io.StringIO()),
    ):
        return int(cavsumo(list(case.words)))


def _replied(line: bytes) -> int:
    """The status of an ego's reply: 3 when it is refused."""
    read: list[Callable[[], Any]] = [
        lambda: protocol.check_hello(line),
        lambda: protocol.check_ready(line),
        lambda: protocol.is_left_over(line),
        lambda: protocol.answer(line, 3),
    ]
    status = 0
    for one in read:
        try:
            one()
        except EgoError as error:
            print(f"cavsumo: {error}", file=sys.stderr)
            status = 3
    return status


def _wrong(status: int, said: str, written: bool) -> str:
    """What is wrong with a refusal, empty for nothing."""
    lines = [line for line in said.splitlines() if line.strip()]
    if status not in STATUSES or not lines or not lines[-1].startswith("cavsumo: "):
        return "status"
    if PYTHON.search(said):
        return "words"
    if max(map(len, lines)) > LONGEST or len(lines) > 4:
        return "long"
    return "written" if written else ""


def _listing(folder: Path) -> dict[str, tuple[int, int]]:
    """The files of a folder, with size and time."""
    stats = {str(f.relative_to(folder)): f.stat() for f in folder.rglob("*") if f.is_file()}
    return {name: (s.st_size, s.st_mtime_ns) for name, s in stats.items()}


@contextlib.contextmanager
def _limited() -> Iterator[None]:
    """Raise Hang in what takes too long."""

    def ring(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, LIMIT_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


# Counted ------------------------------------------------------------------------------------------


def fuzzed(
    name: str, cases: st.SearchStrategy[Case], count: int, number: int, folder: Path
) -> tuple[Counter[str], int, list[tuple[Case, Verdict]], float]:
    """Counts of the ends of many cases, the longest message, the bad ones, the slowest [s]."""
    ends, longest, bad, slowest = Counter[str](), 0, [], 0.0

    @seed(number)
    @settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(cases)
    def play(case: Case) -> None:
        nonlocal longest, slowest
        place = folder / name
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir(parents=True)
        begun = time.perf_counter()
        verdict = tried(case, place)
        slowest = max(slowest, time.perf_counter() - begun)
        ends[verdict.end] += 1
        if verdict.end in GOOD:
            longest = max(longest, *map(len, verdict.said.splitlines() or [""]))
        else:
            bad.append((case, verdict))

    play()
    return ends, longest, bad, slowest


def main() -> None:
    """Fuzz and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sort", action="append")
    parser.add_argument("--show", type=int, default=3, help="bad cases of each sort")
    options = parser.parse_args()
    sorts = strategies(whole_files())
    chosen = options.sort or list(sorts)
    print(f"{'input':10} cases  refused  accepted  tracebacks  hangs  other  longest  slowest")
    with tempfile.TemporaryDirectory() as folder:
        for name in chosen:
            count = options.cases // len(chosen)
            ends, longest, bad, slowest = fuzzed(
                name, sorts[name], count, options.seed, Path(folder)
            )
            other = sum(ends.values()) - sum(ends[e] for e in (*GOOD, "traceback", "hang"))
            print(
                f"{name:10} {sum(ends.values()):5}  {ends['refused']:7}  {ends['accepted']:8}  "
                f"{ends['traceback']:10}  {ends['hang']:5}  {other:5}  {longest:7}  "
                f"{slowest:5.1f} s",
                flush=True,
            )
            show(bad, options.show)


def show(bad: list[tuple[Case, Verdict]], most: int) -> None:
    """Print the first case of each sort of failure."""
    seen: Counter[str] = Counter()
    for case, verdict in bad:
        key = verdict.end + " " + re.sub(r"\d+|'[^']*'", "", verdict.said.strip()[-150:])
        seen[key] += 1
        if seen[key] == 1 and len(seen) <= most:
            print(f"--- {verdict.end}: cavsumo {' '.join(case.words)[:300]}")
            print("\n".join(line[:600] for line in verdict.said.splitlines()[-9:]))
    if bad:
        print(f"--- {len(seen)} kinds: {seen.most_common(most)}")


if __name__ == "__main__":
    main()
