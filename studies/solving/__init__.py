"""Studies of the solvers: how surely, how fast, how far."""
