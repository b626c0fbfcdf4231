"""Egos from outside, as real processes and connections: what drives, and what goes wrong."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from moody import FAULTS, MOODY, line, pids
from support import alive, until

from cavsumo.agents.base import Scene
from cavsumo.egos import Acceleration, Command, Ego, make_ego
from cavsumo.egos.base import Mission
from cavsumo.egos.external import link
from cavsumo.errors import EgoError
from cavsumo.model.snapshot import Snapshot

pytestmark = pytest.mark.usefixtures("inline")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with the moody ego in it; no process of it is left behind."""
    (tmp_path / "moody.py").write_text(MOODY, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def moody(fault: str, **params: Any) -> Ego:
    """That ego, with little patience."""
    return make_ego(line(fault), {"reply_s": 0.5} | params)


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
