"""The attributes of a SUMO vType, which an ego that SUMO drives may have."""

from __future__ import annotations

from collections.abc import Iterable

from cavsumo.errors import UnknownName

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


def check_attributes(names: Iterable[str]) -> None:
    """Raise UnknownName for a name that no attribute has."""
    for name in names:
        if name not in VTYPE_ATTRIBUTES:
            raise UnknownName("attribute of a SUMO vType", name, VTYPE_ATTRIBUTES, "ego sumo")
