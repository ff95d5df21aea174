"""Studies of fairing (PCG)."""
