"""The command line: reads words and calls what the other rooms offer; nothing is computed here.

``command_line`` is the parser and the exit statuses, ``options`` the options of each command (light
to import), ``commands`` what a command does (heavy, imported when it is called),
``scenario_settings`` the options that are settings of a scenario.
To add a command: its options in ``options/``, itself in ``commands/``, a line in ``command_line``.
"""

from cavsumo.cli.command_line import main

__all__ = ["main"]
