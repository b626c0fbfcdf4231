"""A careful driver as a program of its own: it speaks the protocol of docs/ego-protocol.md.

    cavsumo run --net networks/crossing.net.xml --ego "exec:python3 stop_for_pedestrians.py"

or, as a server that serves any number of connections,

    python3 stop_for_pedestrians.py --port 5000 &
    cavsumo run --net networks/crossing.net.xml --ego tcp:127.0.0.1:5000

It needs Python's standard library only and keeps to its route: it answers with accelerations. The
whole policy is `acceleration`, a function of plain numbers. Every hazard ahead is a place where the
ego must be able to stop: a body in the strip that the ego will sweep, a pedestrian that walks
towards the strip, a red light. The allowed speed is the highest from which it can stop there
comfortably after a reaction time (the safe speed of Krauss, 1998); when that is suddenly much lower
than its speed, because a pedestrian stepped out, it brakes as hard as necessary.
"""

import argparse
import itertools
import json
import math
import socketserver
import sys

SPEED = 8.33  # speed wanted [m/s]
ACCELERATION = 1.5  # [m/s2]
BRAKING = 3.0  # comfortable [m/s2]
HARD_BRAKING = 8.0  # what it takes others to be able to do, and itself at a yellow light [m/s2]
REACTION = 0.3  # [s]
STANDOFF = 2.0  # left free ahead when standing [m]
MARGIN = 0.5  # watched beside its own width [m]
FORESIGHT = 2.0  # how far ahead walkers are foreseen [s]
SIGHT = 80.0  # [m]
WALKERS = ("pedestrian", "bicycle")
BODY = ("kind", "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m")


class Path:
    """The centre line of the route: where is a point along it, and how far beside it?"""

    def __init__(self, points):
        self.segments = []  # x, y, direction, length, arc length at its beginning
        start = 0.0
        for (x0, y0), (x1, y1) in itertools.pairwise(points):
            dx, dy = x1 - x0, y1 - y0
            length = math.sqrt(dx * dx + dy * dy)
            if length > 0.0:
                self.segments.append((x0, y0, dx / length, dy / length, length, start))
                start += length

    def locate(self, x, y):
        """Arc length, distance to the left [m] and direction (unit vector) at the nearest point."""
        nearest, found = math.inf, None
        for x0, y0, ux, uy, length, start in self.segments:
            dx, dy = x - x0, y - y0
            t = min(length, max(0.0, dx * ux + dy * uy))
            ex, ey = dx - t * ux, dy - t * uy
            square = ex * ex + ey * ey
            if square < nearest:
                nearest, found = square, (start + t, ux * dy - uy * dx, ux, uy)
        return found


def acceleration(path, constants, speed, along, x, y, light, bodies):
    """The acceleration for the next timestep [m/s2].

    path: the route. constants: timestep, length and width of the ego, its limits of acceleration.
    speed, along, x, y: of the ego's centre. light: None, or distance of its stop line from the
    front bumper and state. bodies: (kind, x, y, heading, speed, length, width) of everybody else.
    """
    dt, length, width, lowest, highest = constants
    allowed = SPEED
    if light is not None and must_stop_at(light[1], light[0], speed):
        allowed = min(allowed, safe_speed(light[0] - 1.0))
    front = along + length / 2.0
    for body in bodies:
        if abs(body[1] - x) <= SIGHT and abs(body[2] - y) <= SIGHT:
            room = stopping_room(path, body, front, length, width)
            if room is not None:
                allowed = min(allowed, safe_speed(room - STANDOFF))
    wanted = (min(allowed, speed + ACCELERATION * dt) - speed) / dt
    return min(highest, max(lowest, wanted))


def must_stop_at(state, distance, speed):
    """Whether a traffic light forbids to go on, and there is room to stop before it."""
    if state == "red":
        return speed * speed <= 2.0 * HARD_BRAKING * distance
    if state in ("yellow", "red-yellow", "stop"):
        return speed * speed <= 2.0 * BRAKING * distance
    return False


def stopping_room(path, body, front, length, width):
    """The way until the ego would touch somebody who brakes at once [m]; None if never."""
    kind, x, y, heading, speed, body_length, body_width = body
    along, left, ux, uy = path.locate(x, y)
    cos = math.cos(heading) * ux + math.sin(heading) * uy  # of the angle between it and the path
    sin = math.sin(heading) * ux - math.cos(heading) * uy
    half_along = (body_length * abs(cos) + body_width * abs(sin)) / 2.0
    half_across = (body_length * abs(sin) + body_width * abs(cos)) / 2.0
    gap = along - half_along - front
    if gap < -length:
        return None  # behind
    beside = abs(left) - half_across - width / 2.0  # free between it and the ego's strip
    towards = -speed * sin if left > 0.0 else speed * sin  # how fast it comes nearer
    foresight = FORESIGHT if kind in WALKERS else 0.0
    if beside - MARGIN > max(0.0, towards) * foresight:
        return None
    if gap < -length / 2.0 and beside > 0.0:
        return None  # beside the rear half: too late to matter
    ahead = max(0.0, speed * cos)
    return gap + ahead * ahead / (2.0 * HARD_BRAKING)


def safe_speed(room):
    """The highest speed from which it comes to stand within some room [m/s]."""
    if room <= 0.0:
        return 0.0
    lost = BRAKING * REACTION
    return math.sqrt(lost * lost + 2.0 * BRAKING * room) - lost


class Driver:
    """One conversation: answers message by message."""

    def answer(self, message):
        """The reply to a message, None to the last one."""
        kind = message["type"]
        if kind == "hello":
            self.begin(message)
            return {"type": "hello", "version": 1}
        if kind == "reset":  # nothing is kept from one episode to the next
            return {"type": "ready"}
        if kind == "observation":
            return {"step": message["step"], "acceleration": self.decide(message)}
        return None

    def begin(self, hello):
        """Take up the constants of the scenario."""
        if hello["version"] != 1:
            raise SystemExit(f"this driver speaks version 1, not {hello['version']}")
        ego = hello["ego"]
        self.path = Path(hello["route"]["points_m"])
        self.constants = (
            hello["timestep_s"],
            ego["length_m"],
            ego["width_m"],
            ego["acceleration_min_mps2"],
            ego["acceleration_max_mps2"],
        )

    def decide(self, seen):
        """The acceleration that answers an observation [m/s2]."""
        ego, light = seen["ego"], seen["traffic_light"]
        bodies = [[body[key] for key in BODY] for body in seen["bodies"]]
        return acceleration(
            self.path,
            self.constants,
            ego["speed_mps"],
            ego["along_m"],
            ego["x_m"],
            ego["y_m"],
            light and (light["distance_m"], light["state"]),
            bodies,
        )


def converse(lines, write):
    """Answer line by line until the end."""
    driver = Driver()
    for line in lines:
        reply = driver.answer(json.loads(line))
        if reply is None:
            return
        write(json.dumps(reply) + "\n")


class Connection(socketserver.StreamRequestHandler):
    """One connection of the server, in a thread of its own."""

    disable_nagle_algorithm = True

    def handle(self):
        converse(self.rfile, lambda text: self.wfile.write(text.encode()))


class Server(socketserver.ThreadingTCPServer):
    daemon_threads = allow_reuse_address = True


def main():
    parser = argparse.ArgumentParser(description="An ego that stops for pedestrians.")
    parser.add_argument("--port", type=int, help="listen there, on this machine only; 0 for any")
    options = parser.parse_args()
    if options.port is None:
        # A line is passed on at once: sys.stdout keeps what goes into a pipe until it has more.
        converse(sys.stdin, lambda text: print(text, end="", flush=True))
        return
    with Server(("127.0.0.1", options.port), Connection) as server:
        print(f"listening on port {server.server_address[1]}", flush=True)
        server.serve_forever()


if __name__ == "__main__":
    main()
