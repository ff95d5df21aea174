"""Studies of quaternion curves and their programs (KKS)."""
