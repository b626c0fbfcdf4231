"""A place from above: ``place`` is the record of its outlines, ``picture`` draws it into a file."""
