/* A careful driver as a program of its own, the C twin of stop_for_pedestrians.py.

       cc -O2 -o stop_for_pedestrians stop_for_pedestrians.c -lm
       cavsumo run --net networks/crossing.net.xml --ego exec:./stop_for_pedestrians

   It speaks the protocol of docs/ego-protocol.md over stdin and stdout and needs the C library
   only. The policy is in acceleration(), explained in the Python twin; the first half of the file
   reads just as much JSON as that takes. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* JSON: find values in a text, without building anything ---------------------------------------- */

static void fail(const char *why) {
    fprintf(stderr, "stop_for_pedestrians: %s\n", why);
    exit(1);
}

static const char *skip_space(const char *p) {
    return p + strspn(p, " \t\r\n");
}

/* Behind the string that begins at a quotation mark. */
static const char *skip_string(const char *p) {
    for (p++; *p && *p != '"'; p++)
        if (*p == '\\' && p[1]) p++;
    if (!*p) fail("a string without an end");
    return p + 1;
}

/* Behind the value that begins here. */
static const char *skip_value(const char *p) {
    int depth = 0;
    do {
        p = skip_space(p);
        if (!*p) fail("a value without an end");
        if (*p == '"') {
            p = skip_string(p);
        } else if (strchr("{[", *p)) {
            depth++, p++;
        } else if (strchr("}]", *p)) {
            depth--, p++;
        } else if (strchr(",:", *p)) {
            p++;
        } else {
            p += strcspn(p, " \t\r\n,:{}[]\"");
        }
    } while (depth > 0);
    return p;
}

/* The value of a key of the object that begins here, NULL if there is none. */
static const char *member(const char *object, const char *key) {
    const char *p = skip_space(object);
    size_t n = strlen(key);
    if (*p != '{') return NULL;
    p = skip_space(p + 1);
    while (*p == '"') {
        const char *name = p + 1;
        p = skip_string(p);
        int found = (size_t)(p - 1 - name) == n && strncmp(name, key, n) == 0;
        p = skip_space(p);
        if (*p != ':') fail("a key without a value");
        p = skip_space(p + 1);
        if (found) return p;
        p = skip_space(skip_value(p));
        if (*p == ',') p = skip_space(p + 1);
    }
    return NULL;
}

/* The value of a key that must be there. */
static const char *need(const char *object, const char *key) {
    const char *value = member(object, key);
    if (!value) {
        fprintf(stderr, "stop_for_pedestrians: a message without %s\n", key);
        exit(1);
    }
    return value;
}

/* strtod reads the very number that was written. */
static double number(const char *object, const char *key) {
    return strtod(need(object, key), NULL);
}

/* The first value of an array, or the one behind another; NULL at the end. */
static const char *first(const char *array) {
    const char *p = skip_space(array);
    if (*p != '[') fail("expected an array");
    p = skip_space(p + 1);
    return *p == ']' ? NULL : p;
}

static const char *next(const char *value) {
    const char *p = skip_space(skip_value(value));
    return *p == ',' ? skip_space(p + 1) : NULL;
}

/* Whether a value is just this string (without escapes, as the words of the protocol are). */
static int is(const char *value, const char *word) {
    size_t n = strlen(word);
    return value[0] == '"' && strncmp(value + 1, word, n) == 0 && value[n + 1] == '"';
}

/* The driver ------------------------------------------------------------------------------------ */

static const double SPEED = 8.33, ACCELERATION = 1.5, BRAKING = 3.0, HARD_BRAKING = 8.0;
static const double REACTION = 0.3, STANDOFF = 2.0, MARGIN = 0.5, FORESIGHT = 2.0, SIGHT = 80.0;

struct segment {
    double x, y, ux, uy, length, start;
};

static struct segment *segments;
static int n_segments;
static double dt, ego_length, ego_width, lowest, highest;

static double smaller(double a, double b) { return b < a ? b : a; }
static double larger(double a, double b) { return b > a ? b : a; }

/* Take up the constants of the scenario. */
static void begin(const char *hello) {
    if (number(hello, "version") != 1.0) fail("speaks version 1 of the protocol only");
    const char *ego = need(hello, "ego"), *point;
    dt = number(hello, "timestep_s");
    ego_length = number(ego, "length_m");
    ego_width = number(ego, "width_m");
    lowest = number(ego, "acceleration_min_mps2");
    highest = number(ego, "acceleration_max_mps2");
    double x0 = 0.0, y0 = 0.0, start = 0.0;
    int n = 0;
    n_segments = 0;
    for (point = first(need(need(hello, "route"), "points_m")); point; point = next(point), n++) {
        const char *at = first(point);
        double x = strtod(at, NULL), y = strtod(next(at), NULL);
        double dx = x - x0, dy = y - y0, length = sqrt(dx * dx + dy * dy);
        if (n > 0 && length > 0.0) {
            segments = realloc(segments, (n_segments + 1) * sizeof *segments);
            if (!segments) fail("no memory");
            struct segment s = {x0, y0, dx / length, dy / length, length, start};
            segments[n_segments++] = s;
            start += length;
        }
        x0 = x, y0 = y;
    }
    if (!n_segments) fail("a route without points");
}

/* The highest speed from which it comes to stand within some room [m/s]. */
static double safe_speed(double room) {
    double lost = BRAKING * REACTION;
    return room <= 0.0 ? 0.0 : sqrt(lost * lost + 2.0 * BRAKING * room) - lost;
}

/* Whether a traffic light forbids to go on, and there is room to stop before it. */
static int must_stop_at(const char *state, double distance, double speed) {
    if (is(state, "red")) return speed * speed <= 2.0 * HARD_BRAKING * distance;
    if (is(state, "yellow") || is(state, "red-yellow") || is(state, "stop"))
        return speed * speed <= 2.0 * BRAKING * distance;
    return 0;
}

/* The way until the ego would touch somebody who brakes at once [m]; infinite if never. */
static double stopping_room(const char *body, double x, double y, double front) {
    double heading = number(body, "heading_rad"), speed = number(body, "speed_mps");
    double length = number(body, "length_m"), width = number(body, "width_m");
    double nearest = INFINITY, along = 0.0, left = 0.0, ux = 1.0, uy = 0.0;
    for (int i = 0; i < n_segments; i++) {
        const struct segment *s = &segments[i];
        double dx = x - s->x, dy = y - s->y;
        double t = smaller(s->length, larger(0.0, dx * s->ux + dy * s->uy));
        double ex = dx - t * s->ux, ey = dy - t * s->uy, square = ex * ex + ey * ey;
        if (square < nearest) {
            nearest = square, along = s->start + t, left = s->ux * dy - s->uy * dx;
            ux = s->ux, uy = s->uy;
        }
    }
    double c = cos(heading) * ux + sin(heading) * uy, s = sin(heading) * ux - cos(heading) * uy;
    double half_along = (length * fabs(c) + width * fabs(s)) / 2.0;
    double half_across = (length * fabs(s) + width * fabs(c)) / 2.0;
    double gap = along - half_along - front;
    if (gap < -ego_length) return INFINITY;
    double beside = fabs(left) - half_across - ego_width / 2.0;
    double towards = left > 0.0 ? -speed * s : speed * s;
    const char *kind = need(body, "kind");
    double foresight = is(kind, "pedestrian") || is(kind, "bicycle") ? FORESIGHT : 0.0;
    if (beside - MARGIN > larger(0.0, towards) * foresight) return INFINITY;
    if (gap < -ego_length / 2.0 && beside > 0.0) return INFINITY;
    double ahead = larger(0.0, speed * c);
    return gap + ahead * ahead / (2.0 * HARD_BRAKING);
}

/* What to do now [m/s2]. */
static double acceleration(const char *seen) {
    const char *ego = need(seen, "ego"), *light = need(seen, "traffic_light"), *body;
    double speed = number(ego, "speed_mps"), front = number(ego, "along_m") + ego_length / 2.0;
    double x = number(ego, "x_m"), y = number(ego, "y_m"), allowed = SPEED;
    if (*light == '{') {
        double distance = number(light, "distance_m");
        if (must_stop_at(need(light, "state"), distance, speed))
            allowed = smaller(allowed, safe_speed(distance - 1.0));
    }
    for (body = first(need(seen, "bodies")); body; body = next(body)) {
        double bx = number(body, "x_m"), by = number(body, "y_m");
        if (fabs(bx - x) <= SIGHT && fabs(by - y) <= SIGHT) {
            double room = stopping_room(body, bx, by, front);
            if (room < INFINITY) allowed = smaller(allowed, safe_speed(room - STANDOFF));
        }
    }
    double wanted = (smaller(allowed, speed + ACCELERATION * dt) - speed) / dt;
    return smaller(highest, larger(lowest, wanted));
}

int main(void) {
    char *line = NULL;
    size_t size = 0;
    while (getline(&line, &size, stdin) >= 0) {
        const char *type = need(line, "type");
        if (is(type, "hello")) {
            begin(line);
            printf("{\"type\": \"hello\", \"version\": 1}\n");
        } else if (is(type, "reset")) {
            printf("{\"type\": \"ready\"}\n");
        } else if (is(type, "observation")) {
            printf("{\"step\": %.0f, \"acceleration\": %.17g}\n", number(line, "step"),
                   acceleration(line));
        } else {
            break; /* close */
        }
        fflush(stdout); /* or the line waits here, and cavsumo for it */
    }
    return 0;
}
