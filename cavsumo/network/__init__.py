"""The data of a SUMO network (.net.xml) for a test: lanes, the ego's route, starts, traffic lights.

``reader`` reads the file, ``site`` collects the data that an episode needs. ``osm`` makes networks
from OpenStreetMap, ``drawing`` draws them. No file here runs SUMO. To add a place where testers may
start: a file beside ``pedestrian_starts``, called by ``site``.
"""
