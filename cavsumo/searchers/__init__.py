"""The search for tests: a space of tests, and searchers that choose its points.

``space`` makes starts and programmes of a point; a searcher asks for points and is told how near
each came to a preventable failure (``results.grade``). No SUMO, no processes: ``batch`` plays the
points. To add a searcher: a file here, and its name in ``methods`` and ``agents.names``.
"""
