"""What each command does, one file a command; heavy to import, so only when it is called."""
