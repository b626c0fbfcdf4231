"""What a SUMO network (.net.xml) offers a test: lanes, the ego's route, starts, traffic lights.

``reader`` reads it, ``site`` puts together what an episode needs of it. ``osm`` makes networks
from OpenStreetMap, ``drawing`` draws them. Nothing here runs SUMO.
To add a place where testers may start: a file beside ``pedestrian_starts``, called by ``site``.
"""
