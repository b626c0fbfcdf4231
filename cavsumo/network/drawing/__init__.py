"""A place from above: ``place`` says what is drawn of it, ``picture`` writes it into a file."""
