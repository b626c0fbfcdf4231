"""Controllers from the user, named module:Class: those that drive, and what none may do."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from cavsumo.agents.base import Scene
from cavsumo.egos import make_ego
from cavsumo.errors import EgoError, InputError, UnknownName
from cavsumo.model.snapshot import Snapshot
from cavsumo.sumo.world import World

Opener = Callable[..., World]
Writer = Callable[..., str]


def episode(world: World) -> Iterator[Snapshot]:
    """What is seen while the ego drives along an empty road, for at most 60 s."""
    snapshot: Snapshot | None = world.reset(1, (), ())
    world.ego.reset(Scene(world.dt, world.ego_body, world.site.route.path, (), ()))
    while snapshot is not None and snapshot.time < 60.0:
        yield snapshot
        snapshot = world.step((), world.ego.act(snapshot))


GOOD = """
from cavsumo.egos import Acceleration, Drive

class Cruise:
    depart_speed = 4.0
    def __init__(self, gain=1.0):
        self.gain = gain
    def reset(self, scene):
        self.dt = scene.dt
    def act(self, snapshot):
        return Acceleration(self.gain * (7.0 - snapshot.ego.v))

class Swerve:
    depart_speed = 5.0
    def act(self, snapshot):
        return Drive(0.0, 0.1)
"""


def test_a_controller_from_a_module_drives(open_world: Opener, controller: Writer) -> None:
    """module:Class with a parameter: it enters at its speed and approaches the one it wants."""
    name = controller(GOOD)
    with open_world(ego=f"{name}:Cruise", ego_params={"gain": 2.0}) as world:
        seen = [s.ego for s in episode(world)]
    assert seen[0].v == pytest.approx(4.0, abs=1e-6)
    assert seen[1].v == pytest.approx(4.0 + 0.1 * 2.0 * 3.0, abs=1e-6)
    assert seen[-1].v == pytest.approx(7.0, abs=1e-3)


def test_a_controller_that_steers_drives_in_a_circle(
    open_world: Opener, controller: Writer
) -> None:
    """A constant steering angle gives a circle of radius b / (2 sin(atan(tan(e) / 2)))."""
    name = controller(GOOD)
    with open_world(ego=f"{name}:Swerve") as world:
        seen = [s for _, s in zip(range(150), episode(world), strict=False)]
    radius = 3.0 / (2.0 * math.sin(math.atan(0.5 * math.tan(0.1))))
    turned = sum(math.remainder(b.ego.o - a.ego.o, math.tau) for a, b in pairwise(seen))
    assert turned == pytest.approx(5.0 * 14.9 / radius, rel=0.01)
    assert seen[-1].ego.v == seen[0].ego.v == pytest.approx(5.0)


BAD = """
from cavsumo.egos import Acceleration, Drive

class Bad:
    def __init__(self, answer="raise"):
        self.answer = answer
    def act(self, snapshot):
        if snapshot.step < 3:
            return Acceleration(0.0)
        return {
            "raise": lambda: 1 / 0,
            "nan": lambda: Acceleration(float("nan")),
            "infinite": lambda: Acceleration(float("inf")),
            "too much": lambda: Acceleration(9.5),
            "text": lambda: Acceleration("fast"),
            "number": lambda: 1.0,
            "nothing": lambda: None,
            "pair": lambda: (1.0, 0.0),
            "drive": lambda: Drive(0.0, 0.0),
        }[self.answer]()
"""


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("raise", "act raised ZeroDivisionError: division by zero"),
        ("nan", r"value must lie in \[-9, 9\], got nan"),
        ("infinite", r"value must lie in \[-9, 9\], got inf"),
        ("too much", r"value must lie in \[-9, 9\], got 9.5"),
        ("text", r"value must lie in \[-9, 9\], got 'fast'"),
        ("number", "answered 1.0, expected Acceleration or Drive"),
        ("nothing", "answered None, expected Acceleration or Drive"),
        ("pair", r"answered \(1.0, 0.0\), expected Acceleration or Drive"),
        ("drive", "changed from Acceleration to Drive.*"),
    ],
)
def test_what_a_controller_does_wrong_is_said_with_the_time(
    open_world: Opener, controller: Writer, answer: str, words: str
) -> None:
    """It raises, answers no number, too much, something else, or changes its mind: at 0.30 s."""
    name = controller(BAD)
    said = rf"^ego {name}:Bad at 0\.30 s: .*{words}$"
    with (
        open_world(ego=f"{name}:Bad", ego_params={"answer": answer}) as world,
        pytest.raises(EgoError, match=said),
    ):
        list(episode(world))


TURNING = """
from cavsumo.egos import Drive

class Turning:
    def act(self, snapshot):
        return Drive(0.0, {steering})
"""


@pytest.mark.parametrize("steering", ["0.7", "-0.7", "float('nan')", "None"])
def test_a_steering_angle_out_of_range_is_refused(
    open_world: Opener, controller: Writer, steering: str
) -> None:
    """A car of this kind steers by 0.2 pi at most, to either side."""
    name = controller(TURNING.format(steering=steering))
    with (
        open_world(ego=f"{name}:Turning") as world,
        pytest.raises(EgoError, match=r"at 0\.00 s: steering must lie in \[-0\.628"),
    ):
        list(episode(world))


def test_a_reset_that_raises_is_an_error_of_the_ego(open_world: Opener, controller: Writer) -> None:
    """The controller's own words are kept, whatever it raised."""
    name = controller(
        "class Moody:\n"
        "    def reset(self, scene):\n        raise KeyError('map')\n"
        "    def act(self, snapshot):\n        return None\n"
    )
    with (
        open_world(ego=f"{name}:Moody") as world,
        pytest.raises(EgoError, match="reset raised KeyError: 'map'"),
    ):
        list(episode(world))


MISFITS = """
class Silent:
    pass

class Greedy:
    depart_speed = 99.0
    def act(self, snapshot): ...

class Shapeless:
    kind = "car"
    def act(self, snapshot): ...

class Needy:
    def __init__(self, map): ...
    def act(self, snapshot): ...

class Broken:
    def __init__(self):
        raise OSError("no such model")
"""


@pytest.mark.parametrize(
    ("name", "error", "words"),
    [
        ("Silent", InputError, r"has no method act\(snapshot\)"),
        ("Greedy", InputError, r"depart_speed must lie in \[0, 55\] m/s"),
        ("Shapeless", InputError, "kind must be a cavsumo.model.bodies.Kind, got 'car'"),
        ("Needy", InputError, "cannot be built: TypeError: .*'map'"),
        ("Broken", InputError, "cannot be built: OSError: no such model"),
        ("Silnt", UnknownName, "unknown class .*'Silnt'; did you mean 'Silent'"),
    ],
)
def test_a_class_that_is_no_ego_is_refused_before_anything_runs(
    controller: Writer, name: str, error: type[Exception], words: str
) -> None:
    """No act, wild settings, a constructor that fails, a misspelt name: one line says which."""
    with pytest.raises(error, match=rf"^ego \w+:{name}: .*{words}|unknown class.*{words}"):
        make_ego(f"{controller(MISFITS)}:{name}", {})


@pytest.mark.parametrize(
    ("source", "spec", "words"),
    [
        ("", "no_such_controller:Ego", "no module named 'no_such_controller'"),
        ("import no_such_dependency", "broken:Ego", "no module named 'no_such_dependency'"),
        ("def f(:", "broken:Ego", "importing broken raised SyntaxError"),
        ("1 / 0", "broken:Ego", "importing broken raised ZeroDivisionError"),
    ],
)
def test_a_module_that_cannot_be_imported_is_refused(
    controller: Writer, source: str, spec: str, words: str
) -> None:
    """A missing module, a missing dependency of it, a syntax error, a crash: one line says so."""
    controller(source, "broken")
    with pytest.raises(InputError, match=words) as error:
        make_ego(spec, {})
    assert "\n" not in str(error.value)


def test_a_module_in_the_working_directory_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A controller beside the user, who set no PYTHONPATH."""
    (tmp_path / "beside_me.py").write_text("class Mine:\n    def act(self, s): ...\n")
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.chdir(tmp_path)
    assert type(make_ego("beside_me:Mine", {})).__name__ == "ControllerEgo"


def test_an_unknown_ego_suggests_the_nearest() -> None:
    """A registered name, misspelt."""
    with pytest.raises(UnknownName, match="unknown ego 'time-gp'; did you mean 'time-gap'"):
        make_ego("time-gp", {})
