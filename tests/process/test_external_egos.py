"""Egos from outside, as real processes and connections: what drives, and what goes wrong."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from support import ROOT, alive, rows, serving, traces, until, workers_of

from cavsumo.agents.base import Scene
from cavsumo.cli import main
from cavsumo.egos import Acceleration, Command, Ego, make_ego
from cavsumo.egos.base import Mission
from cavsumo.egos.external import link
from cavsumo.errors import EgoError
from cavsumo.model.snapshot import Snapshot
from cavsumo.results.reading import read_manifest

EXAMPLES = ROOT / "examples" / "egos"
CAREFUL = EXAMPLES / "stop_for_pedestrians.py"

# Drives on, and at step 3 of an episode does what it was told to, or takes turns with what the file
# "faults" lists, until that is empty. Its numbers go into the file "pids".
MOODY = r"""
import json, os, signal, sys, time
from pathlib import Path

fault = sys.argv[1]
with open("pids", "a") as file:
    print(os.getpid(), file=file)
faults = Path("faults")

def say(text):
    os.write(1, text.encode())

ANSWERS = {
    "garbage": "hello?\n",
    "list": "[1.0]\n",
    "keys": '{"accel": 1}\n',
    "nan": '{"acceleration": NaN}\n',
    "infinite": '{"acceleration": Infinity}\n',
    "too much": '{"acceleration": 9.5}\n',
    "drive": '{"throttle": 0, "steering": 0}\n',
    "gives up": '{"error": "lost my map"}\n',
    "twice": '{"acceleration": 0}\n{"acceleration": 1}\n',
    "long": "x" * 10_000_000 + "\n",
    "late": '{"acceleration": 0}\n',
}

def misbehave():
    if fault == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    elif fault == "stopped":
        os.kill(os.getpid(), signal.SIGSTOP)
    elif fault == "exits":
        print("\n  no GPU found  \n", file=sys.stderr)
        sys.exit(3)
    elif fault == "silent":
        time.sleep(3600)
    elif fault == "closed":
        os.close(1)
        time.sleep(3600)
    elif fault == "floods":
        while True:
            os.write(2, b"x" * 65536)
    say(ANSWERS[fault])
    if fault == "late":
        say('{"acceleration": 1}\n')

for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "hello":
        if fault == "is mute":
            time.sleep(3600)
        version = 2 if fault == "speaks 2" else 1
        say(json.dumps({"type": "hello", "version": version}) + "\n")
    elif message["type"] == "reset":
        say('{"type": "ready"}\n')
    elif message["type"] == "observation":
        if message["step"] == 3 and faults.exists():
            fault, *rest = [*faults.read_text().split(), "none"]
            faults.write_text(" ".join(rest[:-1]))
        if message["step"] == 3 and fault != "none":
            misbehave()
        else:
            say('{"acceleration": 0}\n')
    else:
        Path("closed").touch()
        break
"""

FAULTS = [
    ("killed", "died of SIGKILL"),
    ("exits", r"ended with status 3 \(no GPU found\)"),
    ("stopped", "gave no answer within 0.5 s"),
    ("silent", "gave no answer within 0.5 s"),
    ("floods", "gave no answer within 0.5 s"),
    ("closed", "closed its stdin or stdout"),
    ("garbage", r"answered 'hello\?', expected a line of JSON"),
    ("list", r"answered '\[1.0\]', expected a JSON object"),
    ("keys", ".* expected either acceleration or throttle and steering"),
    ("nan", r"acceleration must lie in \[-9, 9\], got nan"),
    ("infinite", r"acceleration must lie in \[-9, 9\], got inf"),
    ("too much", r"acceleration must lie in \[-9, 9\], got 9.5"),
    ("drive", r"changed from Acceleration to Drive\(.*"),
    ("gives up", "gave up: 'lost my map'"),
    ("twice", """wrote '{"acceleration": 1}.*' after its answer"""),
    ("long", "answered with a line longer than 65536 bytes"),
]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with the moody ego in it; no process of it is left behind."""
    (tmp_path / "moody.py").write_text(MOODY, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def pids(folder: Path) -> list[int]:
    """The numbers of the moody egos that were started."""
    file = folder / "pids"
    return [int(line) for line in file.read_text().splitlines()] if file.exists() else []


def moody(fault: str, **params: Any) -> Ego:
    """That ego, with little patience."""
    return make_ego(_moody(fault), {"reply_s": 0.5} | params)


def _moody(fault: str) -> str:
    return f"exec:{sys.executable} moody.py '{fault}'"


@contextlib.contextmanager
def started(ego: Ego, scene: Scene) -> Iterator[Ego]:
    """An ego that knows its mission, and is ended."""
    ego.prepare(Mission(Path("road.net.xml"), ("east",), scene.ego_path, (), scene.dt, 60.0))
    try:
        yield ego
    finally:
        ego.close()


@pytest.fixture
def scene(straight_scene: Callable[..., Scene]) -> Scene:
    """The straight road with one pedestrian."""
    return straight_scene()


@pytest.fixture
def seen(
    scene: Scene, scene_snapshot: Callable[..., Snapshot]
) -> Callable[[int], Iterator[Snapshot]]:
    """Call for what is seen in so many timesteps."""
    return lambda steps: (scene_snapshot(scene, (10.0, 8.0), step=i) for i in range(steps))


Watcher = Callable[[int], Iterator[Snapshot]]


def driven(ego: Ego, seen: Iterator[Snapshot], pause: float = 0.0) -> list[Command]:
    """What an ego does about what is seen."""
    commands = []
    for snapshot in seen:
        commands.append(ego.act(snapshot))
        time.sleep(pause)
    return commands


# Failures -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("fault", "words"), FAULTS, ids=[f for f, _ in FAULTS])
def test_whatever_goes_wrong_is_said_with_the_time_and_begun_anew(
    here: Path, scene: Scene, seen: Watcher, fault: str, words: str
) -> None:
    """The process is gone at once, stopped ones too; the next episode has a fresh one."""
    with started(moody(fault), scene) as ego:
        ego.reset(scene)
        with pytest.raises(EgoError, match=rf"^ego exec:.* at 0\.30 s: {words}$") as caught:
            driven(ego, seen(5))
        assert "\n" not in str(caught.value)
        assert len(str(caught.value)) < 400
        (pid,) = pids(here)
        assert not Path(f"/proc/{pid}").exists()
        ego.reset(scene)
        assert driven(ego, seen(3)) == [Acceleration(0.0)] * 3
        assert len(pids(here)) == 2
    assert (here / "closed").exists()
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids(here))


def test_a_second_answer_that_comes_late_is_noticed_before_the_next_question(
    here: Path, scene: Scene, seen: Watcher
) -> None:
    """It must not be taken for the answer to what was not asked yet."""
    with started(moody("late"), scene) as ego:
        ego.reset(scene)
        said = """at 0.[34]0 s: wrote '{"acceleration": 1}.*' (before it was asked|after its)"""
        with pytest.raises(EgoError, match=said):
            driven(ego, seen(5), pause=0.1)


def test_a_process_killed_between_two_episodes_is_noticed(
    here: Path, scene: Scene, seen: Watcher
) -> None:
    """Its death belongs to the next episode; the one after that has a fresh process."""
    with started(moody("none"), scene) as ego:
        ego.reset(scene)
        os.kill(pids(here)[0], signal.SIGKILL)
        with pytest.raises(EgoError, match=r"at 0\.00 s \(reset\): died of SIGKILL"):
            ego.reset(scene)
        ego.reset(scene)
        assert driven(ego, seen(2)) == [Acceleration(0.0)] * 2


def test_a_long_line_is_not_kept(scene: Scene) -> None:
    """Of ten megabytes no more is read than shows that the line is too long."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        peer = _Peer(ours.fileno())
        writer = threading.Thread(target=_ignoring_errors, args=(theirs, b"x" * 10_000_000))
        writer.start()
        with pytest.raises(EgoError, match="longer than 65536 bytes"):
            peer._receive(time.monotonic() + 30.0, 30.0)
        ours.close()
        writer.join()
    assert peer.read <= link.LINE_LIMIT + link.CHUNK


class _Peer(link.Link):
    """The other end of a socket, which counts what is read from it."""

    read = 0

    def __init__(self, fd: int) -> None:
        super().__init__(fd, fd, None, link.Tail())

    def _read(self) -> bytes:
        chunk = super()._read()
        self.read += len(chunk)
        return chunk

    def end(self, farewell: bytes = b"") -> None: ...

    def _gone(self) -> str:
        return "gone"


def _ignoring_errors(end: socket.socket, data: bytes) -> None:
    with contextlib.suppress(OSError):
        end.sendall(data)


def test_the_log_keeps_the_end_and_says_what_is_cut() -> None:
    """Taken once, it is empty; what is no UTF-8 is shown as bytes."""
    tail = link.Tail()
    tail.add(b"first\n" + b"x" * link.LOG_LIMIT)
    tail.add(b"last \xff\n")
    text = tail.take()
    assert text.startswith("[13 bytes before this are cut]\nxxx")
    assert text.endswith("xxxlast \\xff\n")
    assert tail.take() == ""


CHATTY = """
import json, sys

ANSWERS = {"hello": {"type": "hello", "version": 1}, "reset": {"type": "ready"}}

for line in sys.stdin:
    sys.stderr.write("x" * 1_000_000)
    print(json.dumps(ANSWERS.get(json.loads(line)["type"], {"acceleration": 0})), flush=True)
"""


def test_neither_side_makes_the_other_wait(scene: Scene, seen: Watcher, here: Path) -> None:
    """A megabyte of stderr before each answer, questions longer than any pipe: all go through."""
    (here / "chatty.py").write_text(CHATTY, encoding="utf-8")
    crowd = [(f"car{i}" * 20, i) for i in range(3000)]
    with started(make_ego(f"exec:{sys.executable} chatty.py", {"reply_s": 20}), scene) as ego:
        ego.reset(scene)
        for snapshot in seen(2):
            states = tuple((scene.ego._replace(id=n), i, 0.0, 0.0, 0.0) for n, i in crowd)
            full = tuple((b, float(x), y, v, o) for b, x, y, v, o in states)
            assert ego.act(snapshot._replace(raw_background=full)) == Acceleration(0.0)
        assert len(ego.take_log()) <= link.LOG_LIMIT + 100


# Refusals -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--ego", "exec:"], "expected exec:COMMAND"),
        (["--ego", "exec:python3 'x"], "No closing quotation; expected exec:COMMAND"),
        (["--ego", "exec:no-such-program x"], "cannot be started: No such file or directory"),
        (["--ego", "exec:/etc/passwd"], "cannot be started: Permission denied"),
        (["--ego", f"exec:{sys.executable} -c 1/0"], "ended with status 1 (ZeroDivisionError"),
        (["--ego", "exec:true", "--ego-param", "replys=1"], "did you mean 'reply_s'"),
        (["--ego", "exec:true", "--ego-param", "reply_s=0"], "reply_s must lie in [0.001"),
        (["--ego", "exec:true", "--ego-param", "v_max=fast"], "v_max must be a finite number"),
        (["--ego", "exec:true", "--ego-param", "depart_speed=60"], "depart_speed must lie in"),
        (["--ego", "exec:sleep 60", "--ego-param", "start_s=0.2"], "no answer within 0.2 s"),
        (["--ego", "tcp:"], "expected tcp:HOST:PORT"),
        (["--ego", "tcp:localhost:port"], "expected tcp:HOST:PORT"),
        (["--ego", "tcp:127.0.0.1:1"], "cannot be reached: Connection refused"),
    ],
    ids=lambda x: " ".join(x)[:40] if isinstance(x, list) else "",
)
def test_what_cannot_be_an_ego_is_refused(
    refused: Callable[..., str], words: list[str], said: str
) -> None:
    """One sentence, exit status 2, nothing written."""
    assert said in refused(*words)


@pytest.mark.parametrize(
    ("fault", "said"),
    [("speaks 2", "speaks version 2 of the protocol"), ("is mute", "no answer within 0.3 s")],
)
def test_an_ego_that_says_the_wrong_hello_is_refused(
    refused: Callable[..., str], tmp_path_factory: pytest.TempPathFactory, fault: str, said: str
) -> None:
    """Another version, or nothing at all."""
    file = tmp_path_factory.mktemp("moody") / "moody.py"
    file.write_text(MOODY.replace('open("pids", "a")', f'open("{file}.pids", "a")'))
    ego = f"exec:{sys.executable} {file} '{fault}'"
    assert said in refused("--ego", ego, "--ego-param", "start_s=0.3")
    pid = int(Path(f"{file}.pids").read_text())
    until(lambda: not alive(pid), "it is gone")


def edit(file: Path, old: str, new: str) -> None:
    """Put some text in the place of another."""
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")


# Batches ------------------------------------------------------------------------------------------


def run(net: Path, ego: str, *words: str, output: str = "r.csv") -> int:
    """``cavsumo run`` with that ego, quietly."""
    return main(["run", "-n", str(net), "--ego", ego, "-q", "-o", output, *words])


SHORT = "-r none --agent noop --testers 1 --end 2 --trace none".split()


def test_a_batch_goes_on_with_a_fresh_process(networks: dict[str, Path], here: Path) -> None:
    """Episodes that went wrong are errors, others are played; --retry-errors makes it whole."""
    faults = ["killed", "stopped", "garbage", "none", "long"]
    (here / "faults").write_text(" ".join(faults))
    words = [*SHORT, "--runs", "6", "--ego-param", "reply_s=0.5"]
    assert run(networks["pedestrians"], _moody("none"), *words) == 3
    there = rows(here / "r.csv")
    for row, fault in zip(there, [*faults, "none"], strict=True):
        assert row["outcome"] == ("not_triggered" if fault == "none" else "error")
        if fault != "none":
            assert re.search(f"at 0.30 s: {dict(FAULTS)[fault]}$", row["error"])
    assert len(pids(here)) == 5
    assert not any(alive(pid) for pid in pids(here))
    assert main(["run", "--retry-errors", "-o", "r.csv", "-q"]) == 0
    assert {row["outcome"] for row in rows(here / "r.csv")} == {"not_triggered"}


def test_an_ego_that_cannot_be_started_again_costs_rows_not_the_batch(
    networks: dict[str, Path], here: Path
) -> None:
    """The script is taken away while the batch runs: each episode says so."""
    edit(here / "moody.py", "def misbehave():", "def misbehave():\n    os.remove('moody.py'); 1/0")
    assert run(networks["pedestrians"], _moody("any"), *SHORT, "--runs", "2") == 3
    first, second = rows(here / "r.csv")
    assert "at 0.30 s: ended with status 1 (ZeroDivisionError" in first["error"]
    assert "at 0.00 s (reset): ended with status 2" in second["error"]
    assert "No such file" in second["error"]


def test_what_an_ego_prints_lies_beside_its_row(networks: dict[str, Path], here: Path) -> None:
    """Only for episodes in which it printed; also when it dies of it."""
    (here / "faults").write_text("exits")
    assert run(networks["pedestrians"], _moody("none"), *SHORT, "--runs", "3") == 3
    assert traces(here / "r.csv") == {"run000000.ego.log": "\n  no GPU found  \n\n"}


def test_the_files_of_a_command_are_in_the_manifest(networks: dict[str, Path], here: Path) -> None:
    """A changed controller is noticed by whoever goes on with the batch."""
    assert run(networks["pedestrians"], _moody("none"), *SHORT, "--runs", "1") == 0
    assert "moody.py" in read_manifest(here / "r.csv")["sha256"]
    (here / "moody.py").write_text(MOODY + "\n# changed\n")
    assert main(["run", "--resume", "--runs", "2", "-o", "r.csv", "-q"]) == 2


def test_the_deadline_of_an_episode_holds(networks: dict[str, Path], here: Path) -> None:
    """An ego that may take long over an answer, and takes longer than the episode may."""
    edit(here / "moody.py", "def misbehave():", "def misbehave():\n    time.sleep(30)")
    words = [*SHORT, "--runs", "1", "--deadline", "1", "--ego-param", "reply_s=40"]
    assert run(networks["pedestrians"], _moody("any"), *words) == 3
    assert rows(here / "r.csv")[0]["error"].startswith("no answer within 1 s, killed")
    until(lambda: not any(alive(pid) for pid in pids(here)), "they are gone")


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not tell children")
def test_an_ego_dies_with_a_process_that_is_killed(networks: dict[str, Path], here: Path) -> None:
    """kill -9 of the process that simulates, while its ego is stopped: neither is left."""
    words = ["run", "-n", str(networks["pedestrians"]), "--ego", _moody("stopped"), "-q", *SHORT]
    words += ["--runs", "1", "--ego-param", "reply_s=60", "-o", "r.csv"]
    with subprocess.Popen([sys.executable, "-m", "cavsumo", *words]) as process:
        until(lambda: pids(here) and _state(pids(here)[0]) == "T", "the ego stands still")
        (worker,) = workers_of(process.pid)
        os.kill(worker, signal.SIGKILL)
        assert process.wait(60.0) == 3
    assert "died of SIGKILL" in rows(here / "r.csv")[0]["error"]
    until(lambda: not any(alive(pid) for pid in pids(here)), "the ego is gone")


def _state(pid: int) -> str:
    """The letter of a process's state."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    return ""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_an_ego_inherits_three_pipes_and_nothing_else(
    networks: dict[str, Path], here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No descriptor of ours, no signal ignored, the environment and folder of the command line."""
    (here / "probe.sh").write_text(
        "ls -l /proc/$$/fd > fds\n"  # no pipe of its own: the shell would hold it for a moment
        "cat /proc/self/status > status\nenv > environment\npwd > folder\n"
        f"exec {sys.executable} moody.py none\n"
    )
    monkeypatch.setenv("PYTHONPATH", os.environ.get("PYTHONPATH", "") + os.pathsep + "/mine")
    line = [sys.executable, "-m", "cavsumo", "run", "-n", str(networks["pedestrians"]), "-q"]
    line += ["--ego", "exec:sh probe.sh", *SHORT, "--runs", "1", "-o", "r.csv"]
    assert subprocess.run(line, timeout=120, check=False).returncode == 0
    found = re.findall(r"-> (\w+|/.*)", (here / "fds").read_text())
    mine = str(here)  # the script and where the shell writes
    assert [fd for fd in found if not fd.startswith(mine)] == ["pipe"] * 3
    status = dict(line.split(":\t", 1) for line in (here / "status").read_text().splitlines())
    assert int(status["SigIgn"], 16) & (1 << 1 | 1 << 12) == 0, "SIGINT or SIGPIPE is ignored"
    seen = (here / "environment").read_text().splitlines()
    assert f"PYTHONPATH={os.environ['PYTHONPATH']}" in seen
    assert not [line for line in seen if line.startswith("CAVSUMO")]
    assert (here / "folder").read_text().strip() == str(here.resolve())


# The same controller in every form ----------------------------------------------------------------

WRAPPED = """
import importlib.util
from cavsumo.egos import Acceleration

spec = importlib.util.spec_from_file_location("careful", {file!r})
careful = importlib.util.module_from_spec(spec)
spec.loader.exec_module(careful)
STATES = {{"r": "red", "y": "yellow", "u": "red-yellow", "g": "green", "G": "green"}}

class Careful:
    def reset(self, scene):
        kind = scene.ego.kind
        self.scene, self.path = scene, careful.Path(scene.ego_path.points)
        limits = kind.throttle_min, kind.throttle_max
        self.constants = (scene.dt, kind.length, kind.width, *limits)

    def act(self, snapshot):
        ego, along = snapshot.ego, self.scene.ego_progress(snapshot)
        front = along + ego.body.kind.length / 2
        lights = zip(self.scene.lights, snapshot.lights)
        ahead = [(t.along - front, STATES[s]) for t, s in lights if t.along >= front]
        bodies = [
            (b.body.kind.name, b.x, b.y, b.o, b.v, b.body.kind.length, b.body.kind.width)
            for b in (*snapshot.testers, *snapshot.background)
        ]
        return Acceleration(careful.acceleration(
            self.path, self.constants, ego.v, along, ego.x, ego.y,
            ahead[0] if ahead else None, bodies,
        ))
"""


@pytest.fixture(scope="module")
def careful() -> ModuleType:
    """The Python example as a module."""
    spec = importlib.util.spec_from_file_location("careful", CAREFUL)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_controller_gives_the_same_rows_in_every_form(
    networks: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    controller: Callable[..., str],
) -> None:
    """As a class here, as a process, as a server, one or two at a time: rows and traces agree."""
    monkeypatch.chdir(tmp_path)
    name = controller(WRAPPED.format(file=str(CAREFUL)))
    words = "--agent timing --runs 2 --end 12 --trace all".split()
    with serving(CAREFUL) as spec:
        forms = {f"{name}:Careful": "1", f"exec:{sys.executable} {CAREFUL}": "2", spec: "2"}
        for i, (ego, jobs) in enumerate(forms.items()):
            done = run(networks["crossing"], ego, *words, "-j", jobs, output=f"r{i}.csv")
            assert done in (0, 1)
    found = [
        [{k: v for k, v in row.items() if k not in ("ego", "trace")} for row in rows(file)]
        for file in (tmp_path / f"r{i}.csv" for i in range(3))
    ]
    assert found[0] == found[1] == found[2]
    assert {row["outcome"] for row in found[0]} - {"error"}
    frames = [
        {n: text.splitlines()[1:] for n, text in traces(tmp_path / f"r{i}.csv").items()}
        for i in range(3)
    ]
    assert frames[0] == frames[1] == frames[2]
    assert len(frames[0]) == 2


def test_a_server_that_goes_away_costs_rows(networks: dict[str, Path], here: Path) -> None:
    """It serves an episode and ends: that connection is closed, the next one refused."""
    with serving(CAREFUL) as spec:
        pass
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as listening:
        spec = f"tcp:127.0.0.1:{listening.getsockname()[1]}"
        helper = threading.Thread(target=_serve_a_while, args=(listening,))
        helper.start()
        assert run(networks["pedestrians"], spec, *SHORT, "--runs", "2") == 3
        helper.join()
    first, second = rows(here / "r.csv")
    assert first["error"].endswith("at 0.10 s: closed the connection")
    assert second["error"].endswith("at 0.00 s (reset): cannot be reached: Connection refused")


def _serve_a_while(listening: socket.socket) -> None:
    """Answer hello, reset and one observation, then go."""
    connection, _ = listening.accept()
    listening.close()
    answers = [{"type": "hello", "version": 1}, {"type": "ready"}, {"acceleration": 0}]
    with connection, connection.makefile("r") as lines:
        for answer in answers:
            lines.readline()
            connection.sendall(json.dumps(answer).encode() + b"\n")


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The C example, compiled."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("there is no C compiler here")
    program = tmp_path_factory.mktemp("c") / "stop_for_pedestrians"
    source = EXAMPLES / "stop_for_pedestrians.c"
    line = [compiler, "-O2", "-Wall", "-Wextra", "-Werror", "-o", str(program), str(source), "-lm"]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


def test_the_example_in_c_drives_like_the_one_in_python(
    compiled: Path, networks: dict[str, Path], here: Path
) -> None:
    """The same outcomes on a busy junction, and nearly the same times."""
    words = "--agent timing --runs 2 --end 12 --trace none".split()
    for name, ego in (("c", compiled), ("p", f"{sys.executable} {CAREFUL}")):
        output = f"{name}.csv"
        assert run(networks["crossing"], f"exec:{ego}", *words, "-j", "2", output=output) in (0, 1)
    in_c, in_python = rows(here / "c.csv"), rows(here / "p.csv")
    assert [row["outcome"] for row in in_c] == [row["outcome"] for row in in_python]
    assert "error" not in {row["outcome"] for row in in_c}
    for one, other in zip(in_c, in_python, strict=True):
        assert float(one["time_s"]) == pytest.approx(float(other["time_s"]), abs=1.0)


@pytest.mark.parametrize("x", [18.0, 25.0, 45.0])
def test_the_examples_brake_for_who_is_ahead_and_for_nobody_else(
    careful: ModuleType, x: float
) -> None:
    """At 8 m/s with somebody on the lane, walking onto it, beside it, behind; a red light."""
    path, constants = careful.Path([(0.0, 0.0), (100.0, 0.0)]), (0.1, 4.5, 1.75, -9.0, 9.0)

    def decided(*bodies: tuple[Any, ...], light: Any = None) -> float:
        told = path, constants, 8.0, 10.0, 10.0, 0.0, light, bodies
        answer: float = careful.acceleration(*told)
        return answer

    def walker(y: float, heading: float, speed: float) -> tuple[Any, ...]:
        return ("pedestrian", x, y, heading, speed, 0.66, 0.88)

    free = decided()
    assert free == pytest.approx(1.5)
    assert decided(walker(0.0, 1.57, 0.0)) <= decided(walker(2.5, -1.57, 1.4)) + 1e-9
    assert decided(walker(0.0, 1.57, 0.0)) < free if x < 40.0 else free
    assert decided(walker(3.0, 1.57, 1.4)) == decided(walker(3.0, 0.0, 1.4)) == free
    assert decided(("pedestrian", 4.0, 0.0, 0.0, 0.0, 0.66, 0.88)) == free
    assert decided(light=(x - 12.0, "green")) == free
    assert decided(light=(8.0, "red")) == -9.0
    assert decided(light=(1.0, "red")) == free, "too late to stop before it"
