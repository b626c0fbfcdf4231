"""From results on disk to figures, and from figures to text and pages.

``load`` and ``grouping`` bring the rows together; ``pairs``, ``compare``, ``survival``, ``effort``,
``driving``, ``events`` and ``distinct`` compute; ``analysis`` is all of it in one record, which
``tables``, ``formats``, ``junit`` and ``pages`` show. Nothing here plays an episode.
To add a figure: compute it in a file that ``analysis`` calls, show it in ``tables``.
"""
