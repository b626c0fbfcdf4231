"""The columns of results.csv with their meaning: the interface of everything that reads results."""

from __future__ import annotations

from collections.abc import Mapping

# The columns of results.csv with their meaning, in order; interface of everything downstream.
COLUMNS: Mapping[str, str] = {
    "run": "number of the episode in the batch, from 0; the key for replay",
    "agent": "tester agent",
    "ego": "vehicle under test",
    "testers": "number of tester bodies",
    "reset": "fresh: in a simulation of its own; shared: in one that other episodes used before",
    "embodiment": "how SUMO was shown the testers: vehicle or person",
    "sumo_width_m": "width that SUMO was shown of a tester pedestrian",
    "seed": "the episode's seed, derived from the batch's seed and the number of the episode",
    "forecast": "what the tester said before the episode: sure, undecided or not-forceable; empty "
    "for agents that say nothing",
    "forecast_value": "value of its game at the start: 0 where a test is sure, -1 where there is "
    "none",
    "outcome": "violated, held, not_triggered, unfair, invalid or error",
    "breach": "which tester broke which rule of the world before the verdict, and when: the "
    "one that makes the episode invalid, else the first",
    "blame": "which party broke which rule first when outcome is violated, as PARTY:rule; a hint, "
    "not law (docs/fairness.md); empty if no rule tells",
    "assertion": "the assertion first violated, else first triggered; one without a precondition "
    "only if violated or alone",
    "verdicts": "what every assertion said: NAME=verdict, with blanks between",
    "robustness": "smallest margin of that assertion since its trigger, in its unit (docs/"
    "assertions.md); negative if and only if violated",
    "tester": "the tester's body involved",
    "trigger_time_s": "when the precondition triggered",
    "violation_time_s": "when the assertion was violated",
    "time_s": "length of the episode",
    "steps": "length of the episode in timesteps",
    "min_gap_m": "smallest gap between the ego and a tester",
    "min_ttc_s": "smallest time to collision of the moving ego and a tester at constant "
    "velocities, before the first contact; empty above 10 s",
    "max_drac_mps2": "largest deceleration by which the ego just avoids that collision; 0 for none",
    "pet_s": "post-encroachment time: how long after the one, ego or tester, left an area that "
    "both sweep the other came there; 0 if both were in it at once, empty above 10 s",
    "ego_speed_mps": "speed of the ego at the violation, else at the trigger",
    "impact_speed_mps": "closing speed along the ego's heading at contact",
    "max_decel_mps2": "hardest braking of the ego",
    "avoidable": "1 if the reference driver would have avoided the violation, else 0; empty if not "
    "judged",
    "reference": "the reference driver",
    "last_chance_s": "latest time at which it could have perceived the risk and avoided it; empty "
    "for never",
    "margin_s": "how long before the violation that is",
    "avoidable_note": "why it was not judged, or what to doubt",
    "cost": "time that the testers spent on the carriageway, together [s]",
    "accel_rms_mps2": "root mean square of the testers' accelerations over all timesteps",
    "turning_rad": "how far the testers turned, to either side, together",
    "reward": "the testers' return, undiscounted",
    "contacts": "bodies that touched the ego, standing or moving",
    "tester_contacts": "pairs of a tester and a body other than the ego that touched",
    "sumo_collisions": "pairs with the ego that SUMO itself reported as colliding",
    "background_collisions": "pairs without the ego that SUMO itself reported",
    "emergency_stops": "emergency stops that SUMO reported",
    "teleports": "teleports that SUMO reported",
    "trace": "frames, relative to this file",
    "error": "what went wrong when outcome is error",
    "wall_s": "real time; the only column that is not reproducible",
}
