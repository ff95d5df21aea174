"""What moves leave behind: sweep surfaces of profile curves, swept volumes of ellipsoids, and their meshes."""

from typing import TYPE_CHECKING

from symmotion.renamed import moved
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

if not TYPE_CHECKING:
    # Names of 0.1.0.
    __getattr__ = moved(
        __name__,
        {
            "bodies": "Mesh",
        },
    )
