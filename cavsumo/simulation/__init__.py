"""One episode: its requirements (``setup``), its timesteps (``loop``), rewards, avoidability.

``playback`` plays an episode again from its record; ``avoidability`` does so with a reference
driver where an episode was violated. No file here deals with files, processes or batches.
To measure something new in every episode: ``episode.Episode``.
"""
