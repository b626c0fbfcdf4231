"""A junction from above: its surfaces as shapes, what is drawn of them, the picture."""
