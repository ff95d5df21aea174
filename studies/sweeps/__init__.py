"""Studies of what motions leave behind."""
