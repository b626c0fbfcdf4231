"""The page of a suite: each test as the grid of its protocol, coloured by bands of impact speed."""
