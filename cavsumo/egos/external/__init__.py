"""Egos in other processes: a program that is started, or one that listens at a TCP port.

``ego`` is what an episode sees of them, ``protocol`` their messages, ``link`` lines with deadlines.
"""
