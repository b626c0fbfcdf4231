"""One episode: what it needs (``setup``), its timesteps (``loop``), rewards, avoidability.

``playback`` plays an episode again from its record; ``avoidability`` does so with a reference
driver where an episode was violated. Files, processes and batches are not known here.
To measure something new in every episode: ``loop.Episode``.
"""
