"""Names of kept tests; light to import."""

from __future__ import annotations

CAVTEST = ".cavtest"  # the ending of their files
