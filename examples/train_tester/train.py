"""Train a tester with stable-baselines3 and write it as a policy file.

    pip install 'cavsumo[sb3]'
    python examples/train_tester/train.py --net networks/crossing.net.xml -o tester.npz
    cavsumo run --net networks/crossing.net.xml --agent policy:tester.npz --agent random

One pedestrian on empty roads learns by DQN (Mnih et al. 2015, doi:10.1038/nature14236) where to
walk: the reward is that of ``cavsumo/Tester-v0``, a hundredth of it. Now and then the greedy policy
is written to the file and plays a batch of ``cavsumo run`` on seeds that training does not see,
with as many testers, and the traffic, of the default scenario; the best file so far is kept.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gymnasium
import torch
from export import exported
from stable_baselines3 import DQN
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from cavsumo.agents.observations import entries
from cavsumo.agents.policy_file import write_policy
from cavsumo.batch.executors import Means
from cavsumo.cli.commands.run import Manner, run
from cavsumo.envs.discrete import DiscreteActions
from cavsumo.results.reading import read_rows
from cavsumo.results.statistics import Rate, rate

HOLD = 5  # timesteps that an action lasts
PASSED_M = -5.0  # an ego that is so far past the body meets it no more
VALIDATION_SEED = 1_000_003  # of the batches during training; that of ``cavsumo run`` is 1
BASELINES = ("random", "proximity", "timing")
COLUMNS = ("decisions", "episodes", "seconds", "runs", "tests", "rate", "low", "high", "unfair")


class EndWhenPassed(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Ends an episode when the ego has passed the body: nothing comes of it any more."""

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        self._ahead = [name for name, _, _ in entries(1, 1.0, 1.0)].index("body0.ahead_m")

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        seen, reward, terminated, truncated, info = self.env.step(action)
        return seen, reward, terminated or bool(seen[self._ahead] < PASSED_M), truncated, info


def make_env(net: Path) -> gymnasium.Env[Any, Any]:
    """One pedestrian that chooses where to walk, on empty roads."""
    env = gymnasium.make(
        "cavsumo.envs:cavsumo/Tester-v0",
        disable_env_checker=True,
        net=str(net),
        routes="none",
        testers=1,
        actions="targets",
        hold=HOLD,
    )
    hundredth = gymnasium.wrappers.TransformReward(EndWhenPassed(env), lambda reward: reward / 100)
    return DiscreteActions(hundredth)


def evaluate(net: Path, agents: Sequence[str], runs: int) -> dict[str, tuple[Rate, int]]:
    """The rate of tests of some agents in the default scenario, and how many were unfair."""
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "results.csv"
        settings = {"net": str(net), "agents": agents, "runs": runs, "trace": "none"}
        run(settings | {"seed": VALIDATION_SEED}, results, Means(), Manner(quiet=True))
        rows = read_rows(results)
    found = {}
    for agent in agents:
        outcomes = [row["outcome"] for row in rows if row["agent"] == agent]
        tests = sum(outcome in ("held", "violated") for outcome in outcomes)
        found[agent] = rate(tests, len(outcomes)), outcomes.count("unfair")
    return found


class Curve(BaseCallback):
    """Evaluates now and then, notes the curve and keeps the best policy."""

    def __init__(self, options: argparse.Namespace, normaliser: VecNormalize) -> None:
        super().__init__()
        self.options, self.normaliser = options, normaliser
        self.rows: list[dict[str, Any]] = []
        self._best, self._episodes, self._begun = -1.0, 0, time.perf_counter()

    def _on_step(self) -> bool:
        self._episodes += int(self.locals["dones"].sum())
        if self.num_timesteps % self.options.every == 0:
            self._evaluate()
        return True

    def _evaluate(self) -> None:
        """Write the greedy policy, have it play, and keep it if it is the best so far."""
        options, seconds = self.options, time.perf_counter() - self._begun
        tried = options.output.with_suffix(".tried.npz")
        write_policy(tried, exported(self.model, self.normaliser, HOLD, self._metadata()))
        agent = f"policy:{tried}"
        found, unfair = evaluate(options.net, [agent], options.evaluations)[agent]
        if found.value is not None and found.value > self._best:
            self._best = found.value
            tried.replace(options.output)
        tried.unlink(missing_ok=True)
        values = (self.num_timesteps, self._episodes, round(seconds, 1), found.total, found.count)
        values += (found.value, round(found.low or 0.0, 4), round(found.high or 0.0, 4), unfair)
        self.rows.append(dict(zip(COLUMNS, values, strict=True)))
        print(*(f"{k} {v}" for k, v in self.rows[-1].items()), sep=", ", flush=True)

    def _metadata(self) -> dict[str, Any]:
        """The metadata of a policy file: how it was trained."""
        return {
            "trained on": self.options.net.name,
            "by": "DQN, stable-baselines3, examples/train_tester/train.py",
            "decisions": self.num_timesteps,
            "episodes": self._episodes,
            "seed": self.options.seed,
        }


def train(options: argparse.Namespace) -> Curve:
    """Learn; the best policy is in the output file afterwards."""
    torch.set_num_threads(1)
    env = DummyVecEnv([lambda: make_env(options.net)])
    normaliser = VecNormalize(env, norm_reward=False)
    model = DQN(
        "MlpPolicy",
        normaliser,
        learning_rate=1e-3,
        buffer_size=50_000,
        learning_starts=1_000,
        batch_size=64,
        gamma=0.99,
        n_steps=3,
        train_freq=2,
        target_update_interval=500,
        exploration_fraction=0.8,
        exploration_final_eps=0.05,
        policy_kwargs={"net_arch": [64, 64]},
        seed=options.seed,
        device="cpu",
    )
    curve = Curve(options, normaliser)
    model.learn(options.decisions, callback=curve)
    normaliser.close()
    return curve


def write_curve(file: Path, rows: list[dict[str, Any]]) -> None:
    """The curve as a table."""
    with file.open("w", encoding="utf-8", newline="") as out:
        writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def draw(file: Path, rows: list[dict[str, Any]], baselines: dict[str, Rate]) -> None:
    """The curve as a picture, with what the registered testers reach on the same seeds."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "cavsumo"
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7.0, 4.0), layout="constrained")
    x = [row["decisions"] for row in rows]
    axes.fill_between(x, [r["low"] for r in rows], [r["high"] for r in rows], alpha=0.25)
    axes.plot(x, [r["rate"] for r in rows], marker="o", label="DQN, greedy")
    for i, (name, found) in enumerate(baselines.items(), 1):
        axes.axhline(found.value or 0.0, color=f"C{i}", linestyle="--", label=name)
    axes.set(xlabel="decisions in training", ylabel="tests per episode", ylim=(0.0, 1.0))
    axes.legend(loc="upper left", ncols=2)
    figure.savefig(file, metadata={"Date": None})
    pyplot.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--net", type=Path, required=True, help="SUMO network")
    parser.add_argument("-o", "--output", type=Path, default=Path("tester.npz"), metavar="FILE")
    parser.add_argument("--decisions", type=int, default=20_000, help="how long to train")
    parser.add_argument("--every", type=int, default=4_000, help="decisions between evaluations")
    parser.add_argument("--evaluations", type=int, default=40, help="episodes of an evaluation")
    parser.add_argument("--seed", type=int, default=1, help="of the training")
    options = parser.parse_args()
    curve = train(options)
    write_curve(options.output.with_suffix(".csv"), curve.rows)
    played = evaluate(options.net, BASELINES, options.evaluations)
    baselines = {name: found for name, (found, _) in played.items()}
    for name, found in baselines.items():
        print(f"{name}: {found.count} tests in {found.total} episodes", flush=True)
    draw(options.output.with_suffix(".svg"), curve.rows, baselines)
    agents = " ".join(f"--agent {name}" for name in BASELINES)
    print(f"\ncavsumo run --net {options.net} --agent policy:{options.output} {agents} --runs 300")


if __name__ == "__main__":
    sys.exit(main())
