"""Studies of recorded motions."""
