"""What the test files share: networks, plans with their sites, and scenes that need no SUMO."""

from __future__ import annotations

import dataclasses
import importlib
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import hypothesis
import pytest
from inline import played_here
from shapely.geometry import LineString, box
from sites import derived_once
from support import CHROMIUM, LAPTOP, OPTIONS, ROOT, SHORT, prepared_at

from cavsumo.agents.base import Scene
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import PreparedBatch, prepare
from cavsumo.batch.replay import Record
from cavsumo.cli import main
from cavsumo.egos import make_ego
from cavsumo.egos.base import EGO_KIND
from cavsumo.errors import InputError
from cavsumo.model.bodies import PEDESTRIAN, Body, Kind
from cavsumo.model.carriageway import Roads, Start
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.scenario import BatchPlan, plan_from
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.osm.netconvert import sumo_home
from cavsumo.network.site import Site
from cavsumo.results.traces import Trace, trace_of
from cavsumo.sumo.world import World

NAMES = ("crossing", "junction", "pedestrians")

# The straight road of networks/pedestrians.net.xml, in metres.
ROAD_LENGTH, ROAD_WIDTH, LANE_Y, PAVEMENT_Y = 99.0, 7.3, 1.825, 5.15

Pose = tuple[float, float, float]  # x, y [m], o [rad]
State = tuple[float, float, float, float]  # x, y [m], v [m/s], o [rad]


def pytest_configure(config: pytest.Config) -> None:
    """Set what the tests and all their processes have in common.

    Examples of hypothesis have no deadline. Each process computes in one thread: there are enough
    processes. Where Python is told to write no bytecode, each of some hundred processes would
    compile all that it imports; it is kept in the cache of pytest then.
    """
    hypothesis.settings.register_profile("untimed", deadline=None)
    hypothesis.settings.load_profile("untimed")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    cache = getattr(config, "cache", None)  # None with -p no:cacheprovider
    if sys.dont_write_bytecode and cache is not None:
        folder = str(cache.mkdir("bytecode"))
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix = folder
        sys.dont_write_bytecode = False


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Solutions of games are kept for these tests only."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def netconvert() -> None:
    """Skips where the programs of eclipse-sumo are missing, or a library that they need."""
    try:
        program = sumo_home() / "bin" / "netconvert"
        subprocess.run([program, "--version"], check=True, capture_output=True, timeout=60)
    except (InputError, OSError, subprocess.SubprocessError) as error:
        pytest.skip(f"no netconvert here: {error}")


@pytest.fixture(scope="session", autouse=True)
def _silent() -> Iterator[None]:
    """Nothing is said of steps that take long: what is said must not depend on the machine."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("cavsumo.cli.steps.AFTER_S", 3600.0)
        yield


@pytest.fixture(scope="session", autouse=True)
def _sites() -> Iterator[None]:
    """What is known of a network that comes with cavsumo is derived once."""
    with derived_once():
        yield


@pytest.fixture(scope="module")
def inline() -> Iterator[None]:
    """Batches are played in this process."""
    with played_here():
        yield


@pytest.fixture(scope="module", autouse=True)
def _no_workers(request: pytest.FixtureRequest) -> None:
    """Real workers play in tests/process only."""
    if request.path.parent.name != "process":
        request.getfixturevalue("inline")


@pytest.fixture(scope="session")
def networks() -> dict[str, Path]:
    """The three networks that come with cavsumo: crossing, junction, pedestrians."""
    return {name: ROOT / "networks" / f"{name}.net.xml" for name in NAMES}


@pytest.fixture(scope="session")
def routes() -> dict[str, Path]:
    """Their background demand."""
    return {name: ROOT / "routes" / f"{name}.rou.xml" for name in NAMES}


@pytest.fixture(scope="session")
def staged(networks: dict[str, Path]) -> Callable[..., tuple[BatchPlan, Site]]:
    """Call with a network's name and settings: a plan and its site, as the command line makes them.

    The roads are empty unless ``routes`` is set ("auto" for the network's own demand).
    """
    sites: dict[tuple[Any, ...], Site] = {}

    def setup(name: str = "pedestrians", **settings: Any) -> tuple[BatchPlan, Site]:
        chosen = {"net": networks[name], "routes": "none"} | settings
        if chosen["routes"] == "auto":
            del chosen["routes"]
        plan = plan_from(chosen, "test")
        s = plan.scenario
        ego = (s.ego, repr(sorted(s.ego_params.items())))
        drawn = (s.traffic, plan.seed, s.end) if s.traffic else ()
        on_road = s.kind != "pedestrian" and (s.kind, s.approaches, repr(plan.params))
        key = (s.net, s.ego_route, s.junction, *ego, s.jaywalk, s.signal, on_road, *drawn)
        if key not in sites:
            sites[key] = prepare(plan).site
        return plan, sites[key]

    return setup


@pytest.fixture(scope="session")
def set_up(staged: Callable[..., tuple[BatchPlan, Site]]) -> Callable[..., PreparedBatch]:
    """Call like ``staged`` for all that a process needs to play."""

    def made(name: str = "pedestrians", **settings: Any) -> PreparedBatch:
        return prepared_at(*staged(name, **settings))

    return made


@pytest.fixture(scope="session")
def open_world(staged: Callable[..., tuple[BatchPlan, Site]]) -> Callable[..., World]:
    """Call like ``staged`` for a world; use it as a context manager, one at a time."""

    def opened(name: str = "pedestrians", **settings: Any) -> World:
        plan, site = staged(name, **settings)
        scenario = plan.scenario
        return World(scenario, site, make_ego(scenario.ego, scenario.ego_params))

    return opened


@pytest.fixture
def controller(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., str]]:
    """Call with the source of a Python module: it can be imported now, by workers too.

    Returns the module's name; the classes in it are egos ``name:Class``.
    """
    made: list[str] = []

    def write(source: str, name: str = "user_controller") -> str:
        (tmp_path / f"{name}.py").write_text(source, encoding="utf-8")
        sys.modules.pop(name, None)
        importlib.invalidate_caches()
        made.append(name)
        return name

    monkeypatch.syspath_prepend(str(tmp_path))
    yield write
    for name in made:
        sys.modules.pop(name, None)


@pytest.fixture
def refused(
    networks: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> Callable[..., str]:
    """Call with options of ``cavsumo run``: it must say no in one sentence, which is returned."""

    def no(*words: str) -> str:
        monkeypatch.chdir(tmp_path)
        net = [] if "--net" in words else ["-n", str(networks["pedestrians"])]
        assert main(["run", *net, *words]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1, said
        assert list(tmp_path.iterdir()) == [], "something was written"
        return said

    return no


@pytest.fixture(scope="session")
def straight_roads() -> Roads:
    """The carriageway of the straight road: 99 m long, two lanes, 7.3 m wide, centred on y = 0."""
    half = ROAD_WIDTH / 2
    lanes = [
        LineString([(0.0, -LANE_Y), (ROAD_LENGTH, -LANE_Y)]),
        LineString([(ROAD_LENGTH, LANE_Y), (0.0, LANE_Y)]),
    ]
    return Roads(box(0.0, -half, ROAD_LENGTH, half), lanes)


@pytest.fixture(scope="session")
def straight_scene(straight_roads: Roads) -> Callable[..., Scene]:
    """Call for a scene on the straight road, without SUMO.

    ``starts`` are poses (x, y, o), one a tester; those beside the carriageway stand on the
    pavement of their side (the southern one leads east, the northern one west). The ego means to
    drive along y = -1.825 from x = 0 to 99. ``open_plane`` leaves the roads out.
    """

    def scene(
        starts: Sequence[Pose] = ((60.0, -PAVEMENT_Y, 0.0),),
        *,
        dt: float = 0.1,
        kind: Kind = PEDESTRIAN,
        ego_kind: Kind = EGO_KIND,
        open_plane: bool = False,
    ) -> Scene:
        return Scene(
            dt=dt,
            ego=Body("ego", ego_kind),
            ego_path=Polyline([(0.0, -LANE_Y), (ROAD_LENGTH, -LANE_Y)]),
            bodies=tuple(Body(f"tester{i}", kind) for i in range(len(starts))),
            starts=tuple(_start(*pose, open_plane) for pose in starts),
            roads=None if open_plane else straight_roads,
        )

    return scene


@pytest.fixture(scope="session")
def scene_snapshot() -> Callable[..., Snapshot]:
    """Call for what is seen in a scene at one timestep.

    The ego is ``(x, v)`` on its lane, heading east, or a whole state (x, y, v, o); the testers
    are states (x, y, v, o) and stand at their starts when not given. ``background`` are states
    with their bodies (body, x, y, v, o).
    """

    def snapshot(
        scene: Scene,
        ego: tuple[float, float] | State = (10.0, 8.0),
        testers: Sequence[State] | None = None,
        *,
        step: int = 0,
        steering: float = 0.0,
        background: Sequence[tuple[Body, float, float, float, float]] = (),
    ) -> Snapshot:
        full = ego if len(ego) == 4 else (ego[0], -LANE_Y, ego[1], 0.0)
        given = testers if testers is not None else [(s.x, s.y, 0.0, s.o) for s in scene.starts]
        states = tuple(BodyState(b, *s) for b, s in zip(scene.bodies, given, strict=True))
        time = round(step * scene.dt, 6)
        driver = BodyState(scene.ego, *full)
        return Snapshot(step, time, driver, steering, states, tuple(background))

    return snapshot


def _start(x: float, y: float, o: float, open_plane: bool) -> Start:
    """A start on the pavement of its side, on none on the carriageway or an open plane."""
    if open_plane or abs(y) <= ROAD_WIDTH / 2:
        return Start(x, y, o)
    side = math.copysign(PAVEMENT_Y, y)
    ends = [(0.0, side), (ROAD_LENGTH, side)]
    pavement = Polyline(ends if y < 0 else ends[::-1])
    along = pavement.project(x, y)
    forwards = math.cos(o - pavement.at(along.along)[2]) >= 0
    return Start(x, y, o, pavement, along.lateral, forwards)


@pytest.fixture(scope="session")
def shown(staged: Callable[..., tuple[BatchPlan, Site]]) -> tuple[Record, Trace, Site]:
    """An episode at the Helsinki crossing in which the ego hits a tester, recorded."""
    plan, site = staged("crossing", agents=["timing"], routes="auto")
    with EpisodeRunner(prepared_at(plan, site)) as runner:
        outcome = runner.play(dataclasses.replace(job(plan, 1), record=True)).outcome
    trace = trace_of(outcome)
    assert trace is not None
    return Record(plan, trace.row, trace, trace.head, Path("results.csv")), trace, site


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium as Debian has it, driven by playwright."""
    if CHROMIUM is None:
        pytest.skip("no chromium here: apt-get install chromium")
    api = pytest.importorskip("playwright.sync_api", reason="no playwright: pip install playwright")
    with api.sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        yield running
        running.close()


@pytest.fixture
def open_page(browser: Any) -> Iterator[Callable[..., Any]]:
    """Call with a page, a viewport and such; whatever it complains about fails the test."""
    complaints: list[str] = []
    requests: list[tuple[str, str]] = []
    contexts: list[Any] = []

    def opened(which: Path, viewport: dict[str, int] = LAPTOP, **how: Any) -> Any:
        context = browser.new_context(viewport=viewport, **how)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(20_000)
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("dialog", lambda dialog: complaints.append(f"dialog {dialog.message}"))
        page.on("request", lambda r: requests.append((r.url, r.resource_type)))
        page.goto(which.as_uri())
        return page

    yield opened
    for context in contexts:
        context.close()
    assert complaints == []
    # pages are files, and load nothing beside themselves
    assert [url for url, _ in requests if not url.startswith("file:")] == []
    assert {sort for _, sort in requests} == {"document"}


@pytest.fixture(scope="session")
def found_failure(networks: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a small batch at the Helsinki crossing, with tests and failures."""
    file = tmp_path_factory.mktemp("found") / "found.csv"
    words = ["run", "-n", str(networks["crossing"]), "-o", str(file), "-q", "--exit-zero"]
    with played_here():
        assert main([*words, "--agent", "proximity", "--agent", "timing", "--runs", "8"]) == 0
    return file


@pytest.fixture
def bare(networks: dict[str, Path], tmp_path: Path) -> Callable[[str], Path]:
    """Call with a network's name: the same one with lanes for bicycles in place of pavements."""

    def strip(name: str) -> Path:
        file = tmp_path / f"{name}.net.xml"
        text = networks[name].read_text(encoding="utf-8")
        edges = r'<edge id="[^:].*?</edge>'  # not the walking areas and crossings
        for edge in re.findall(edges, text, flags=re.DOTALL):
            text = text.replace(edge, edge.replace('allow="pedestrian"', 'allow="bicycle"'))
        file.write_text(text, encoding="utf-8")
        return file

    return strip


@pytest.fixture
def make() -> Iterator[Callable[..., Any]]:
    """Call with an id and settings for an environment on the straight road, closed afterwards."""
    import gymnasium

    import cavsumo.envs  # noqa: F401  (registers the environments)

    made = []

    def one(name: str = "Tester", **settings: Any) -> Any:
        made.append(gymnasium.make(f"cavsumo/{name}-v0", **(SHORT | settings)))
        return made[-1]

    yield one
    for env in made:
        env.close()
