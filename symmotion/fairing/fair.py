"""One call for every way to fair a motion."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.errors import InputError
from symmotion.fairing.borders import Borders, Freedom
from symmotion.fairing.coordinates import AnyMotion, Coordinates, Fairable, Parts, same_kind
from symmotion.fairing.greedy import Limits
from symmotion.fairing.in_turn import both_parts, in_turn
from symmotion.fairing.jumps import Jumps
from symmotion.fairing.keyframes import Asked, held, weights_of
from symmotion.fairing.methods import Found, Task, by_bounds, by_least_squares, by_program, by_steps
from symmotion.fairing.metrics import Metric
from symmotion.fairing.noise import noise_metric
from symmotion.fairing.programs import fairing_program, tolerances
from symmotion.fairing.result import FairingResult, FairingStatus
from symmotion.solvers import ExactNewton

Method = Literal["greedy", "orthogonal", "least-squares", "bounded"]
METHODS = ("greedy", "orthogonal", "least-squares", "bounded")  # of `fair`, local ones first
Form = Literal["closed", "program"]
STEPS_PER_KNOT = 100
# And within tolerances, where steps that are still allowed go round in circles, so many per knot without a better net.
PATIENCE_PER_KNOT = 20
# How often a target is lowered for what the control quaternions lose when they are made unit ones again.
LOWERED = 5


@np.errstate(all="ignore")  # what is not finite is told by name
def fair(
    motion: AnyMotion,
    method: Method | None = None,
    *,
    target: float | None = None,
    max_steps: int | None = None,
    divergence: float = 10.0,
    change: float | None = None,
    tolerance: float | np.ndarray | None = None,
    weight: float | None = None,
    noise: float | Sequence[float] | None = None,
    region: object = None,
    parts: Parts | None = None,
    length: float = 1.0,
    keyframes: Sequence[Asked] = (),
    borders: Borders = "ring",
    weights: ArrayLike | None = None,
    metric: ArrayLike | None = None,
    form: Form = "closed",
) -> FairingResult[AnyMotion]:
    """A motion made fairer: smaller jumps of its third derivatives at the knots, its outermost controls fixed.

    With L_kl = |Δ_uuu|² + |Δ_vvv|² at knot (u_k, v_l) and G = ΣL (PCG (15)–(17)):

    - "greedy": PCG table 1, at the largest L_kl the least move of the inner nine controls that
      makes both jumps zero (of a curve, three and one). G does not fall in every step and, if
      the iteration goes on, grows again for good: the best net seen is kept.
    - "orthogonal": the same with all 21 controls that the jumps read, but for the outermost.
    - "least-squares": min ΣL + w Σ|d − d⁰|², one linear system.
    - "bounded": min ΣL subject to |d − d⁰| ≤ δ at every control, by the interior point of ExactNewton; of nets that are
      equally fair the nearest, by a weight w of 1e-10 of that at which displacements count as jumps do.

    motion: a two-parameter motion, cubic in both directions, or a cubic one-parameter one, with
        simple interior knots and neighbouring control quaternions in one hemisphere; or a quaternion
        curve or pose motion, which is faired through its control polygon.
    method: greedy when left out, with `noise` least-squares.
    target: of G. The steps stop there; least squares finds the weight that leads there.
    max_steps: 100 per knot when left out, and with a tolerance 20 without a better net; divergence: the steps stop
        where G is this multiple of the best;
        change: the steps stop where one changes G by less, PCG (23), which happens by chance.
    tolerance: δ, one or (n, m), in units of the faired coordinates: steps that move a control
        further are discarded; "bounded" needs it.
    weight: w > 0 of the least squares, 1 when left out together with `target` and `noise`.
    noise: σ of every coordinate, or (σ of the real part, σ of the other): the weight is chosen such that the
        controls move as far as the noise has, Σ|d − d⁰|² = N σ² over the N coordinates that may move (discrepancy).
    region: fair only there: (a, b) of a curve, ((a, b), (c, d)) in u and v.
    parts: "real", "dual", "translation", "real+dual" (all that moves when left out) or
        "real+translation" (PCG 6); length: the unit that dual parts and translations are divided by.
    keyframes: ((u, v), displacement), an `Affine` or `DualQuaternions`, or `NetKeyframe`, `NetPlace`: kept exactly.
        With "real+translation" by least squares only, of the real part first, and with each part's own prices.
    borders: "ring", the outermost controls stay; "free"; "G0", "G1", "G2": the motion along the border and its first
        one or two derivatives across stay; `Continued`: they are those of a neighbouring net, also at a corner with a
        ring. One for all sides, or by side: "u0", "u1", "v0", "v1". The nine controls of a greedy step are inner ones.
    weights, metric: of displacements, Σ weights_ij δᵀ W δ with W symmetric positive definite, see `Metric`.
    form: "closed", or "program": every step, or the whole net, as a constrained program
        of symbols with explicit multipliers, which ends at the same net and brings a certificate.

    Raises InputError for what cannot be faired and names the direction, knot, control, keyframe or border at fault.

    >>> net = sm.motions.noisy_net(sm.motions.smooth_net(8), 0.01, seed=1)
    >>> result = sm.fair(net, "least-squares", weight=1.0)
    >>> result.final < 0.1 * result.initial
    True
    """
    began = perf_counter()
    chosen: str = ("greedy" if noise is None else "least-squares") if method is None else method
    options = {
        "weight": weight, "max_steps": max_steps, "tolerance": tolerance, "target": target, "noise": noise,
        "change": change,
    }  # fmt: skip
    _check(chosen, form, options, divergence)
    coordinates = Coordinates.of(motion, parts, length)
    some = not isinstance(keyframes, Sequence) or len(keyframes) > 0
    if some and chosen == "least-squares" and form == "closed" and both_parts(coordinates):
        shared = {"weight": weight, "region": region, "length": length, "borders": borders, "weights": weights}
        return in_turn(fair, motion, keyframes, shared | {"target": target, "metric": metric}, noise)
    jumps = Jumps.of(coordinates.bases)
    net = coordinates.net
    freedom = Freedom.of(coordinates, jumps, region, borders)
    size = None
    if noise is not None:
        metric, size = noise_metric(coordinates, freedom, noise, metric)
    task = Task(coordinates, jumps, freedom, net, held(coordinates, keyframes), Metric.of(net.shape, weights, metric))
    limits = Limits(target, STEPS_PER_KNOT * task.knots if max_steps is None else max_steps, divergence)
    allowed = None if tolerance is None else tolerances(tolerance, net.shape[:2])
    if chosen in ("greedy", "orthogonal"):
        limits = replace(limits, knots=freedom.box.knots(jumps), tolerance=allowed, change=change or 0.0)
        if allowed is not None and max_steps is None:
            limits = replace(limits, patience=PATIENCE_PER_KNOT * task.knots)

    def run(goal: float | None) -> Found:
        if chosen in ("greedy", "orthogonal"):
            return by_steps(task, chosen, replace(limits, target=goal), form)
        if chosen == "least-squares" and form == "closed":
            return by_least_squares(task, goal, weight, size)
        given = {
            "region": region, "parts": coordinates.parts, "length": length, "keyframes": keyframes, "borders": borders,
            "weights": weights, "metric": metric,
        }  # fmt: skip
        if chosen == "bounded" and allowed is not None:
            program = fairing_program(motion, tolerance=tolerance, weight=task.problem.nearest, **given)
            return by_bounds(task, ExactNewton(), program, allowed)
        found = by_least_squares(task, goal, weight, size)
        program = fairing_program(motion, weight=found.weight or 1.0, **given)
        solved = by_program(task, ExactNewton(), program, weight=found.weight)
        return solved if solved.status == FairingStatus.FAILED else replace(solved, status=found.status)

    before = jumps.fairness(net)
    total = before.sum()
    if not np.isfinite(total):
        raise InputError(
            f"G = {total} at the start: the controls, up to {np.abs(net).max():.2g}, are too large for the "
            "squares of the jumps at these knots; measure them in larger units, or the dual parts by a larger length"
        )
    found = run(target)
    total = jumps.fairness(found.net).sum()
    if not np.isfinite(total):
        message = f"G = {total} at the end, and the motion is the one given"
        found = replace(found, net=net, status=FairingStatus.FAILED, message=message)
    faired = coordinates.motion_of(found.net)
    if coordinates.normalised:
        faired, found = _lowered(coordinates, jumps, run, found, target)
    end = replace(coordinates, motion=faired).net if coordinates.normalised else found.net
    after = jumps.fairness(end)
    curve = len(coordinates.bases) == 1
    displacement = np.linalg.norm(end - net, axis=-1)
    history = np.array([before.sum(), after.sum()]) if found.history is None else found.history
    return FairingResult(
        motion=same_kind(motion, faired),
        start=motion,
        method=chosen,
        status=found.status,
        history=history,
        before=before[:, 0] if curve else before,
        after=after[:, 0] if curve else after,
        displacement=displacement[:, 0] if curve else displacement,
        multipliers=found.multipliers,
        certificate=found.certificate,
        steps=found.steps,
        best_step=found.best,
        seconds=perf_counter() - began,
        discarded=found.discarded,
        weight=found.weight,
        keyframe_weights=weights_of(coordinates, task.keyframes, found.net),
        message=found.message,
    )


def _lowered(
    coordinates: Coordinates, jumps: Jumps, run: Callable[[float | None], Found], found: Found, target: float | None
) -> tuple[Fairable, Found]:
    """The motion of unit control quaternions whose G is at the target, as far as what they lose can be had before."""
    goal, motion = target, coordinates.motion_of(found.net)
    for _ in range(LOWERED):
        value = float(jumps.fairness(replace(coordinates, motion=motion).net).sum())
        if target is None or goal is None or found.status != FairingStatus.TARGET or value <= target:
            return motion, found
        goal *= 0.99 * target / value
        found = run(goal)
        motion = coordinates.motion_of(found.net)
    return motion, replace(found, status=FairingStatus.CAP)


# The methods that take each of these options.
TAKEN_BY = {
    "weight": ("least-squares",),
    "max_steps": ("greedy", "orthogonal"),
    "tolerance": ("greedy", "orthogonal", "bounded"),
    "target": ("greedy", "orthogonal", "least-squares"),
    "noise": ("least-squares",),
    "change": ("greedy", "orthogonal"),
}


def _check(method: str, form: str, options: Mapping[str, object], divergence: float) -> None:
    """InputError for a method, a form or options that there are not; options: by name, None where left out."""
    checks.choice(method, METHODS, "method")
    checks.choice(form, ("closed", "program"), "form")
    given = {name: value for name, value in options.items() if value is not None}
    for name in given.keys() & {"target", "weight", "change"}:
        checks.positive(given[name], name)
    if "max_steps" in given:
        checks.whole(given["max_steps"], 0, "max_steps")
    if not checks.positive(divergence, "divergence") > 1:
        raise InputError(f"divergence {divergence!r}: a number above 1 is needed")
    if "noise" in given and given.keys() & {"weight", "target"}:
        raise InputError("noise chooses the weight: leave out weight and target")
    if "target" in given and ("weight" in given or method == "bounded"):
        other = "weight" if "weight" in given else "bounded"
        raise InputError(f"target and {other} do not go together: give one")
    for name in TAKEN_BY:
        if name in given and method not in TAKEN_BY[name]:
            *others, last = TAKEN_BY[name]
            takers = f"{', '.join(others)} and {last}" if others else last
            remedy = "; least-squares takes a weight" if method == "least-squares" else ""
            raise InputError(f"{name} goes with {takers}, not with {method}{remedy}")
    if method == "bounded" and "tolerance" not in given:
        raise InputError("bounded needs a tolerance: how far each control may go")
