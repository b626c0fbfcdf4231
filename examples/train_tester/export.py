"""From a DQN of stable-baselines3 to a policy file that needs no torch."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3 import DQN
from stable_baselines3.common.vec_env import VecNormalize

from cavsumo.agents.observations import VERSION, entries
from cavsumo.agents.policy_file import Header, Observed, TrainedPolicy

NOTHING = 1e9  # a scale that leaves nothing of an entry


def exported(
    model: DQN, normaliser: VecNormalize, hold: int, metadata: dict[str, Any]
) -> TrainedPolicy:
    """The greedy policy of a network that scores the targets of one pedestrian.

    Where one pedestrian learned, there was no other, and the network has not learned what to make
    of what others do: those entries are scaled to nothing.
    """
    network = model.q_net.q_net
    layers = [layer for layer in network if hasattr(layer, "weight")]
    numbers = [(_array(layer.weight).T, _array(layer.bias)) for layer in layers]
    seen = normaliser.obs_rms
    names = tuple(name for name, _, _ in entries(1, 1.0, 1.0))
    header = Header(
        observation=Observed(version=VERSION, names=names),
        hold=hold,
        activation="relu",
        clip=normaliser.clip_obs,
        actions="targets",
        metadata=metadata,
    )
    absent = np.array([name.startswith("other.") for name in names])
    scale = np.where(absent, NOTHING, np.sqrt(seen.var + normaliser.epsilon))
    return TrainedPolicy(header, seen.mean.astype(np.float64), scale, tuple(numbers))


def _array(tensor: Any) -> np.ndarray[Any, Any]:
    """A tensor of torch as numbers in float64, rows one after another."""
    return np.ascontiguousarray(tensor.detach().cpu().numpy().astype(np.float64))
