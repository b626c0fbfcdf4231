"""Failure probabilities: how often a failure would happen, with intervals that keep their word.

Estimators ask for random vectors and are told what came of them (``protocol``); the learned twist
(``twist``) estimates rare failures of a process that is disturbed step by step. An exposure says
what pedestrians do by chance. No SUMO, no processes: ``batch`` plays the vectors. To add an
estimator: a file here, and its name in ``methods``.
"""
