"""A policy file: written and read, evaluated by hand, refused in one sentence when it is none."""

from __future__ import annotations

import io
import json
import math
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import ROOT

from cavsumo.agents import Agent, Scene
from cavsumo.agents.observations import VERSION, entries
from cavsumo.agents.policy import PolicyAgent, effort, make_agent, parameters_of
from cavsumo.agents.policy_file import Header, Observed, TrainedPolicy, read_policy, write_policy
from cavsumo.cli.listings import listing
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.bodies import BUS, PEDESTRIAN
from cavsumo.model.snapshot import Snapshot
from cavsumo.testing import AgentContract

NAMES = tuple(name for name, _, _ in entries(1, 1.4, 1.0))
NET = ROOT / "networks" / "pedestrians.net.xml"


def header(**changed: Any) -> Header:
    """The header of a policy, for one pedestrian if nothing else is said."""
    names = [name for name, _, _ in entries(changed.get("bodies", 1), 1.4, 1.0)]
    return Header(**{"observation": Observed(version=VERSION, names=tuple(names))} | changed)


def policy(outputs: int = 2, hidden: int = 4, **changed: Any) -> TrainedPolicy:
    """A policy with one hidden layer and fixed random weights."""
    said = header(**changed)
    rng, n, bodies = np.random.default_rng(7), len(said.observation.names), said.bodies
    layers = (
        (rng.normal(size=(n, hidden)), rng.normal(size=hidden)),
        (0.1 * rng.normal(size=(hidden, outputs)), 0.1 * rng.normal(size=outputs)),
    )
    table = rng.uniform(-1, 1, (outputs, 2 * bodies)) if said.actions == "table" else None
    return TrainedPolicy(said, np.zeros(n), np.full(n, 10.0), layers, table)


def constant(*outputs: float, **changed: Any) -> TrainedPolicy:
    """A policy that says the same whatever it sees."""
    n = len(NAMES)
    layer = np.zeros((n, len(outputs))), np.array(outputs)
    return TrainedPolicy(header(**changed), np.zeros(n), np.ones(n), (layer,))


@pytest.mark.parametrize("actions", ["effectors", "table", "targets"])
def test_a_policy_is_read_as_it_was_written(tmp_path: Path, actions: str) -> None:
    """Every number and every word; and the same policy gives the same bytes."""
    made = policy({"effectors": 2, "table": 3, "targets": 5}[actions], actions=actions, hold=4)
    for name in ("a.npz", "b.npz"):
        write_policy(tmp_path / name, made)
    read = read_policy(tmp_path / "a.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert read.header == made.header
    seen = np.linspace(-3.0, 3.0, len(NAMES)).astype(np.float32)
    assert read.outputs(seen).tolist() == made.outputs(seen).tolist()


@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_what_comes_out_is_what_one_computes_by_hand(activation: str) -> None:
    """Scaled, clipped, two layers; against plain Python."""
    made = policy(2, activation=activation, clip=0.2)
    seen = np.linspace(-3.0, 3.0, len(NAMES)).astype(np.float32)
    f: Callable[[float], float] = math.tanh if activation == "tanh" else lambda v: max(v, 0.0)
    x = [max(-0.2, min(0.2, float(v) / 10.0)) for v in seen]
    (w0, b0), (w1, b1) = made.layers
    h = [f(sum(x[i] * w0[i, j] for i in range(len(x))) + b0[j]) for j in range(4)]
    y = [sum(h[i] * w1[i, j] for i in range(4)) + b1[j] for j in range(2)]
    assert made.outputs(seen).tolist() == pytest.approx(y, abs=1e-12)


def test_actions_come_out_of_the_effectors_ranges_and_of_the_table() -> None:
    """Clipped efforts; the best row of a table, the first of two that are as good."""
    seen = np.zeros(len(NAMES), dtype=np.float32)
    assert constant(0.5, -7.0).efforts(seen) == [(0.5, -1.0)]
    table = np.array([[-1.0, 0.0], [1.0, 0.25], [1.0, -0.25]])
    layer = (np.zeros((len(NAMES), 3)), np.array([0.0, 2.0, 2.0]))
    n = len(NAMES)
    made = TrainedPolicy(header(actions="table"), np.zeros(n), np.ones(n), (layer,), table)
    assert made.efforts(seen) == [(1.0, 0.25)]
    assert constant(0.0, 1.0, 5.0, 2.0, 3.0, actions="targets").targets(seen) == [2]


def test_an_effort_spans_an_effector() -> None:
    """-1 is the lower limit, 0 the middle, 1 the upper limit; for kinds of any size."""
    for kind in (PEDESTRIAN, BUS):
        assert effort(kind, -1.0, 1.0) == (kind.throttle_min, kind.steering_max)
        assert effort(kind, 0.0, 0.0) == (0.0, 0.0)
        assert effort(kind, 1.0, -0.5) == (kind.throttle_max, -0.5 * kind.steering_max)


def test_a_decision_holds_for_so_many_timesteps(
    straight_scene: Callable[..., Scene], scene_snapshot: Callable[..., Snapshot]
) -> None:
    """With hold 3 the policy is asked at the timesteps 0, 3, 6, and anew after a reset."""
    scene = straight_scene()
    agent = PolicyAgent(policy(2, hold=3))
    rng = np.random.default_rng(1)
    for _ in range(2):
        agent.reset(scene, (0,), rng)
        chosen = [
            agent.choose_action(scene_snapshot(scene, (5.0 * t, 8.0), step=t)) for t in range(9)
        ]
        assert chosen[0] == chosen[1] == chosen[2] != chosen[3]
        assert chosen[3] == chosen[4] == chosen[5] != chosen[6]


def test_a_target_is_walked_to_in_every_timestep(
    straight_scene: Callable[..., Scene], scene_snapshot: Callable[..., Snapshot]
) -> None:
    """Target 1 is across the road: a body that faces along it turns to the left, then goes on."""
    scene = straight_scene([(60.0, -5.15, 0.0)])
    agent = PolicyAgent(constant(0.0, 1.0, 0.0, 0.0, 0.0, actions="targets", hold=50))
    agent.reset(scene, (0,), np.random.default_rng(1))
    along = agent.choose_action(scene_snapshot(scene, testers=[(60.0, -5.15, 1.4, 0.0)]))
    across = agent.choose_action(scene_snapshot(scene, testers=[(60.0, -5.15, 1.4, math.pi / 2)]))
    assert along[0].steering == PEDESTRIAN.steering_max
    assert across[0] == pytest.approx((0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize(("actions", "outputs"), [("effectors", 4), ("table", 3), ("targets", 10)])
class TestPolicyContract(AgentContract):
    """A policy that owns two bodies keeps the contract of tester agents, whatever it answers."""

    net = NET

    @pytest.fixture(autouse=True)
    def _answering(self, actions: str, outputs: int) -> None:
        self.policy = policy(outputs, actions=actions, bodies=2, hold=3)

    def make(self) -> Agent:
        return PolicyAgent(self.policy)


def foreign(folder: Path, sort: str) -> Path:
    """A file that is no policy, of some sort."""
    file = folder / f"{sort}.npz"
    made = policy(2)
    arrays: dict[str, Any] = {
        "header": np.array(json.dumps(made.header.model_dump(mode="json"))),
        "mean": made.mean,
        "scale": made.scale,
    }
    for i, (weights, biases) in enumerate(made.layers):
        arrays |= {f"weights{i}": weights, f"biases{i}": biases}

    def renamed(**changed: Any) -> np.ndarray[Any, Any]:
        return np.array(json.dumps(json.loads(str(arrays["header"])) | changed))

    n = len(NAMES)
    changes: dict[str, dict[str, Any]] = {
        "objects": {"mean": np.array([{}] * n)},
        "headless": {"header": None},
        "no JSON": {"header": np.array("{")},
        "other format": {"header": renamed(format="weights")},
        "newer": {"header": renamed(version=2)},
        "other key": {"header": renamed(holds=3)},
        "no hold": {"header": renamed(hold=0)},
        "other kind": {"header": renamed(kind="tram")},
        "two bodies": {"header": renamed(bodies=2)},
        "older observation": {"header": renamed(observation={"version": 0, "names": NAMES})},
        "other names": {
            "header": renamed(observation={"version": VERSION, "names": ("speed", *NAMES[1:])})
        },
        "targets": {"header": renamed(actions="targets")},
        "table": {"header": renamed(actions="table")},
        "mean": {"mean": np.zeros(3)},
        "scale": {"scale": np.zeros(n)},
        "NaN": {"weights0": np.full((n, 4), math.nan)},
        "text": {"biases1": np.array(["a", "b"])},
        "gap": {"biases0": None},
        "shape": {"weights1": np.zeros((3, 2))},
        "layers": {"weights0": None, "biases0": None, "weights1": None, "biases1": None},
        "extra": {"notes": np.zeros(1)},
    }
    if sort in changes:
        arrays |= changes[sort]
        np.savez(file, **{k: v for k, v in arrays.items() if v is not None})
    elif sort == "a folder":
        file.mkdir()
    elif sort == "an array":
        with file.open("wb") as out:
            np.save(out, np.zeros(3))
    elif sort != "none":
        whole = io.BytesIO()
        np.savez(whole, **arrays)
        content = {"torn": whole.getvalue()[:-400], "a pickle": pickle.dumps({"a": 1})}
        file.write_bytes(content.get(sort, sort.encode()))
    return file


@pytest.mark.parametrize(
    ("sort", "words"),
    [
        ("none", "No such file"),
        ("a folder", "directory"),
        ("", r"no \.npz archive of plain arrays"),
        ("some text", r"no \.npz archive of plain arrays"),
        ("an array", r"no \.npz archive of plain arrays"),
        ("a pickle", r"no \.npz archive of plain arrays"),
        ("torn", r"no \.npz archive of plain arrays"),
        ("objects", r"no \.npz archive of plain arrays"),
        ("headless", "it has no header"),
        ("no JSON", "its header is no JSON"),
        ("other format", "format: .*'cavsumo-policy', got 'weights'"),
        ("newer", "version: .*1, got 2"),
        ("other key", "holds: Extra inputs .*, got 3"),
        ("no hold", "hold: .*greater than or equal to 1, got 0"),
        ("other kind", "kind 'tram' is none of pedestrian, car, bus, bicycle"),
        ("two bodies", "entry 12 of its observation is 'other.ahead_m', expected 'body1.ahead_m'"),
        ("older observation", f"trained on version 0 of the observation, this is {VERSION}"),
        ("other names", "entry 0 of its observation is 'speed', expected 'ego.speed_mps'"),
        ("targets", "the last layer has 2 outputs, targets need 5"),
        ("table", "it has no table"),
        ("mean", r"mean has the shape \(3,\), expected \(15,\)"),
        ("scale", "scale must be positive"),
        ("NaN", "weights0 must be finite"),
        ("text", "biases1 must hold numbers"),
        ("gap", "it has no biases0"),
        ("shape", r"weights1 has the shape \(3, 2\), expected \(4, 2\)"),
        ("layers", "it has no weights0"),
        ("extra", "it has an array 'notes' that no policy has"),
    ],
)
def test_what_is_no_policy_is_refused_in_one_sentence(
    tmp_path: Path, sort: str, words: str
) -> None:
    """Missing, foreign, damaged, of another version, misshapen: what is wrong, in one line."""
    file = foreign(tmp_path, sort)
    with pytest.raises(InputError, match=rf"^policy '.*{file.name}': .*{words}") as error:
        read_policy(file)
    assert "\n" not in str(error.value)


@pytest.fixture
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy that walks across at once, in a folder of its own."""
    file = tmp_path_factory.mktemp("policies") / "across.npz"
    write_policy(file, constant(0.0, 1.0, 0.0, 0.0, 0.0, actions="targets"))
    return file


def test_the_command_line_says_no_to_a_policy_that_does_not_fit(
    refused: Callable[..., str], kept: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """No file, a broken one, other bodies, a parameter: exit status 2, nothing written."""
    broken = foreign(tmp_path_factory.mktemp("broken"), "NaN")
    assert "No such file" in refused("--agent", "policy:nowhere.npz")
    assert "policy:FILE" in refused("--agent", "policy:")
    assert "weights0 must be finite" in refused("--agent", f"policy:{broken}")
    many = ("--bodies-per-agent", "3")
    assert "1 pedestrian a team, this has 3" in refused("--agent", f"policy:{kept}", *many)
    cars = refused("--agent", f"policy:{kept}", "--kind", "car")
    assert "trained for 1 pedestrian a team, this has 1 car" in cars
    unknown = refused("--agent", f"policy:{kept}", "--param", f"policy:{kept}.speed=3")
    assert "unknown parameter" in unknown


def test_a_policy_is_listed(kept: Path) -> None:
    """Beside the registered agents, and what is in a file."""
    assert listing("agents", None).splitlines()[-1].startswith("policy:FILE")
    assert "15 > 5, relu" in listing("agents", f"policy:{kept}")
    assert parameters_of(f"policy:{kept}") == []
    with pytest.raises(UnknownName, match="unknown parameter 'hold'"):
        make_agent(f"policy:{kept}", {"hold": 3})
