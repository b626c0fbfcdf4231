"""An ego driven by SUMO, with any car-following model and any attribute of a vehicle type."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, ClassVar

from cavsumo.egos.base import EGO_KIND, EGOS, Ego
from cavsumo.egos.vtype_attributes import check_attributes
from cavsumo.errors import InputError
from cavsumo.model.checks import number


@EGOS.register("sumo")
class SumoEgo(Ego):
    """Driven by SUMO; by default its Krauss driver with a reaction time (actionStepLength 1.0).

    SUMO's own default driver reacts within one timestep and brakes with exactly the deceleration
    that the stopping zones assume; ``actionStepLength=0`` selects it.
    """

    sees_background = False

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "carFollowModel": "car-following model: Krauss, IDM, EIDM, ACC, CACC, Wiedemann, ...",
        "actionStepLength": "time between two decisions of the driver [s]; 0 for every timestep",
        "attributes": "any other attribute of a SUMO vType, such as decel, tau, sigma, length",
    }

    def __init__(
        self, carFollowModel: str = "Krauss", actionStepLength: float = 1.0, **attributes: Any
    ) -> None:
        check_attributes(attributes)
        for name, value in attributes.items():
            if isinstance(value, float) and not math.isfinite(value):
                raise InputError(f"ego sumo: {name} must be finite, got {value}")
        self.kind = dataclasses.replace(
            EGO_KIND,
            length=number("length", attributes.pop("length", EGO_KIND.length), 0.1, 30.0),
            width=number("width", attributes.pop("width", EGO_KIND.width), 0.1, 5.0),
        )
        delay = number("actionStepLength", actionStepLength, 0.0, 10.0)
        self.attributes = {"carFollowModel": carFollowModel, **attributes}
        if delay:
            self.attributes["actionStepLength"] = delay

    def vtype(self) -> dict[str, str]:
        return super().vtype() | {name: str(value) for name, value in self.attributes.items()}
