"""The parts of a test: bodies and their kinematics, shapes, snapshots, the scenario record.

Also the tools of all other rooms: seeds, checks of numbers, registries, plugins of the user.
No file here reads a network, decides an action or imports SUMO.
To add a setting: a field in ``scenario/record`` or ``plan``. To add a kind of body: ``bodies``.
"""
