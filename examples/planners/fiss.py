"""The four planners of fiss-planner 1.0.0 (Shuo Sun, Apache-2.0) as an ego.

    pip install fiss-planner==1.0.0
    cavsumo run --net networks/crossing.net.xml --ego "exec:python examples/planners/fiss.py fop"

The planners: fop, fop_plus, fiss, fiss_plus (default). Its `LocalPlanner` plans anew in every
timestep, within the lane; its own controller follows the plan.
"""

import sys
from functools import partial

from common import brake, drive, package, serve

HORIZON_S, STEP_S = 6.0, 0.1
HARD = -8.0  # braking where the planner wants an emergency stop [m/s2]


def begin(fp, road):
    """A planner for one episode; `fp` is the package."""
    vehicle, config = vehicle_of(fp, road.ego), fp.LocalPlannerConfig()
    config.planner = fp.make_config(sys.argv[1] if len(sys.argv) > 1 else "fiss_plus")
    config.path.num_left_lanes = config.path.num_right_lanes = 0
    config.path.lane_width = road.width
    planner = fp.LocalPlanner(config, vehicle)
    planner.set_reference_path(*zip(*road.points, strict=True))
    controller = fp.StanleyPidController(vehicle)

    def plan(seen):
        ego = fp.EgoState(seen.x, seen.y, seen.heading, seen.speed, seen.acceleration)
        others = [predicted(fp, body) for body in seen.obstacles]
        found = planner.step(seen.time, ego, others, seen.speed_limit)
        if found.emergency or not found.success:
            return brake(seen, HARD)
        command = controller.compute(ego, found.trajectory, seen.time)
        return drive(seen, command.accel, command.steer)

    return plan


def vehicle_of(fp, ego):
    """The ego's limits, in the planner's words."""
    vehicle = fp.VehicleParams()
    vehicle.length, vehicle.width, vehicle.wheelbase = ego.length_m, ego.width_m, ego.wheelbase_m
    vehicle.rear_axle_to_center = ego.wheelbase_m / 2
    vehicle.max_steer, vehicle.max_decel = ego.steering_max_rad, -ego.acceleration_min_mps2
    return vehicle


def predicted(fp, body):
    """A body that keeps its velocity."""
    place = body.x, body.y, body.heading, body.speed
    size = body.length, body.width
    return fp.predict_constant_velocity(body.number, *place, *size, HORIZON_S, STEP_S)


if __name__ == "__main__":
    serve(partial(begin, package("fiss_planner", "fiss-planner==1.0.0")))
