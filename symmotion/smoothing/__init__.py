"""Recordings to motions: how much to smooth, chosen from the recording or from its noise."""

from symmotion.design.amounts import Amount, amount
from symmotion.smoothing.interpolating import is_rigid, own_objective, rigid_objective, stiffness
from symmotion.smoothing.smooth import Plan, plan, smooth

__all__ = ["Amount", "Plan", "amount", "is_rigid", "own_objective", "plan", "rigid_objective", "smooth", "stiffness"]
