"""The objective that serves rigid keyframes: what keeps the body rigid, and how its turn and place are to bend."""

import numpy as np

from symmotion.energies import Energy, Rigidity, Roughness, TrajectoryEnergy
from symmotion.motions import Keyframes
from symmotion.splines import BSplineBasis
from symmotion.splines.penalised import banded, cholesky, derivative, gram, log_det, solved

RIGID = 1e-6
# With R alone how fast a rigid body turns is left free; with too much beside it the body is not kept rigid, and turns
# far apart are cut short. Between 0.001 and 1 recordings are met equally well, within half a percent.
BENDING = 0.01
# The weight of E for keyframes that are not rigid, of the median step squared.
AFFINE = 0.1
# Of third derivatives beside second ones, in segments: from the natural spline, which bends least, to one that hardly
# is, whose ends are met to a higher order where a motion is smooth.
STIFFNESSES = (0.0, 0.01, 0.1, 1.0, 10.0, 100.0)
HOLDS = 1e8  # the weight of keyframes in units of the objective: as good as exact
FEWEST = 6  # keyframes of which a stiffness can be told


def is_rigid(keyframes: Keyframes) -> bool:
    """Whether all linear parts are rotations, to 1e-6.

    keyframes: affine, in the plane or in space.

    >>> from symmotion.smoothing import is_rigid
    >>> is_rigid(sm.examples.quarter_turn()), is_rigid(sm.examples.planar_keyframes())
    (True, False)
    """
    a = keyframes.linear
    off = np.abs(np.swapaxes(a, 1, 2) @ a - np.eye(keyframes.dimension)).max()
    return bool(off <= RIGID and (np.linalg.det(a) > 0).all())


def own_objective(keyframes: Keyframes) -> tuple[Energy, str]:
    """The objective that suits keyframes, and what it is: `rigid_objective` where they are rigid, else R and some E.

    keyframes: affine, in the plane or in space.

    >>> from symmotion.smoothing import own_objective
    >>> own_objective(sm.examples.planar_keyframes())[1]
    'R + 0.0111 E'
    """
    if is_rigid(keyframes):
        return rigid_objective(keyframes), "R and a little of how place and turn bend, as suits rigid keyframes"
    d = keyframes.dimension
    weight = AFFINE * float(np.median(np.diff(keyframes.times))) ** 2
    return Rigidity() + weight * TrajectoryEnergy(np.concatenate([np.eye(d), -np.eye(d)])), f"R + {weight:.3g} E"


def rigid_objective(keyframes: Keyframes) -> Energy:
    """R + β ∫ h² ‖Ä‖² + c_A h⁴ ‖A⃛‖² + (h² ‖v̈‖² + c_v h⁴ ‖v⃛‖²)/L² dt, for motions through rigid keyframes.

    h is the median segment, L the root mean square distance of the places from their centre, β = 0.01, so that neither
    clock nor yardstick matters. R leaves free how fast a rigid body turns, and does not see the place; second
    derivatives alone make the natural cubic spline of it, third ones a smoother one. How much of these is right for
    the turn and for the place, c_A and c_v, is told by the keyframes, see `stiffness`.

    keyframes: affine, in the plane or in space.

    >>> from symmotion.smoothing import rigid_objective
    >>> keys = sm.examples.recorded_tour(20)
    >>> program = sm.affine_program(keys, objective=rigid_objective(keys))
    >>> sm.ExactNewton().solve(program).status
    <Status.SOLVED: 'solved'>
    """
    times, places = keyframes.times, keyframes.translation
    h = float(np.median(np.diff(times)))
    extent = float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean())) or 1.0
    turns, travels = (stiffness(times, part) for part in (keyframes.linear.reshape(len(times), -1), places))
    bends = Roughness(h**2, (h / extent) ** 2)
    if turns or travels:
        bends = bends + Roughness(turns * h**4, travels * (h**2 / extent) ** 2, (3, 3))
    return Rigidity() + BENDING * bends


def stiffness(times: np.ndarray, values: np.ndarray) -> float:
    """c of the process with the precision ∫ ‖ẍ‖² + c h² ‖x⃛‖² dt that values (M, k) at times (M,) are likeliest from.

    Restricted likelihood (Patterson and Thompson 1971), of all that is no straight line, with one variance for all
    coordinates: least (M − 2) log min ∫ … + log det of the precision given the values − log det of the precision, over
    quintic splines with knots at the times. h: the median step. One of 0, 0.01, 0.1, 1, 10 and 100; 0 for few
    values, and where they lie on a straight line.

    >>> from symmotion.smoothing import stiffness
    >>> t = np.arange(40.0)
    >>> stiffness(t, np.sin(0.3 * t)[:, None]), stiffness(t, np.abs(t - 20)[:, None])
    (100.0, 0.0)
    """
    m = len(times)
    if m < FEWEST:
        return 0.0
    s = (times - times[0]) / np.median(np.diff(times))
    basis = BSplineBasis.clamped(s, 5)
    values = values - values.mean(axis=0)
    to_bends, second = derivative(basis, 2)
    bending, jerk = gram(second), gram(second, 1)
    at = basis.matrix(s)
    data, right = at.T @ at, HOLDS * (at.T @ values)
    scale = float((values**2).sum())
    scores = []
    for c in STIFFNESSES:
        inner = bending + c * jerk
        factor = cholesky(banded(HOLDS * data + to_bends.T @ inner @ to_bends, 5))
        controls = solved(factor, right)
        bends = to_bends @ controls
        energy = HOLDS * ((values - at @ controls) ** 2).sum() + (bends * (inner @ bends)).sum()
        if not energy > 1e-14 * scale:
            return 0.0
        scores.append((m - 2) * np.log(energy) + log_det(factor) - log_det(cholesky(banded(inner, 3))))
    return STIFFNESSES[int(np.argmin(scores))]
