"""The commands of the command line that play episodes or handle their results, one file each."""
