"""A test on fresh seeds against a list of egos: the tested policy, the egos, the bounds."""
