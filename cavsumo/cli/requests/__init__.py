"""Options of each command as a record, with a check before heavy imports."""
