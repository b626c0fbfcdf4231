"""Many episodes: prepared, played in processes, collected in order, replayed.

``preflight`` checks, ``dispatch`` hands ``jobs`` to executors, ``worker`` watches the process in
which ``episode_runner`` plays them, ``batch_run`` writes the results. ``certify`` bounds the
probability that a test triggers. ``report`` makes tables and pages. To add a way to distribute
episodes over machines: ``executors``; a reason to stop: ``stopping``.
"""
