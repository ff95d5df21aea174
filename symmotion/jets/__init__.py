"""Jets: a motion and its derivatives at one parameter, as CasADi expressions."""

from symmotion.jets.affine import HIGHEST_ORDER, Jet
from symmotion.jets.curve import CurveJet, NetJet
from symmotion.jets.jet import AnyJet, BodyJet
from symmotion.jets.rigid import RigidJet
from symmotion.jets.written import Written

__all__ = ["HIGHEST_ORDER", "AnyJet", "BodyJet", "CurveJet", "Jet", "NetJet", "RigidJet", "Written"]
