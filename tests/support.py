"""What several test files use: benchmarks, batches, and the processes that play them."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

from cavsumo.agents.casting import resolve_cast
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.model.bodies import Action
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import Snapshot
from cavsumo.network.site import Site
from cavsumo.results.frame_text import frames_text
from cavsumo.results.provenance import checksums, versions
from cavsumo.results.reading import read_manifest, read_rows
from cavsumo.results.trace_file import unpacked

ROOT = Path(__file__).parents[1]  # the repository
DATA = ROOT / "tests" / "data"
PATIENCE_S = 60.0
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
OPTIONS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync"
).split()
LAPTOP, PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}
# Settings of a short environment on the straight road.
STRAIGHT_NET = str(ROOT / "networks" / "pedestrians.net.xml")
SHORT = {"net": STRAIGHT_NET, "routes": "none", "end": 6.0}


def prepared_at(plan: BatchPlan, site: Site) -> PreparedBatch:
    """All that a process needs to play a plan at a site that is known."""
    cast = resolve_cast(plan)
    inputs = checksums(plan.scenario, cast.files)
    return PreparedBatch(plan, cast, site, str(Path.cwd()), inputs, versions())


def benchmark(name: str) -> Any:
    """A module of benchmarks/, which is no package."""
    file = ROOT / "benchmarks" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)  # dataclasses look there
    spec.loader.exec_module(module)
    return module


def rows(file: Path) -> list[dict[str, str]]:
    """The rows without the real time."""
    return [{k: v for k, v in row.items() if k != "wall_s"} for row in read_rows(file)]


def traces(file: Path) -> dict[str, str]:
    """The texts of traces and logs by name."""
    return {f.name: unpacked(f.read_bytes()) for f in file.with_suffix("").glob("run*")}


def frame(snapshot: Snapshot, actions: Sequence[Action] = ()) -> dict[str, Any]:
    """A snapshot as a frame of a trace."""
    found: dict[str, Any] = json.loads(frames_text([snapshot], [actions]))
    return found


def json_lines(*lines: Any) -> str:
    """A trace as text, from its head and its frames."""
    return "".join(json.dumps(line) + "\n" for line in lines)


def content(folder: Path) -> dict[str, bytes]:
    """Every file of a folder with its bytes."""
    files = (file for file in folder.rglob("*") if file.is_file())
    return {str(file.relative_to(folder)): file.read_bytes() for file in files}


def assert_same(file: Path, other: Path) -> None:
    """Rows, traces and what was learned are those of another batch."""
    assert rows(file) == rows(other)
    assert traces(file) == traces(other)
    for key in ("status", "episodes", "counts", "learned", "learned_after", "stopped_by"):
        assert read_manifest(file)[key] == read_manifest(other)[key], key


def untold(found: list[dict[str, str]]) -> list[dict[str, str]]:
    """Rows without the names of their traces, which hold that of the results."""
    return [row | {"trace": row["trace"].rpartition("/")[2]} for row in found]


def until(happened: Callable[[], Any], what: str) -> None:
    """Wait until something is so, not for ever."""
    end = time.monotonic() + PATIENCE_S
    while not happened():
        assert time.monotonic() < end, f"waited in vain until {what}"
        time.sleep(0.01)


def workers_of(parent: int) -> dict[int, str]:
    """The simulating children of a process, each with the time of its start."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            command = (folder / "cmdline").read_bytes()
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:  # gone meanwhile
            continue
        if int(fields[1]) == parent and b"cavsumo.batch.worker_process" in command:
            found[int(folder.name)] = fields[19]
    return found


def alive(pid: int, started: str | None = None) -> bool:
    """Whether a process runs (and is the one started then); one not yet buried does not."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return False
    return fields[0] not in "ZX" and started in (None, fields[19])


class Troupe(Executor):
    """Processes that stay for all batches of one setting, whatever their shards and rules."""

    def __init__(self, own: PreparedBatch, executor: Executor) -> None:
        self.own, self.executor = own, executor

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Have episodes played as some of the whole batch."""
        _, jobs = args
        return self.executor.submit(fn, self.own, jobs)


@contextlib.contextmanager
def serving(file: Path) -> Iterator[str]:
    """The Python example as a server; its spec."""
    line = [sys.executable, str(file), "--port", "0"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout
        try:
            yield f"tcp:127.0.0.1:{server.stdout.readline().split()[-1]}"
        finally:
            server.kill()
