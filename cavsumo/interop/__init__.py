"""Formats and programs of others: floating car data, sumo-gui, OpenSCENARIO, CommonRoad.

Only this room imports traci, to show a trace; no file here simulates.
To add a format: a file here that reads a trace, and its option in ``cli/options``.
"""
