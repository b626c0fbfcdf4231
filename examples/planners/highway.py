"""The decisions of highway-env's IDM and MOBIL vehicles (Edouard Leurent, MIT) as an ego.

    pip install highway-env==1.12.1
    cavsumo run --net networks/crossing.net.xml --ego "exec:python examples/planners/highway.py"

In every timestep its road holds the bodies on the carriageway as they are, and its vehicle decides.
The road has the lane of the route alone, which the ego keeps: MOBIL has no lane to change to.
"""

from functools import partial
from types import SimpleNamespace

from common import accelerate, package, serve

PIP = "highway-env==1.12.1"


def begin(highway, road):
    """A driver for one episode; `highway` has the package's modules."""
    network, index = highway.road.RoadNetwork(), ("begin", "end", 0)
    network.add_lane(*index[:2], highway.lane.PolyLaneFixedWidth(road.points, road.width))

    def plan(seen):
        network.get_lane(index).speed_limit = seen.speed_limit
        place, limit = highway.road.Road(network, vehicles=[]), seen.speed_limit
        state = (seen.x, seen.y), seen.heading, seen.speed
        ego = highway.behavior.IDMVehicle(place, *state, index, limit)
        on_road = (body for body in seen.obstacles if body.on_carriageway)
        place.vehicles = [ego, *(vehicle(highway, place, body) for body in on_road)]
        ego.act()
        return accelerate(seen, float(ego.action["acceleration"]))

    return plan


def vehicle(highway, place, body):
    """A body as a vehicle of highway-env."""
    made = highway.kinematics.Vehicle(place, (body.x, body.y), body.heading, body.speed)
    made.LENGTH, made.WIDTH = body.length, body.width
    return made


def modules():
    """The modules of the package that are used, by the last part of their names."""
    names = "road.road", "road.lane", "vehicle.behavior", "vehicle.kinematics"
    found = {name.split(".")[1]: package(f"highway_env.{name}", PIP) for name in names}
    return SimpleNamespace(**found)


if __name__ == "__main__":
    serve(partial(begin, modules()))
