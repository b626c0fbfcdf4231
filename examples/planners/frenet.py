"""frenetix 0.4.0 (TU Munich, LGPL-3.0) as an ego.

    pip install frenetix==0.4.0        (Python below 3.13)
    cavsumo run --net networks/crossing.net.xml --ego "exec:python examples/planners/frenet.py"

In every timestep the cheapest feasible trajectory in the lane is followed. The package has no check
of collisions: their probability is one of the costs.
"""

import math
from functools import partial

from common import brake, follow, package, serve

ENDS_S, SPEEDS, OFFSETS = (1.1, 2.0, 3.0, 4.0), 9, 3  # samples of a trajectory's end
SPREAD_M = 0.3  # standard deviation of a predicted place
LOW = 2.0  # below this speed lateral motion is planned over the way [m/s]
WEIGHTS = {"jerk": 0.2, "offset": 5.0, "speed": 1.0, "risk": 10000.0}
HARD = -8.0  # braking when no trajectory is feasible [m/s2]
PIP = "frenetix==0.4.0"


def begin(fx, np, road):
    """A planner for one episode; `fx` is the package, `np` numpy."""
    course = fx.CoordinateSystemWrapper(np.array(road.points))
    base, room = road.ego.wheelbase_m, (road.width - road.ego.width_m) / 2

    def plan(seen):
        motion = seen.speed, seen.acceleration, seen.steering
        state = fx.CartesianPlannerState(np.array(seen.rear), seen.heading, *motion)
        low, fastest = seen.speed < LOW, max(seen.speed_limit, seen.speed)
        now = fx.compute_initial_state(course, state, base, low)
        ends = [
            [0.0, end, *now.x0_lon, speed, 0.0, *now.x0_lat, offset, 0.0, 0.0]
            for end in ENDS_S
            for speed in np.linspace(0.0, fastest, SPEEDS)
            for offset in np.linspace(-room, room, OFFSETS)
        ]
        handler = functions(fx, np, seen, course, low)
        handler.generate_trajectories(np.array(ends), low)
        handler.evaluate_all_current_functions(True)
        for best in handler.get_sorted_trajectories():  # the cheapest first
            if best.feasible and best.valid:
                way, times = best.cartesian, np.arange(len(best.cartesian.x)) * road.dt
                return follow(seen, times, way.x, way.y, way.v)
        return brake(seen, HARD)

    return plan


def functions(fx, np, seen, course, low):
    """The trajectory handler with the limits of the ego and the costs of this moment."""
    ego, parts = seen.road.ego, fx.trajectory_functions
    limits, costs, w = parts.feasability_functions, parts.cost_functions, WEIGHTS
    bodies = {b.number: predicted(fx, np, b, seen.road.dt) for b in seen.obstacles}
    size = ego.length_m, ego.width_m, ego.wheelbase_m / 2
    made, most = fx.TrajectoryHandler(seen.road.dt), (ego.steering_max_rad, ego.wheelbase_m)
    made.add_feasability_function(limits.CheckAccelerationConstraint(50.0, 9.0, True))
    made.add_feasability_function(limits.CheckCurvatureConstraint(*most, True))
    made.add_function(parts.FillCoordinates(low, seen.heading, course, ENDS_S[-1]))
    made.add_cost_function(costs.CalculateLongitudinalJerkCost("jerk", w["jerk"]))
    made.add_cost_function(costs.CalculateDistanceToReferencePathCost("offset", w["offset"]))
    wanted, risk = (seen.speed_limit, seen.road.dt, ENDS_S[0], False, 2), (bodies, *size)
    made.add_cost_function(costs.CalculateVelocityOffsetCost("speed", w["speed"], *wanted))
    made.add_cost_function(costs.CalculateCollisionProbabilityFast("risk", w["risk"], *risk))
    return made


def predicted(fx, np, body, dt):
    """The places of a body that keeps its velocity, from the next timestep on."""
    half, spread = body.heading / 2, np.asfortranarray(np.eye(6) * SPREAD_M**2)
    turned = np.array([0.0, 0.0, math.sin(half), math.cos(half)])
    places = [np.array([*body.at(i * dt), 0.0]) for i in range(1, int(ENDS_S[-1] / dt) + 2)]
    path = [fx.PoseWithCovariance(place, turned, spread) for place in places]
    return fx.PredictedObject(body.number, path, body.length, body.width)


if __name__ == "__main__":
    serve(partial(begin, package("frenetix", PIP), package("numpy", PIP)))
