"""Criticality metrics: safe distances of rules, time to collision, decelerations, encroachment.

Plain functions of numbers or arrays, independent of episodes. A metric for a column of the results
is measured in an episode and has an entry in ``results.columns``.
"""

from cavsumo.assertions.metrics.encroachment import pet, pet_tracks
from cavsumo.assertions.metrics.following import drac, mdrac, mttc, ttc_following
from cavsumo.assertions.metrics.highway_code import uk_stopping_distance
from cavsumo.assertions.metrics.plane import closest_approach, drac_boxes, ttc_2d_discs, ttc_boxes
from cavsumo.assertions.metrics.rss import rss_lateral, rss_longitudinal, rss_longitudinal_opposite
from cavsumo.assertions.metrics.zones import cavgym_zones

__all__ = [
    "cavgym_zones",
    "closest_approach",
    "drac",
    "drac_boxes",
    "mdrac",
    "mttc",
    "pet",
    "pet_tracks",
    "rss_lateral",
    "rss_longitudinal",
    "rss_longitudinal_opposite",
    "ttc_2d_discs",
    "ttc_boxes",
    "ttc_following",
    "uk_stopping_distance",
]
