"""The scenario record: everything that defines a test, validated.

``record`` says what is simulated, ``plan`` how often and with which agents. ``parsing`` makes a
plan of flat settings; ``fields`` lists the settings for command line, environments and docs.
To add a setting: a field in ``record`` or ``plan``; nothing else has to be touched.
"""

from cavsumo.model.scenario.params import Params, qualified
from cavsumo.model.scenario.parsing import (
    PLAN_KEYS,
    SCENARIO_KEYS,
    SENSOR_KEYS,
    check_keys,
    check_teams,
    plan_from,
)
from cavsumo.model.scenario.plan import (
    NO_REFERENCE,
    BatchPlan,
    half_width,
    part_of,
)
from cavsumo.model.scenario.record import Scenario

__all__ = [
    "NO_REFERENCE",
    "PLAN_KEYS",
    "SCENARIO_KEYS",
    "SENSOR_KEYS",
    "BatchPlan",
    "Params",
    "Scenario",
    "check_keys",
    "check_teams",
    "half_width",
    "part_of",
    "plan_from",
    "qualified",
]
