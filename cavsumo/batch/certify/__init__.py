"""A test over fresh seeds and a list of egos: what is certified, against whom, with what bounds."""
