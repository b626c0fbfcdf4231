"""The commands, one file each; heavy to import, so imported only when they are called."""
