"""The command line: reads words and calls what the other rooms offer; nothing is computed here.

``command_line`` is the parser and the exit statuses, ``options`` the options of each command,
``setting_options`` those that are settings of a scenario. ``requests`` has what a command is asked
for and refuses what is wrong with it (light to import), ``commands`` what it does (heavy, imported
when all of that is right).
To add a command: its options in ``options/``, itself in ``commands/``, a line in ``command_line``.
"""

from cavsumo.cli.command_line import main

__all__ = ["main"]
