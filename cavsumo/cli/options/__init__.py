"""Options of each command: light to import, so that help and mistakes are answered at once."""
