"""Rows into evidence: from results on disk to figures, and from figures to text.

``load`` and ``grouping`` bring the rows together; ``pairs``, ``compare``, ``survival``, ``effort``,
``events`` and ``distinct`` compute; ``analysis`` is all of it in one record, for whoever shows it:
``tables`` and ``formats`` as text, ``junit`` for continuous integration.
"""
