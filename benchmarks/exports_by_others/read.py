"""Reads CommonRoad files by commonroad-io and prints what is found, as JSON.

Of each file: is it valid by the schema, when do the occupancies of others first overlap that of the
first obstacle, and with which does the collision checker of commonroad-drivability-checker find a
collision (null where that is not installed)?
"""

import json
import sys
from pathlib import Path

import commonroad
from commonroad.common.file_reader import CommonRoadFileReader
from lxml import etree

try:
    from commonroad_dc.collision.collision_detection.pycrcc_collision_dispatch import (
        create_collision_object,
    )
except ImportError:
    create_collision_object = None


def occupied(body, step):
    """The area of an obstacle; None where it is not there. The classes differ between versions."""
    there = body.occupancy_at_time(step)
    return None if there is None else getattr(there, "shape", there).shapely_object


def hits(ego, others):
    """The steps at which obstacles first overlap the ego, by their ids."""
    found = {}
    for other in others:
        for step in range(ego.prediction.final_time_step + 1):
            there = occupied(other, step)
            if there is not None and occupied(ego, step).intersects(there):
                found[other.obstacle_id] = step
                break
    return found


def read(file, schema):
    """The findings of a file."""
    scenario, problems = CommonRoadFileReader(file).open()
    ego, *others = sorted(scenario.dynamic_obstacles, key=lambda body: body.obstacle_id)
    said = None
    if create_collision_object is not None:
        own = create_collision_object(ego)
        said = [o.obstacle_id for o in others if own.collide(create_collision_object(o))]
    return {
        "valid": bool(schema.validate(etree.parse(file))),
        "hits": hits(ego, others),
        "checker": said,
        "lanelets": len(scenario.lanelet_network.lanelets),
        "problems": len(problems.planning_problem_dict),
    }


schema_file = next(Path(commonroad.__file__).parent.rglob("XML_commonRoad_XSD.xsd"))
the_schema = etree.XMLSchema(etree.parse(str(schema_file)))
print(json.dumps([read(file, the_schema) for file in sys.argv[1:]]))
