"""What moves leave behind: sweep surfaces of profile curves, swept volumes of ellipsoids, and their meshes."""

from symmotion.sweeps.characteristic import CharacteristicCurve, characteristic_curves
from symmotion.sweeps.ellipsoid import MovingEllipsoid
from symmotion.sweeps.surface import SweepSurface, sweep_surface
from symmotion.sweeps.volume import Estimate, SweptVolume, swept_volume

__all__ = [
    "CharacteristicCurve",
    "Estimate",
    "MovingEllipsoid",
    "SweepSurface",
    "SweptVolume",
    "characteristic_curves",
    "sweep_surface",
    "swept_volume",
]
