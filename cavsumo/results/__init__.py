"""The results of episodes: columns, rows, traces and manifests, written and read.

``writing`` writes a batch, ``reading`` reads it, ``provenance`` identifies it, ``inputs`` keeps the
files that it is played from and ``present`` finds them. No file here plays an episode. To add a
column: an entry in ``columns``, and the table of docs/results.md by ``columns.markdown_table``.
"""

from cavsumo.results.reading import read_results, read_rows

__all__ = ["read_results", "read_rows"]
