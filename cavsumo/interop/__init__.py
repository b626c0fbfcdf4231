"""Formats and programs of others: floating car data (``fcd``), sumo-gui (``gui``).

traci is imported here only, to show a trace; nothing here simulates.
To add a format: a file here that reads a trace, and its option in ``cli/options``.
"""
