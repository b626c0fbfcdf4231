"""What is left of episodes: columns, rows, traces and manifests, written and read.

``writing`` writes a batch, ``reading`` reads it, ``provenance`` says what identifies it. Nothing
here plays an episode. To add a column: its name and meaning in ``columns``, its value in
``batch/episode_runner``.
"""

from cavsumo.results.reading import read_results, read_rows

__all__ = ["read_results", "read_rows"]
