"""An ego driven by SUMO, with any car-following model and any attribute of a vehicle type."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, ClassVar

from cavsumo.egos.base import EGO_KIND, EGOS, Ego
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.checks import number

# Attributes of vType in SUMO 1.28 (its documentation, "Definition of Vehicles, Vehicle Types, and
# Routes"); SUMO itself ignores unknown ones without a word.
VTYPE_ATTRIBUTES = frozenset(
    """accel decel apparentDecel emergencyDecel maxSpeed speedFactor speedDev desiredMaxSpeed
    length width height minGap minGapLat sigma tau actionStepLength carFollowModel laneChangeModel
    startupDelay stepping impatience emissionClass boardingDuration loadingDuration mass
    lcStrategic lcCooperative lcSpeedGain lcKeepRight lcOvertakeRight lcOpposite lcSublane
    lcPushy lcPushyGap lcAssertive lcImpatience lcTimeToImpatience lcAccelLat lcLookaheadLeft
    lcSpeedGainRight lcSpeedGainLookahead lcSpeedGainRemainTime lcMaxSpeedLatStanding
    lcMaxSpeedLatFactor lcLaneDiscipline lcSigma lcContRight lcOvertakeDeltaSpeedFactor
    maxSpeedLat latAlignment timeToTeleport timeToTeleportBidi
    jmCrossingGap jmIgnoreKeepClearTime jmDriveAfterYellowTime jmDriveAfterRedTime jmDriveRedSpeed
    jmIgnoreFoeProb jmIgnoreFoeSpeed jmIgnoreJunctionFoeProb jmSigmaMinor jmStoplineGap
    jmStoplineGapMinor jmStoplineCrossingGap jmTimegapMinor jmExtraGap jmAdvance jmStopSignWait
    jmAllwayStopWait
    k phi delta stepping collisionAvoidanceOverride adaptFactor adaptTime security estimation
    tmp1 tmp2 tmp3 tmp4 tmp5 tpreview tPreview ccaccel coolness maxAccProfile desAccProfile
    speedControlGain gapClosingControlGainSpeed gapClosingControlGainSpace
    gapControlGainSpeed gapControlGainSpace collisionAvoidanceGainSpeed
    collisionAvoidanceGainSpace speedControlGainCACC gapClosingControlGainGap
    gapClosingControlGainGapDot gapControlGainGap gapControlGainGapDot
    collisionAvoidanceGainGap collisionAvoidanceGainGapDot headwayTimeCACCToACC
    cc1 cc2 cc3 cc4 cc5 cc6 cc7 cc8 cc9 sigmaleader sigmagap sigmaerror
    vClass guiShape color personCapacity containerCapacity""".split()
)


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
        for name, value in attributes.items():
            if name not in VTYPE_ATTRIBUTES:
                raise UnknownName("attribute of a SUMO vType", name, VTYPE_ATTRIBUTES, "ego sumo")
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
