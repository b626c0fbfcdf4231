"""Many episodes: checked beforehand, played in processes, collected in order, played again.

``preflight`` checks, ``dispatch`` hands ``jobs`` to executors, ``worker`` watches the process in
which ``episode_runner`` plays them, ``batch_run`` writes what comes back. ``certify`` bounds how
surely a test triggers. Tables and pages are made in ``report``.
To add a way to spread episodes over machines: ``executors``; a reason to stop: ``stopping``.
"""
