"""Recordings to motions: how much to smooth, chosen from the recording or from its noise."""

from symmotion.smoothing.choosing import Amount, amount
from symmotion.smoothing.smooth import Plan, Roughness, is_rigid, plan, smooth

__all__ = ["Amount", "Plan", "Roughness", "amount", "is_rigid", "plan", "smooth"]
