"""Studies of affine motions (HJK)."""
