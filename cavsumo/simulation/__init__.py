"""One episode: what it needs (``setup``), its timesteps (``loop``), rewards, avoidability.

A violated episode is played again with a reference driver in ``avoidability``. Files, processes
and batches are not known here. To measure something new in every episode: ``loop.Episode``.
"""
