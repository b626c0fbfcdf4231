"""The command line: parses options and calls the other rooms, which do all computation.

``command_line`` has the commands and the exit statuses, ``options`` the options of each command,
``setting_options`` those that are read from the scenario record. ``requests`` are the records that
commands take, with checks (light to import), ``commands`` the commands (heavy, imported when all
checks have passed), ``steps`` what they say on the way, ``completion`` the scripts of shells.
To add a command: a file with ``add_NAME`` in ``options/``, a file in ``commands/``.
"""

from cavsumo.cli.command_line import main

__all__ = ["main"]
