"""Closed vocabularies: words of a scenario that other modules give their meaning."""

from __future__ import annotations

from typing import Literal

# How a vehicle's way lies to the ego's: across it, into its lane, on its lane ahead of it, in a
# lane beside it.
ApproachType = Literal["crossing", "merging", "following", "adjacent"]
# What the ego meets at the first traffic light on its route.
Signal = Literal["any", "green", "red"]
