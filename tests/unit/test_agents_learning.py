"""Q-learning on snapshots made by hand: updates worked out on paper, memory, held actions."""

from __future__ import annotations

import builtins
import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cavsumo.agents import AGENTS, Agent, Scene
from cavsumo.agents.features import FEATURES
from cavsumo.errors import InputError
from cavsumo.model.snapshot import Snapshot

MakeScene = Callable[..., Scene]
See = Callable[..., Snapshot]

STANDING = ((60.0, -5.15, 0.0),)
# A pedestrian stands at x = 60, 3.325 m from the ego's path, and the ego comes from x = 10 with
# 6.75 m/s. Ahead of it: 60 - 0.4375 - 12.25 = 47.3125 m, so near = 1 - 47.3125 / 50. To its strip:
# 3.325 - 0.875 - 0.328125 = 2.121875 m, a tenth of which is beside. Walking there takes 2.0156 s
# (one to get going), the ego is then 33.7 m away: early, not timely.
NEAR, BESIDE = 0.05375, 0.2121875
ACROSS = {"bias": 1.0, "near": NEAR, "early": 1.0, "beside": BESIDE}
WAITING = {"bias": 1.0, "near": NEAR, "waiting": 1.0, "beside": BESIDE}


def learner(scene: Scene, owned: Sequence[int] = (0,), **params: Any) -> Agent:
    """A greedy learner that likes to cross early, at the beginning of its first episode."""
    settings = {"alpha": 0.5, "epsilon": 0.0, "gamma": 1.0, "hold_s": scene.dt} | params
    agent = AGENTS.make("q-learning", settings)
    agent.remember(memory(early=2.0))
    agent.reset(scene, owned, np.random.default_rng(1))
    return agent


def memory(**weights: float) -> dict[str, Any]:
    """What a learner remembers of no episodes: these weights, the others zero."""
    return {"weights": dict.fromkeys(FEATURES, 0.0) | weights, "episodes": 0}


def weights(agent: Agent) -> dict[str, float]:
    """What an agent has learned."""
    learned: dict[str, float] = agent.recall()["weights"]
    return learned


def near(expected: dict[str, float]) -> Any:
    """These weights, the others zero, to rounding."""
    return pytest.approx(dict.fromkeys(FEATURES, 0.0) | expected, abs=1e-12)


def life(agent: Agent, seen: Sequence[Snapshot], rewards: Sequence[float], terminal: bool) -> None:
    """A piece of an episode: from each snapshot to the next with its reward."""
    for i, reward in enumerate(rewards):
        action = agent.choose_action(seen[i])
        last = i == len(rewards) - 1
        agent.process_feedback(seen[i], action, reward, seen[i + 1], terminal and last)


# Features and choice ------------------------------------------------------------------------------


def test_features_by_hand(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """What the learner sees of the scene above, for crossing and for standing."""
    scene = straight_scene(STANDING)
    agent: Any = learner(scene)
    (features,) = agent.features
    snapshot = scene_snapshot(scene, (10.0, 6.75))
    for target, expected in ((0, WAITING), (1, ACROSS), (2, WAITING)):
        seen = dict(zip(FEATURES, features.values(snapshot, target), strict=True))
        assert seen == near(expected)


def test_the_best_target_is_chosen(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """Who likes to be early walks across: full throttle, and steering left from heading east."""
    scene = straight_scene(STANDING)
    snapshot = scene_snapshot(scene, (10.0, 6.75), [(60.0, -5.15, 0.7, 0.0)])
    (action,) = learner(scene).choose_action(snapshot)
    assert tuple(action) == pytest.approx((1.4, 0.4 * math.pi))


def test_actions_are_held(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """Every half second a new target is drawn, and none in between."""
    scene = straight_scene(STANDING)
    snapshot = scene_snapshot(scene, (10.0, 6.75), [(60.0, -5.15, 1.0, 0.0)])
    agent = learner(scene, hold_s=0.5, epsilon=1.0)
    chosen = []
    for _ in range(200):
        chosen.append(agent.choose_action(snapshot))
        agent.process_feedback(snapshot, chosen[-1], 0.0, snapshot, False)
    changes = {i % 5 for i in range(1, 200) if chosen[i] != chosen[i - 1]}
    assert changes == {0}
    # Stand, across, along either way; going back begins with the same turn as going across.
    assert len(set(chosen)) == 4


# Updates ------------------------------------------------------------------------------------------


def test_a_goal_is_not_bootstrapped(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """Q was 2, the goal gave 10: half the error of 8 goes to each feature, and nothing follows."""
    scene = straight_scene(STANDING)
    snapshot = scene_snapshot(scene, (10.0, 6.75))
    agent = learner(scene, hold_s=5.0)
    life(agent, [snapshot, snapshot], [10.0], terminal=True)
    assert weights(agent) == near(
        {"bias": 4.0, "near": 4.0 * NEAR, "early": 2.0 + 4.0, "beside": 4.0 * BESIDE}
    )


def test_what_follows_is_bootstrapped(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """Q was 2, the step cost 0.1, the best that follows is worth 2, discounted by 0.5 a second."""
    scene = straight_scene(STANDING)
    snapshot = scene_snapshot(scene, (10.0, 6.75))
    agent = learner(scene, gamma=0.5)
    life(agent, [snapshot, snapshot], [-0.1], terminal=False)
    change = 0.5 * (-0.1 + 0.5**0.1 * 2.0 - 2.0)
    assert weights(agent) == near(
        {"bias": change, "near": change * NEAR, "early": 2 + change, "beside": change * BESIDE}
    )


def test_a_held_action_learns_once_from_all_its_rewards(
    straight_scene: MakeScene, scene_snapshot: See
) -> None:
    """Two timesteps with rewards 1 and 3, then the best worth 2: 1 + 3 d + 2 d^2, d = 0.5^0.1."""
    scene = straight_scene(STANDING)
    coming, discount = scene_snapshot(scene, (10.0, 6.75)), 0.5**0.1
    agent = learner(scene, gamma=0.5, hold_s=0.2)
    life(agent, [coming, coming], [1.0], terminal=False)
    assert weights(agent) == near({"early": 2.0}), "learned before the action was over"
    life(agent, [coming, coming], [3.0], terminal=False)
    change = 0.5 * (1.0 + discount * 3.0 + discount**2 * 2.0 - 2.0)
    assert weights(agent) == near(
        {"bias": change, "near": change * NEAR, "early": 2 + change, "beside": change * BESIDE}
    )


def test_two_bodies_of_one_agent_learn_together(
    straight_scene: MakeScene, scene_snapshot: See
) -> None:
    """Each body adds its features: Q was 4, the goal gave 10, and each weight moves twice."""
    scene = straight_scene(STANDING * 2)
    snapshot = scene_snapshot(scene, (10.0, 6.75))
    agent = learner(scene, owned=(0, 1))
    assert len(agent.choose_action(snapshot)) == 2
    life(agent, [snapshot, snapshot], [10.0], terminal=True)
    assert weights(agent) == near(
        {"bias": 6.0, "near": 6.0 * NEAR, "early": 2.0 + 6.0, "beside": 6.0 * BESIDE}
    )


def test_the_learning_rate_halves(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """After one half-life of episodes the same goal moves the weights half as far."""
    scene = straight_scene(STANDING)
    snapshot = scene_snapshot(scene, (10.0, 6.75))
    agent = learner(scene, half_life=4.0)
    for _ in range(4):
        agent.reset(scene, (0,), np.random.default_rng(1))
    life(agent, [snapshot, snapshot], [10.0], terminal=True)
    assert weights(agent)["early"] == pytest.approx(2.0 + 0.5 * 4.0)


def test_an_episode_does_not_go_on_in_the_next(
    straight_scene: MakeScene, scene_snapshot: See
) -> None:
    """An action that the horizon cut off leaves no reward behind for the next episode."""
    scene = straight_scene(STANDING)
    snapshot = scene_snapshot(scene, (10.0, 6.75))
    agent = learner(scene, hold_s=1.0, half_life=1e9)
    life(agent, [snapshot, snapshot], [50.0], terminal=False)
    agent.reset(scene, (0,), np.random.default_rng(1))
    life(agent, [snapshot, snapshot], [10.0], terminal=True)
    assert weights(agent)["early"] == pytest.approx(6.0)


# Memory -------------------------------------------------------------------------------------------


def test_memory_is_plain_data(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """What one learner recalls, another one takes up, also through a JSON file in between."""
    scene = straight_scene(STANDING)
    snapshot = scene_snapshot(scene, (10.0, 6.75))
    one = learner(scene)
    life(one, [snapshot, snapshot], [10.0], terminal=True)
    other = AGENTS.make("q-learning", {})
    other.remember(json.loads(json.dumps(one.recall())))
    assert other.recall() == one.recall()
    assert one.recall()["episodes"] == 1


def test_weights_come_from_a_file(tmp_path: Path) -> None:
    """A learner begins with the weights of a JSON file, its episodes counted from none."""
    file = tmp_path / "weights.json"
    file.write_text(json.dumps(memory(bias=1.5, timely=-3.0)))
    agent = AGENTS.make("q-learning", {"weights": str(file)})
    assert agent.recall() == memory(bias=1.5, timely=-3.0)


@pytest.mark.parametrize("others", [{}, {"q-learning": [memory(bias=2.0)]}])
def test_weights_come_from_the_manifest_of_a_batch(tmp_path: Path, others: dict[str, Any]) -> None:
    """From the learner without a label, or from the only one."""
    file = tmp_path / "results.json"
    file.write_text(json.dumps({"learned": {"wild": [memory(bias=1.5)]} | others}))
    agent = AGENTS.make("q-learning", {"weights": str(file)})
    assert agent.recall() == memory(bias=2.0 if others else 1.5)


def test_without_learning_nothing_changes(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """Weights that are only played stay as they are, greedily, and no episode is counted."""
    scene = straight_scene(STANDING)
    snapshot = scene_snapshot(scene, (10.0, 6.75), [(60.0, -5.15, 0.7, 0.0)])
    agent = learner(scene, learn=False, epsilon=1.0)
    for _ in range(50):
        assert agent.choose_action(snapshot)[0].throttle == 1.4
        life(agent, [snapshot, snapshot], [10.0], terminal=True)
    assert agent.recall() == memory(early=2.0)


@pytest.mark.parametrize(
    "text",
    [
        None,
        "",
        "not json",
        "[1, 2]",
        '{"weights": {"bias": 1.0}}',
        '{"weights": [0, 0, 0, 0, 0, 0, 0]}',
        json.dumps(memory(near=math.nan)),
        json.dumps(memory(near=math.inf)),
        json.dumps({"weights": dict.fromkeys(FEATURES, "much")}),
        json.dumps({"learned": {"wild": [memory()], "tame": [memory()]}}),
    ],
)
def test_bad_weights_are_refused(tmp_path: Path, text: str | None) -> None:
    """A weights file that is missing, foreign or holds no numbers is the user's mistake."""
    file = tmp_path / "weights.json"
    if text is not None:
        file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="agent q-learning: "):
        AGENTS.make("q-learning", {"weights": str(file)})


@pytest.mark.parametrize(
    ("name", "value"), [("alpha", 1.5), ("gamma", -0.1), ("epsilon", 2.0), ("hold_s", -1.0)]
)
def test_rates_out_of_range_are_refused(name: str, value: float) -> None:
    """Rates lie between nothing and one, and time does not run backwards."""
    with pytest.raises(InputError, match=f"agent q-learning: {name} must"):
        AGENTS.make("q-learning", {name: value})


@pytest.mark.parametrize("value", ["no", "False"])
def test_learn_is_a_truth_value(value: object) -> None:
    """``learn=no`` is refused rather than read as yes."""
    with pytest.raises(InputError, match="learn"):
        AGENTS.make("q-learning", {"learn": value})


def test_what_is_learned_does_not_depend_on_how_python_adds(
    straight_scene: MakeScene, scene_snapshot: See, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Since Python 3.12 the built-in sum compensates the rounding of floats, before it does not."""
    scene = straight_scene([(60.0, -5.15, 0.0), (57.3, -5.15, 0.0), (71.9, 5.15, math.pi)])
    rng = np.random.default_rng(4)
    seen = [
        scene_snapshot(scene, (10.0 + 0.37 * i, float(rng.uniform(3.0, 9.0))), step=i)
        for i in range(60)
    ]

    def plain(values: Any, start: Any = 0) -> Any:
        for value in values:
            start = start + value
        return start

    def compensated(values: Any, start: Any = 0) -> Any:
        found = list(values)
        floats = bool(found) and all(isinstance(value, float) for value in found)
        return math.fsum([start, *found]) if floats else plain(found, start)

    learned = []
    for addition in (plain, compensated):
        monkeypatch.setattr(builtins, "sum", addition)
        agent = learner(scene, (0, 1, 2), alpha=0.1, epsilon=0.4, gamma=0.97)
        life(agent, seen, [-0.1, -0.3, 0.7] * 19, terminal=True)
        learned.append(agent.recall())
    monkeypatch.undo()
    assert learned[0] == learned[1]
    assert any(value not in (0.0, 2.0) for value in learned[0]["weights"].values())
