"""What a test is made of: bodies and their kinematics, shapes, snapshots, the scenario record.

Also what every other room needs: seeds, checks of numbers, registries, plugins of the user.
Nothing here reads a network, decides an action or knows SUMO.
To add a setting: a field in ``scenario/record`` or ``plan``. To add a kind of body: ``bodies``.
"""
