"""The sensor of an observer as a scenario describes it; ``model.sensors`` computes what it sees."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Finite = Annotated[float, Field(allow_inf_nan=False)]


class Sensor(BaseModel):
    """How an observer sees the others; as it is by default, everybody exactly and at once."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    range_m: Finite | None = Field(
        default=None,
        gt=0,
        description="how far it sees, to the centre of a body [m]; any distance if not given",
    )
    position_noise_m: Finite = Field(
        default=0.0, ge=0, le=100, description="standard deviation of x and of y [m]"
    )
    heading_noise_rad: Finite = Field(
        default=0.0, ge=0, le=math.pi, description="standard deviation of the orientation [rad]"
    )
    speed_noise_mps: Finite = Field(
        default=0.0, ge=0, le=100, description="standard deviation of the speed [m/s]"
    )
    delay_s: Finite = Field(default=0.0, ge=0, le=10, description="age of what it sees [s]")
    occlusion: bool = Field(default=False, description="whether vehicles hide who is behind them")

    @property
    def noise(self) -> tuple[float, float, float, float]:
        """The standard deviations of x, y, v and o."""
        position = self.position_noise_m
        return position, position, self.speed_noise_mps, self.heading_noise_rad
