"""Published scenarios in: OpenSCENARIO XML with OpenDRIVE, read as scripts of cavsumo.

``parts`` is the entrance: a file and values of its parameters give batches to plan; ``reading``
makes one of them, ``variations`` the values of parameters.
``vocabulary`` lists what is understood; ``tree`` reads XML of strangers within bounds; ``files``
finds what a scenario names, within one folder. ``roads`` reads OpenDRIVE, ``places`` positions and
trajectories; ``entities``, ``placing``, ``conditions``, ``actions`` and ``board`` make the parts of
a script; ``ground`` lays a network under it. Nothing is played here. To understand one more
element: a line in ``vocabulary``, and the function that
reads its parent.
"""
