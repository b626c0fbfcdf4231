"""Tests that are kept: made as small as they can be, and played against other egos.

``shrinking`` is the search for the smallest value that still has a property, ``candidate`` an
episode that can be made smaller, ``motion`` the motion of one tester in it, ``reductions`` all the
ways to make it smaller, ``minimising`` plays them. ``sentence`` tells a test in words. A further
way to make a test smaller is a function in ``reductions``.
"""
