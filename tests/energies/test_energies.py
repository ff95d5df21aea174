import casadi as ca
import numpy as np
import pytest
from problems import body_points
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.program import Evaluator
from symmotion.splines import gauss

RNG = np.random.default_rng(2)
POINTS = RNG.normal(size=(5, 3))


def program(objective, degree=3, keys=None):
    keys = keys or sm.examples.spatial_keyframes()
    return sm.affine_program(keys, degree=degree, objective=objective)


def value_of(p):
    value = Evaluator(p).objective(p.x0)
    assert sm.measure(p.design.motion(p.unpack(p.x0)), p.design.objective) == pytest.approx(value, rel=1e-12)
    return value


def integrate(motion, density, nodes=12):
    points, weights = gauss(motion.basis, nodes)
    return np.sum(weights * density(points))


def gram_derivative(motion, t, order):
    a, da, dda = (motion(t, nu).linear for nu in range(3))
    transpose = np.swapaxes
    if order == 1:
        half = transpose(da, -1, -2) @ a
        return half + transpose(half, -1, -2)
    half = transpose(dda, -1, -2) @ a
    return half + transpose(half, -1, -2) + 2 * transpose(da, -1, -2) @ da


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_rigidity_is_the_integral_of_hjk(order, degree):
    q = RNG.normal(size=(3, 4))
    w = RNG.uniform(0, 1, (4, 4))
    w = w + w.T
    p = program(sm.Rigidity(order, q, w), degree)
    motion = p.design.motion(p.unpack(p.x0))

    def density(t):
        return np.sum(w * (q.T @ gram_derivative(motion, t, order) @ q) ** 2, axis=(-1, -2))

    assert value_of(p) == pytest.approx(integrate(motion, density), rel=1e-12)


@pytest.mark.parametrize("degree", [2, 3, 5])
def test_trajectory_energy_is_the_integral_of_hjk(degree):
    masses = RNG.uniform(0.5, 2, 5)
    p = program(sm.TrajectoryEnergy(POINTS, masses), degree)
    motion = p.design.motion(p.unpack(p.x0))

    def density(t):
        return np.sum(masses * np.sum(motion.trajectory(POINTS, t, 2) ** 2, axis=-1), axis=-1)

    assert value_of(p) == pytest.approx(integrate(motion, density), rel=1e-12)


@pytest.mark.parametrize(("energy", "fewer"), [(sm.Rigidity(), 1), (sm.Rigidity(2), 1)])
def test_node_counts_are_exact_and_least(energy, fewer):
    """The exact count agrees with more nodes to rounding, one node fewer does not."""
    values = {}
    for extra in (-fewer, 0, 4):
        custom = sm.JetEnergy(energy.residuals, squares=True, gauss_nodes=energy.nodes(3) + extra)
        p = program(custom)
        values[extra] = Evaluator(p).objective(p.x0)
    assert values[0] == pytest.approx(values[4], rel=1e-13)
    assert values[-fewer] != pytest.approx(values[4], rel=1e-11)


def test_rigid_motions_cost_nothing_and_rotations_of_the_fixed_system_change_nothing():
    keys = sm.examples.spatial_keyframes()
    turn = Rotation.random(random_state=3).as_matrix()
    turned = sm.Keyframes(keys.times, turn @ keys.linear, keys.translation @ turn.T)
    moved = sm.Keyframes(keys.times, keys.linear @ np.diag([1.0, 2.0, 0.5]), keys.translation)
    for energy in (sm.Rigidity(), sm.Rigidity(2)):
        assert value_of(program(energy, keys=turned)) == pytest.approx(value_of(program(energy)), rel=1e-12)
        assert value_of(program(energy, keys=moved)) != pytest.approx(value_of(program(energy)), rel=1e-2)
        still = sm.Keyframes(keys.times, np.stack([turn] * 4), keys.translation)
        assert value_of(program(energy, keys=still)) < 1e-25


def test_energies_add_and_scale_and_keep_their_names():
    total = sm.Rigidity() + 0.5 * sm.Rigidity(2) + 1e-3 * sm.TrajectoryEnergy(POINTS)
    assert total.name == "R + 0.5 R* + 0.001 E"
    p = program(2 * total)
    parts = Evaluator(p).terms_at(p.x0)
    assert list(parts) == ["R", "R*", "E"]
    assert sum(parts.values()) == pytest.approx(value_of(p))
    assert parts["R*"] == pytest.approx(value_of(program(sm.Rigidity(2))))
    twice = Evaluator(program(sm.Rigidity() + sm.Rigidity())).terms_at(program(sm.Rigidity()).x0)
    assert list(twice) == ["R", "R (2)"]


def test_a_users_expression_is_a_term_like_the_others():
    written = sm.JetEnergy(lambda jet: ca.sumsqr(jet.gram_rate), label="mine")
    squares = sm.JetEnergy(lambda jet: jet.gram_rate, squares=True)
    assert value_of(program(written)) == pytest.approx(value_of(program(sm.Rigidity())), rel=1e-13)
    assert value_of(program(squares)) == pytest.approx(value_of(program(sm.Rigidity())), rel=1e-13)
    timed = sm.JetEnergy(lambda jet: jet.t * ca.sumsqr(jet.dv), gauss_nodes=5)
    p = program(timed)
    motion = p.design.motion(p.unpack(p.x0))
    exact = integrate(motion, lambda t: t * np.sum(motion(t, 1).translation ** 2, axis=-1))
    assert value_of(p) == pytest.approx(exact, rel=1e-12)


def test_whether_translation_takes_part_follows_from_the_objective():
    assert program(sm.Rigidity()).start["controls"].shape[1] == 9
    assert program(sm.Rigidity() + sm.TrajectoryEnergy(body_points(3))).start["controls"].shape[1] == 12


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sm.Rigidity(3), "order 3"),
        (lambda: sm.Rigidity(test_vectors=[[1, 0], [0, 1], [0, 0]]), "do not span the 3-dimensional"),
        (lambda: sm.Rigidity(test_vectors=[1, 2]), r"shape \(d, T\)"),
        (lambda: sm.Rigidity(weights=[[1, -1], [-1, 1]]), r"weight \(0, 1\) is negative"),
        (lambda: sm.Rigidity(weights=[[1, 2], [0, 1]]), "symmetric"),
        (lambda: sm.Rigidity(weights=[1, 2]), "square array"),
        (lambda: sm.Rigidity(test_vectors=np.eye(3), weights=np.ones((2, 2))), "2 × 2 weights for 3"),
        (lambda: program(sm.Rigidity(weights=np.ones((2, 2)))), "2 × 2 weights for 3"),
        (lambda: program(sm.Rigidity(test_vectors=np.eye(2))), "dimension 2 for a motion in 3D"),
        (lambda: sm.TrajectoryEnergy([1, 2, 3]), r"shape \(P, d\)"),
        (lambda: sm.TrajectoryEnergy(POINTS, [1, 2]), "2,"),
        (lambda: sm.TrajectoryEnergy(POINTS, [1, 2, 0, 1, 1]), "mass 2 is 0"),
        (lambda: program(sm.TrajectoryEnergy(np.eye(2))), "dimension 2 for a motion in 3D"),
        (lambda: -1 * sm.Rigidity(), "weight -1 of R"),
        (lambda: sm.Rigidity() + np.nan * sm.Rigidity(2), r"weight nan of R\*"),
        (lambda: 0 * sm.Rigidity(), "all weights"),
        (lambda: program(sm.JetEnergy(lambda jet: jet.A)), r"returns shape \(3, 3\)"),
        (lambda: program(sm.JetEnergy(lambda jet: jet.t**2)), "does not depend on the motion"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_only_energies_add():
    with pytest.raises(TypeError):
        sm.Rigidity() + 3  # pyright: ignore
    with pytest.raises(TypeError):
        "x" * sm.Rigidity()  # pyright: ignore


def test_an_energy_without_integrand_is_refused():
    class Nothing(sm.energies.Energy):
        pass

    with pytest.raises(sm.InputError, match="energy Nothing states neither residuals nor an integrand"):
        program(Nothing())


@pytest.mark.parametrize("orders", [(2, 2), (2, 3), (3, 2)])
@pytest.mark.parametrize("degree", [3, 5])
def test_roughness_is_the_integral_of_its_derivatives(orders, degree):
    p = program(sm.energies.Roughness(2.0, 0.3, orders), degree)
    motion = p.design.motion(p.unpack(p.x0))

    def density(t):
        linear, translation = motion(t, orders[0]).linear, motion(t, orders[1]).translation
        return 2.0 * (linear**2).sum(axis=(-1, -2)) + 0.3 * (translation**2).sum(axis=-1)

    assert value_of(p) == pytest.approx(integrate(motion, density), rel=1e-12)


@pytest.mark.parametrize(
    ("given", "message"),
    [((-1.0, 1.0), "weight of the turn"), ((0.0, 0.0), "both 0"), ((1.0, 1.0, (1, 2)), "2 or 3 each")],
)
def test_bad_roughness(given, message):
    with pytest.raises(sm.InputError, match=message):
        sm.energies.Roughness(*given)


def test_side_slip_is_the_speed_across():
    """A body that circles with its nose ahead does not slip; one that looks outward slips with all its speed."""
    keys, t = sm.examples.spatial_keyframes(), np.linspace(0.0, 2.0, 41)
    turned, point = Rotation.from_rotvec(np.outer(t, [0, 0, 1.0])), np.array([0.0, 0.0, 2.0])
    circle = sm.Keyframes(t, turned.as_matrix(), 3.0 * np.stack([np.sin(t), -np.cos(t), 0 * t], axis=1))
    motion = sm.interpolants.component_cubic(circle)
    assert sm.measure(motion, sm.energies.SideSlip((2, 0, 0))) < 1e-4
    assert sm.measure(motion, sm.energies.SideSlip((0, 1, 0))) == pytest.approx(2.0 * 3.0**2, rel=1e-3)
    # A point ahead of the axle is carried across by the turn, with a speed of its distance.
    assert sm.measure(motion, sm.energies.SideSlip((1, 0, 0), (0.5, 0, 0))) == pytest.approx(2.0 * 0.5**2, rel=1e-3)
    p = program(sm.energies.SideSlip((1.0, 2.0, -1.0), point), keys=keys)
    motion, forward = p.design.motion(p.unpack(p.x0)), np.array([1.0, 2.0, -1.0]) / np.sqrt(6)

    def density(t):
        a, speed = motion(t).linear, motion(t, 1).linear @ point + motion(t, 1).translation
        own = np.einsum("...ji,...j->...i", a, speed)
        return (own**2).sum(axis=-1) - (own @ forward) ** 2

    assert value_of(p) == pytest.approx(integrate(motion, density), rel=1e-12)
    planar = sm.affine_program(sm.examples.planar_keyframes(), objective=sm.energies.SideSlip((1.0, 0.0)))
    assert sm.measure(planar.design.motion(planar.start), sm.energies.SideSlip((1.0, 0.0))) > 0


@pytest.mark.parametrize(
    ("given", "message"), [(((0, 0),), "not zero"), (((1, 0), (1, 2, 3)), "point"), ((2.0,), "forward")]
)
def test_bad_side_slip(given, message):
    with pytest.raises(sm.InputError, match=message):
        sm.energies.SideSlip(*given)


def test_side_slip_of_another_dimension():
    with pytest.raises(sm.InputError, match="forward of dimension 2 for a motion in 3D"):
        program(sm.energies.SideSlip((1.0, 0.0)))
