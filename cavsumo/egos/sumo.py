"""An ego driven by SUMO, with any car-following model and any attribute of a vehicle type."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, ClassVar

from cavsumo.egos.base import EGO_KIND, EGOS, Ego
from cavsumo.egos.vtype_attributes import check_attributes
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.checks import number

# Car-following models of SUMO 1.28 (same page, "Car-Following Models").
MODELS = frozenset(
    """Krauss KraussOrig1 KraussPS KraussX IDM IDMM EIDM ACC CACC CC Wiedemann W99 Rail BKerner
    PWagner2009 SmartSK Daniel1""".split()
)
REACTION_S = 1.0


@EGOS.register("sumo")
class SumoEgo(Ego):
    """Driven by SUMO; by default its Krauss driver with a reaction time (reaction_s 1.0).

    SUMO's own default driver reacts within one timestep and brakes with exactly the deceleration
    that the stopping zones assume; ``reaction_s=0`` selects it.
    """

    name = "sumo"
    sees_background = False

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "carFollowModel": "car-following model: Krauss, IDM, EIDM, ACC, CACC, Wiedemann, ...",
        "reaction_s": "time between two decisions of the driver [s]; 0 for every timestep, "
        f"{REACTION_S} if not given (SUMO's actionStepLength)",
        "attributes": "any other attribute of a SUMO vType, such as decel, tau, sigma, length",
    }

    def __init__(
        self,
        carFollowModel: str = "Krauss",
        reaction_s: float | None = None,
        **attributes: Any,
    ) -> None:
        _check(self.name, carFollowModel, attributes)
        self.kind = dataclasses.replace(
            EGO_KIND,
            length=number("length", attributes.pop("length", EGO_KIND.length), 0.1, 30.0),
            width=number("width", attributes.pop("width", EGO_KIND.width), 0.1, 5.0),
        )
        reaction = _reaction(self.name, reaction_s, attributes.pop("actionStepLength", None))
        self.attributes = {"carFollowModel": carFollowModel, **attributes}
        self.decides_every_s = reaction
        if reaction:
            self.attributes["actionStepLength"] = reaction

    def vtype(self) -> dict[str, str]:
        return super().vtype() | {name: str(value) for name, value in self.attributes.items()}


def _check(ego: str, model: str, attributes: Mapping[str, Any]) -> None:
    """Refuse models and attributes that SUMO has not, and numbers that are not finite."""
    if model not in MODELS:
        raise UnknownName("car-following model", str(model), MODELS, f"ego {ego}")
    check_attributes(attributes, f"ego {ego}")
    for name, value in attributes.items():
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError(f"ego {ego}: {name} must be finite, got {value}")


def _reaction(ego: str, reaction_s: float | None, action_step: float | None) -> float:
    """The time between two decisions, by either of its two names [s]."""
    if reaction_s is not None and action_step is not None:
        raise InputError(
            f"ego {ego}: reaction_s and actionStepLength are the same time; expected one of them"
        )
    if action_step is not None:
        return number("actionStepLength", action_step, 0.0, 10.0)
    return number("reaction_s", REACTION_S if reaction_s is None else reaction_s, 0.0, 10.0)
