"""One episode: its requirements (``setup``), its timesteps (``loop``), rewards, avoidability.

A violated episode is played again with a reference driver in ``avoidability``. No file here deals
with files, processes or batches. To measure something new in every episode: ``loop.Episode``.
"""
