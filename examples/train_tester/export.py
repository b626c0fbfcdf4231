"""From a DQN of stable-baselines3 to a policy file that needs no torch."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3 import DQN
from stable_baselines3.common.vec_env import VecNormalize

from cavsumo.observations import VERSION, entries
from cavsumo.policies import Header, Observed, Policy

CONSTANT = 1e-6  # variance below which an entry never changed in training


def exported(model: DQN, normaliser: VecNormalize, hold: int, metadata: dict[str, Any]) -> Policy:
    """The greedy policy of a network that scores the targets of one pedestrian.

    An entry that never changed in training (as those of other testers, where there were none) is
    scaled to nothing, because the network has not learned what to make of it.
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
    scale = np.where(seen.var < CONSTANT, 1e9, np.sqrt(seen.var + normaliser.epsilon))
    return Policy(header, seen.mean.astype(np.float64), scale, tuple(numbers))


def _array(tensor: Any) -> np.ndarray[Any, Any]:
    """A tensor of torch as numbers in float64, rows one after another."""
    return np.ascontiguousarray(tensor.detach().cpu().numpy().astype(np.float64))
