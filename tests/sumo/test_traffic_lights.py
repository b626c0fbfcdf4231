"""Traffic lights as asked for: the arithmetic, and what the ego then does in SUMO."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from cavsumo.errors import NetworkError, SimulationError
from cavsumo.model.scenario import BatchPlan
from cavsumo.network.site import Site
from cavsumo.network.traffic_lights import Pace, arrival, phase_at_start
from cavsumo.sumo.world import World

Staged = Callable[..., tuple[BatchPlan, Site]]
Opener = Callable[..., World]
CALM = {"sigma": 0, "speedDev": 0, "actionStepLength": 0}
PROGRAM = [(37.0, "Gr"), (5.0, "gr"), (3.0, "yr"), (37.0, "rG"), (8.0, "rr")]


def shown(phases: list[tuple[float, str]], link: int, phase: int, left: float, after: float) -> str:
    """What a light that starts in a phase shows of a link some time later [s]."""
    while after >= left:
        after -= left
        phase = (phase + 1) % len(phases)
        left = phases[phase][0]
    return phases[phase][1][link]


@pytest.mark.parametrize("letter", "Ggyr")
@pytest.mark.parametrize("arrival_s", [0.0, 0.1, 3.0, 7.7, 19.0, 45.0, 90.0, 200.0])
@pytest.mark.parametrize("shift", range(len(PROGRAM)))
def test_the_colour_is_shown_on_arrival(letter: str, arrival_s: float, shift: int) -> None:
    """Whatever the order of the phases and the time of the arrival, with half of it left."""
    phases = PROGRAM[shift:] + PROGRAM[:shift]
    start = phase_at_start(phases, 0, letter, arrival_s, arrival_s + 1.0)
    assert start is not None
    phase, left = start
    assert 0.0 < left <= phases[phase][0]
    longest = {"G": 37.0, "g": 5.0, "y": 3.0, "r": 45.0}[letter]
    for later in (0.0, 0.49 * longest):
        assert shown(phases, 0, phase, left, arrival_s + later) == letter
    if arrival_s + 1.0 < longest / 2:  # then it has been on all the way
        assert shown(phases, 0, phase, left, 0.0) == letter
    middle = phase_at_start(phases, 0, letter, arrival_s, math.inf)
    assert middle is not None
    for later in (-0.49 * longest, 0.49 * longest):
        if arrival_s + later >= 0.0:
            assert shown(phases, 0, *middle, arrival_s + later) == letter


def test_a_colour_never_shown_or_always() -> None:
    """No phase with it, no such link, no phases at all; a light that never changes."""
    assert phase_at_start(PROGRAM, 1, "y", 5.0, 6.0) is None
    assert phase_at_start(PROGRAM, 2, "G", 5.0, 6.0) is None
    assert phase_at_start([], 0, "G", 5.0, 6.0) is None
    assert phase_at_start([(30.0, "G"), (10.0, "G")], 0, "G", 5.0, 6.0) is not None


def test_when_an_unhindered_ego_arrives() -> None:
    """By the speed limits and its own, at its own speed if it has one, from standing."""
    legs = [(100.0, 10.0), (50.0, 5.0)]
    assert arrival(legs, Pace()) == 20.0
    assert arrival(legs, Pace(top=5.0)) == 30.0
    assert arrival(legs, Pace(start=15.0)) == 10.0
    assert arrival(legs, Pace(start=0.0)) == pytest.approx(20.0 + 7.5 / 5.2)
    assert arrival([(1.3, 10.0)], Pace(start=0.0)) == pytest.approx(1.0)


def slowest(world: World) -> float:
    """The lowest speed of the ego on its way [m/s]."""
    snapshot = world.reset(3, (), ())
    speeds = [snapshot.ego.v]
    for _ in range(600):
        following = world.step((), None)
        if following is None:
            return min(speeds)
        speeds.append(following.ego.v)
    return min(speeds)


@pytest.mark.parametrize("junction", ["25291565", "1377211666"])
@pytest.mark.parametrize("ego_route", ["straight", "right"])
def test_the_ego_passes_at_green_and_stops_at_red(
    open_world: Opener, junction: str, ego_route: str
) -> None:
    """In SUMO, on empty roads, at real traffic lights."""
    where = {"junction": junction, "ego_route": [ego_route], "ego_params": CALM}
    with open_world("junction", signal="green", **where) as world:
        assert slowest(world) > 2.0
    with open_world("junction", signal="red", **where) as world:
        assert slowest(world) < 0.1


def test_a_slow_ego_meets_them_too(open_world: Opener) -> None:
    """The time of arrival is that of the ego's own speed."""
    slow = {"maxSpeed": 4, **CALM}
    with open_world("junction", signal="green", ego_params=slow) as world:
        assert slowest(world) > 2.0
    with open_world("junction", signal="red", ego_params=slow) as world:
        assert slowest(world) < 0.1


def test_what_a_light_shows_is_seen(open_world: Opener, staged: Staged) -> None:
    """The ego stands before the stop line as long as the snapshots show red, then passes."""
    wishes = {"signal": "red", "ego_params": CALM}
    light = staged("junction", **wishes)[1].lights[0]
    with open_world("junction", **wishes) as world:
        snapshot = world.reset(3, (), ())
        assert snapshot.lights[0] == "r"
        half, path = snapshot.ego.body.kind.length / 2, world.site.route.path
        nearest, shown = math.inf, set()
        for _ in range(1200):
            following = world.step((), None)
            if following is None:
                break
            front = path.project(following.ego.x, following.ego.y).along + half
            if front < light.along:
                shown.add(following.lights[0])
                if following.lights[0] == "r":
                    nearest = min(nearest, light.along - front)
        assert shown & set("Gg")
        assert 0.0 < nearest < 3.0
        world.reset(3, (), (), everything=False)  # who is to blame depends on them, whoever looks
        following = world.step((), None)
        assert following is not None
        assert following.lights == ("r",)


def test_any_leaves_the_lights_alone(staged: Staged) -> None:
    """Without a wish nothing is computed and nothing set."""
    assert staged("junction")[1].light is None
    assert staged("junction", signal="any")[1].light is None


def edited(networks: dict[str, Path], folder: Path, *replacements: tuple[str, str]) -> Path:
    """The junction's network with some of its text replaced."""
    text = networks["junction"].read_text(encoding="utf-8")
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    file = folder / "edited.net.xml"
    file.write_text(text, encoding="utf-8")
    return file


def test_lights_that_cannot_be_timed_are_refused(
    staged: Staged, networks: dict[str, Path], tmp_path: Path
) -> None:
    """No light on the route; one that reacts to traffic; one that never shows the colour."""
    with pytest.raises(NetworkError, match="signal red: the ego's route has no traffic light"):
        staged("crossing", signal="red")
    actuated = edited(networks, tmp_path, ('type="static"', 'type="actuated"'))
    with pytest.raises(NetworkError, match="is actuated; only static programs can be timed"):
        staged(net=actuated, signal="green")
    assert staged(net=actuated)[1].light is None
    (tmp_path / "green").mkdir()
    text = networks["junction"].read_text(encoding="utf-8")
    states = {part.split('"')[0] for part in text.split('state="')[1:]}
    always = [(f'state="{s}"', f'state="{"G" * len(s)}"') for s in states if len(s) > 1]
    green = edited(networks, tmp_path / "green", *always)
    with pytest.raises(NetworkError, match="never shows red to the ego"):
        staged(net=green, signal="red")


def test_another_program_is_noticed(open_world: Opener, tmp_path: Path) -> None:
    """An additional file may bring a program of its own; the network's is not meant then."""
    phases = '<phase duration="20" state="GGGGGGGGGGGGGGGG"/>'
    file = tmp_path / "own.add.xml"
    file.write_text(
        f'<additional><tlLogic id="25291565" type="static" programID="mine" offset="0">{phases}'
        "</tlLogic></additional>"
    )
    with (
        open_world("junction", signal="red", additional=[str(file)]) as world,
        pytest.raises(SimulationError, match="runs program 'mine', not the network's '0'"),
    ):
        world.reset(1, (), ())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["crossing", "--signal", "green"], "signal green: the ego's route has no traffic light"),
        (["junction", "--signal", "blue"], "unknown value 'blue'; valid: any, green, red"),
    ],
)
def test_bad_signals_are_one_sentence(
    refused: Callable[..., str], networks: dict[str, Path], words: list[str], said: str
) -> None:
    """Exit status 2, nothing written."""
    net, *options = words
    assert said in refused("--net", str(networks[net]), *options)
