"""What each command is asked for: a record, and a check that refuses it before heavy imports."""
