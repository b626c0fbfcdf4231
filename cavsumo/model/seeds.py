"""The seeds of a batch: that of each episode, and the generator of its starts."""

from __future__ import annotations

import numpy as np


def episode_seed(batch_seed: int, episode: int) -> int:
    """The seed of an episode: the same for every agent, so that agents meet the same starts."""
    words = np.random.SeedSequence((batch_seed, episode)).generate_state(1, np.uint32)
    return int(words[0])


def starts_generator(seed: int) -> np.random.Generator:
    """The generator of an episode's starts, the first of those from its seed."""
    return np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0])
