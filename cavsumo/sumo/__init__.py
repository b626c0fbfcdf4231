"""The boundary to SUMO: the only room that imports libsumo.

``connection`` starts and ends simulations. ``world`` plays one: it tells SUMO where the testers are
(``moved_bodies``), commands and reads the ego (``ego_in_sumo``), and reads everybody else
(``background``) and the lights (``light_letters``). Other rooms decide and judge.
To give SUMO another vehicle: ``vehicle_types``. To change an option of SUMO: ``options``.
"""
