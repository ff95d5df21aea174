"""Studies of motion curves."""
