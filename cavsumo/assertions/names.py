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
)


def is_formula(name: str) -> bool:
    """Whether this is a formula in place of the name of one."""
    return bool(set("<>=() ") & set(name))
