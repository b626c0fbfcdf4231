"""The boundary to SUMO: the only room that imports libsumo.

``world`` moves the testers in a simulation and reads everybody from it, ``connection`` starts and
ends simulations. Other rooms decide and judge.
To give SUMO another vehicle: ``vehicle_types``. To change an option of SUMO: ``options``.
"""
