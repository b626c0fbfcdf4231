"""Egos in other processes: a program that is started, or one that listens at a TCP port.

``ego`` is their interface to an episode, ``protocol`` their messages, ``link`` lines with
deadlines.
"""
