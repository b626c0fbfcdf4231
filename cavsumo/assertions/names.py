"""The assertions that come with cavsumo: each name with the file that registers it."""

from cavsumo.model.names import Names

ASSERTION_NAMES = Names(
    "assertion",
    "cavsumo.assertions",
    {
        "collision": "collision",
        "drac": "criticality",
        "give-way": "give_way",
        "hard-braking": "hard_braking",
        "leaving-the-road": "leaving_the_road",
        "pet": "criticality",
        "reaction-zone": "reaction_zone",
        "red-light": "red_light",
        "rss": "rss",
        "speed-limit": "speed_limit",
        "standing": "standing",
        "stopping-distance": "stopping_distance",
        "ttc": "criticality",
        "two-second-gap": "two_second_gap",
    },
    {
        "drac": "most",
        "give-way": "kerb_m every",
        "hard-braking": "most at_all",
        "leaving-the-road": "tolerance_m",
        "pet": "least_s",
        "reaction-zone": "max_decel reaction_time clear_s",
        "red-light": "within_m amber",
        "rss": "rho a_max_accel b_min b_min_correct b_max a_lat_max_accel b_lat_min mu "
        "lateral_noise",
        "speed-limit": "share plus_mps",
        "standing": "most_s near_m",
        "stopping-distance": "wet grace_s braking",
        "ttc": "least_s",
        "two-second-gap": "gap_s wet grace_s from_mps",
    },
)


def is_formula(name: str) -> bool:
    """Whether this is a formula in place of the name of one."""
    return bool(set("<>=() ") & set(name))
