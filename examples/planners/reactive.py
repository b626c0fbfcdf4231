"""commonroad-reactive-planner 2025.1 (TU Munich, BSD-3-Clause) as an ego.

    pip install commonroad-reactive-planner==2025.1        (Python below 3.12)
    cavsumo run --net networks/crossing.net.xml --ego-param reply_s=10 \\
        --ego "exec:python examples/planners/reactive.py"

It plans for the rear axle, within the lane, past bodies that keep their velocity, and a plan is
followed for three timesteps.
"""

from functools import partial

from common import brake, follow, package, serve

STEPS, EVERY = 40, 3  # timesteps of a plan, and from one plan to the next
HARD = -8.0  # braking when there is no plan [m/s2]
PIP = "commonroad-reactive-planner==2025.1"


def begin(rp, np, road):
    """A planner for one episode; `rp` is the package's module of the planner, `np` numpy."""
    planner = rp.ReactivePlanner(configuration(rp, road))
    courses = package("commonroad_rp.utility.utils_coordinate_system", PIP)
    course = courses.create_coordinate_system(np.array(road.points))
    planner.set_reference_path(coordinate_system=course)
    made = []  # the states of the plan that is followed, from the present one on

    def plan(seen):
        if seen.step % EVERY == 0 or not made:
            turn = seen.speed * np.tan(seen.steering) / road.ego.wheelbase_m
            state = {"position": np.array(seen.rear), "velocity": seen.speed, "yaw_rate": turn}
            state |= {"orientation": seen.heading, "acceleration": seen.acceleration}
            state |= {"steering_angle": seen.steering, "time_step": 0}
            planner.reset(
                initial_state_cart=rp.ReactivePlannerState(**state),
                collision_checker=checker(rp.pycrcc, seen),
                coordinate_system=course,
            )
            planner.set_desired_velocity(seen.speed_limit, max(seen.speed, 0.01))
            try:
                found = planner.plan()
            except TypeError:  # 2025.1 prints a cost that it has not, when it stands and finds none
                found = None
            made[:] = [(*s.position, s.velocity) for s in found[0].state_list] if found else []
        if len(made) < 2:
            return brake(seen, HARD)
        answer = follow(seen, [i * road.dt for i in range(len(made))], *zip(*made, strict=True))
        del made[0]
        return answer

    return plan


def configuration(rp, road):
    """The planner's settings: its defaults, the ego's body, the room in the lane, no map."""
    config, ego = rp.ReactivePlannerConfiguration(), road.ego
    config.planning.dt, config.planning.time_steps_computation = road.dt, STEPS
    config.debug.multiproc, config.debug.logging_level = False, "ERROR"
    size, axles = (ego.length_m, ego.width_m), (ego.wheelbase_m / 2, ego.wheelbase_m / 2)
    config.vehicle = rp.VehicleConfiguration(2, *size, *axles)
    config.sampling.d_max = (road.width - ego.width_m) / 2
    config.sampling.d_min = -config.sampling.d_max
    config.update(scenario=rp.Scenario(road.dt))
    return config


def checker(pycrcc, seen):
    """The bodies where they will be if they keep their velocity."""
    made = pycrcc.CollisionChecker()
    for body in seen.obstacles:
        moving, size = pycrcc.TimeVariantCollisionObject(0), (body.length / 2, body.width / 2)
        for seconds in (i * seen.road.dt for i in range(STEPS + 1)):
            moving.append_obstacle(pycrcc.RectOBB(*size, body.heading, *body.at(seconds)))
        made.add_collision_object(moving)
    return made


if __name__ == "__main__":
    serve(partial(begin, package("commonroad_rp.reactive_planner", PIP), package("numpy", PIP)))
