"""Averages, discrete gradients and nodal constraints, evaluated as plain UFL expressions."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.core.expr import Expr
from ufl.variable import Variable

from shellmb.forms import materials
from shellmb.forms.constraints import joints
from shellmb.forms.frame import PAIRS, orthonormality
from shellmb.forms.shell import ShellStrains, director_constraint
from shellmb.forms.steps.discrete import discrete_gradient, gradient, mean, stress_average
from shellmb.forms.steps.potentials import convex

RUBBER = {"mu": 1.3, "thickness": 0.1, "shear_correction": 5 / 6}


@pytest.fixture(autouse=True)
def _once(monkeypatch: pytest.MonkeyPatch) -> None:
    """UFL evaluates a variable wherever it occurs, those in it again each time: here once."""
    anew = Variable.evaluate

    def kept(self: Variable, *args: Any) -> float:
        _, values, component, _ = args
        key = (self.label().count(), component)
        if key not in values:
            values[key] = anew(self, *args)
        return float(values[key])

    monkeypatch.setattr(Variable, "evaluate", kept)


def evaluate(expression: Expr) -> np.ndarray:
    """Numbers of an expression without functions in it."""
    expression = apply_derivatives(apply_algebra_lowering(expression))
    if not expression.ufl_shape:
        return np.array(expression(()))
    return np.array([expression[k](()) for k in range(expression.ufl_shape[0])])


def vector(values: np.ndarray) -> Expr:
    return ufl.as_vector([ufl.as_ufl(float(v)) for v in values])


def rubber(e: Expr) -> Expr:
    parameters = {k: ufl.as_ufl(v) for k, v in RUBBER.items()}
    return materials.neo_hookean(strains(e), parameters)


def strains(e: Expr) -> ShellStrains:
    parts = [ufl.as_vector([e[k] for k in range(a, b)]) for a, b in ((0, 3), (3, 6), (6, 8))]
    return ShellStrains(*parts)


def quartic(e: Expr) -> Expr:
    return ufl.dot(e, e) ** 2 + e[0] * e[1] + e[0]


@pytest.mark.parametrize("size", [1.0, 1e-2, 1e-6, 0.0])
@pytest.mark.parametrize(("psi", "n"), [(quartic, 3), (rubber, 8)])
def test_the_discrete_gradient_does_the_exact_work(
    psi: Callable[[Expr], Expr], n: int, size: float, rng: np.random.Generator
) -> None:
    e_a = 0.05 * rng.normal(size=n)
    e_b = e_a + 0.05 * size * rng.normal(size=n)
    tau = evaluate(discrete_gradient(psi, vector(e_a), vector(e_b)))
    energy = [float(evaluate(psi(vector(e)))) for e in (e_a, e_b)]
    # the energies are of order 0.1, their difference has the round-off of that
    assert tau @ (e_b - e_a) == pytest.approx(energy[1] - energy[0], rel=1e-12, abs=1e-16)


def test_the_discrete_gradient_tends_to_the_stress(rng: np.random.Generator) -> None:
    e, direction = 0.05 * rng.normal(size=(2, 8))
    stress = evaluate(gradient(rubber, vector(e)))
    gaps = []
    for h in (0.4, 0.2):
        a, b = vector(e - h * direction), vector(e + h * direction)
        gaps.append(np.linalg.norm(evaluate(discrete_gradient(rubber, a, b)) - stress))
    # the average over a symmetric interval is of second order in it
    assert np.log2(gaps[0] / gaps[1]) == pytest.approx(2, abs=0.3)


def test_the_weights_make_unlike_units_comparable(rng: np.random.Generator) -> None:
    """The same shell in millimetres has the same average stress."""
    unit, e_a, e_b = 1e3, 0.05 * rng.normal(size=8), 0.05 * rng.normal(size=8)
    scale = np.array([1, 1, 1, unit, unit, unit, 1, 1])
    parameters = {k: ufl.as_ufl(v) for k, v in RUBBER.items()}
    small = parameters | {"thickness": ufl.as_ufl(unit * RUBBER["thickness"])}

    def stress(p: dict[str, Expr], factor: np.ndarray, h: float) -> np.ndarray:
        weight = vector(np.array([1, 1, 1, h, h, h, 1, 1]))
        psi = lambda e: materials.neo_hookean(strains(e), p)  # noqa: E731
        return evaluate(discrete_gradient(psi, vector(e_a / factor), vector(e_b / factor), weight))

    h = RUBBER["thickness"]
    metres = stress(parameters, np.ones(8), h)
    millimetres = stress(small, scale, unit * h)
    np.testing.assert_allclose(millimetres, unit * scale * metres, rtol=1e-11)


def test_gradient_is_the_derivative_of_the_energy(rng: np.random.Generator) -> None:
    e, direction = 0.05 * rng.normal(size=(2, 8))
    h = 1e-4
    energies = [float(evaluate(rubber(vector(e + s * h * direction)))) for s in (1, -1)]
    stress = evaluate(gradient(rubber, vector(e)))
    assert stress @ direction == pytest.approx((energies[0] - energies[1]) / (2 * h), rel=1e-6)


def test_averages() -> None:
    a, b = ufl.as_ufl(1.0), ufl.as_ufl(4.0)
    assert float(evaluate(mean(a, b))) == 2.5
    assert float(evaluate(stress_average(a, b, 0.0))) == 2.5
    # full dissipation takes the stress at the end, as backward Euler does
    assert float(evaluate(stress_average(a, b, 1.0))) == 4.0


def test_through_the_thickness_a_quadratic_material_is_the_linear_section(
    rng: np.random.Generator,
) -> None:
    p = {"E": 2.0, "nu": 0.3, "thickness": 0.2, "shear_correction": 5 / 6}
    e = strains(vector(rng.normal(size=8)))
    plane, shear = p["E"] / (1 - p["nu"] ** 2), p["shear_correction"] * p["E"] / 2.6

    def density(e: Expr, gam: Expr) -> Expr:
        cross = 2 * p["nu"] * e[0] * e[1] + (1 - p["nu"]) / 2 * e[2] ** 2
        return plane * (e[0] ** 2 + e[1] ** 2 + cross) / 2 + shear * ufl.dot(gam, gam) / 2

    thickness = ufl.as_ufl(p["thickness"])
    through = evaluate(materials.through_thickness(density, e, thickness))
    section = evaluate(materials.isotropic_quadratic(e, {k: ufl.as_ufl(v) for k, v in p.items()}))
    assert float(through) == pytest.approx(float(section), rel=1e-13)


def test_neo_hookean_has_the_moduli_of_an_incompressible_material(
    rng: np.random.Generator,
) -> None:
    """For small strains it is the linear section with E = 3 mu and nu = 1/2."""
    e = 1e-4 * rng.normal(size=8)
    mu, h = RUBBER["mu"], RUBBER["thickness"]
    linear = {"E": 3 * mu, "nu": 0.5, "thickness": h, "shear_correction": 5 / 6}
    expected = evaluate(
        gradient(
            lambda e: materials.isotropic_quadratic(
                strains(e), {k: ufl.as_ufl(v) for k, v in linear.items()}
            ),
            vector(e),
        )
    )
    found = evaluate(gradient(rubber, vector(e)))
    np.testing.assert_allclose(found, expected, atol=5e-3 * np.max(np.abs(expected)))


def test_neo_hookean_stress_of_uniaxial_stretch() -> None:
    """Closed form in the first Piola sense: dW/de11 = mu h (1 - 1/(c11^2 c22))."""
    c11, c22 = 1.8, 0.7
    e = np.array([(c11 - 1) / 2, (c22 - 1) / 2, 0, 0, 0, 0, 0, 0])
    stress = evaluate(gradient(rubber, vector(e)))
    mu, h = RUBBER["mu"], RUBBER["thickness"]
    assert stress[0] == pytest.approx(mu * h * (1 - 1 / (c11**2 * c22)), rel=1e-12)
    assert stress[1] == pytest.approx(mu * h * (1 - 1 / (c11 * c22**2)), rel=1e-12)


def test_invariants_are_those_of_an_incompressible_body(rng: np.random.Generator) -> None:
    """`tr C` and `tr C^-1` of a full tensor with `det C = 1`, transverse shear included."""
    e, gam = 0.2 * rng.normal(size=3), 0.2 * rng.normal(size=2)
    C = np.eye(3)
    C[:2, :2] += [[2 * e[0], e[2]], [e[2], 2 * e[1]]]
    C[:2, 2] = C[2, :2] = gam
    plane = C[:2, :2]
    C[2, 2] = 1 / np.linalg.det(plane) + gam @ np.linalg.solve(plane, gam)
    assert np.linalg.det(C) == pytest.approx(1.0, rel=1e-12)
    found = materials.invariants(vector(e), vector(gam), ufl.as_ufl(1.0))
    first, second = (float(evaluate(expression)) for expression in found)
    assert first == pytest.approx(np.trace(C) - 3, rel=1e-11)
    assert second == pytest.approx(np.trace(np.linalg.inv(C)) - 3, rel=1e-11)


def test_mooney_rivlin_stress_of_uniaxial_stretch() -> None:
    """`(mu1 + mu2/l) (l - 1/l^2)` per area of the reference: R. S. Rivlin (1948)."""
    mu1, mu2, stretch, h = 0.7, 0.4, 1.6, RUBBER["thickness"]
    p = {"mu1": mu1, "mu2": mu2, "thickness": h, "shear_correction": 5 / 6}
    e = np.zeros(8)
    e[:2] = (stretch**2 - 1) / 2, (1 / stretch - 1) / 2
    constants = {k: ufl.as_ufl(v) for k, v in p.items()}
    stress = evaluate(gradient(lambda e: materials.mooney_rivlin(strains(e), constants), vector(e)))
    nominal = h * (mu1 + mu2 / stretch) * (stretch - 1 / stretch**2)
    assert stress[0] * stretch == pytest.approx(nominal, rel=1e-12)
    assert stress[1] == pytest.approx(0.0, abs=1e-14)


def ogden(e: Expr, *terms: tuple[float, float]) -> Expr:
    p = {"thickness": RUBBER["thickness"], "shear_correction": 5 / 6}
    for k, (mu, alpha) in enumerate(terms, 1):
        p |= {f"mu{k}": mu, f"alpha{k}": alpha}
    return materials.ogden(strains(e), {k: ufl.as_ufl(v) for k, v in p.items()})


# of Treloar's rubber, in MPa: R. W. Ogden (1972), p. 580
TRELOAR = ((0.63, 1.3), (0.0012, 5.0), (-0.01, -2.0))


@pytest.mark.parametrize("stretch", [1 + 1e-4, 4.0])
@pytest.mark.parametrize(
    ("across", "third"), [(-0.5, -0.5), (1.0, -2.0), (0.0, -1.0)], ids=["one", "both", "pure shear"]
)
def test_ogden_stress_of_treloar_s_three_tests(stretch: float, across: float, third: float) -> None:
    """`sum mu (l^(alpha - 1) - l^(third alpha - 1))` per area of the reference."""
    e = np.zeros(8)
    e[:2] = (stretch**2 - 1) / 2, (stretch ** (2 * across) - 1) / 2
    stress = evaluate(gradient(lambda e: ogden(e, *TRELOAR), vector(e))[0])
    nominal = sum(m * (stretch ** (a - 1) - stretch ** (third * a - 1)) for m, a in TRELOAR)
    # differences of powers near one
    assert float(stress) * stretch == pytest.approx(RUBBER["thickness"] * nominal, rel=1e-10)


def test_ogden_with_an_exponent_of_two_is_neo_hookean(rng: np.random.Generator) -> None:
    """Transverse shear included; strains of 1e-6 too, whose energy has as many digits."""
    for size in (1e-6, 1e-2, 0.2):
        e = vector(size * rng.normal(size=8))
        own, theirs = (lambda e: ogden(e, (RUBBER["mu"], 2.0))), rubber
        assert float(evaluate(own(e))) == pytest.approx(float(evaluate(theirs(e))), rel=1e-11)
        np.testing.assert_allclose(
            evaluate(gradient(own, e)), evaluate(gradient(theirs, e)), rtol=1e-8, atol=1e-11 * size
        )


def test_ogden_is_smooth_where_its_formulas_meet() -> None:
    """Stretches that differ by as much, and a little more or less, have one energy and stress."""
    found = []
    for part in (1 - 1e-9, 1 + 1e-9):
        # m/j - 1 of equal and opposite principal strains
        half = part * np.sqrt(2 * materials.ALIKE)
        e = np.zeros(8)
        e[0] = (np.exp(half) - 1) / 2
        e[1] = (np.exp(-half) - 1) / 2
        psi = lambda e: ogden(e, (0.63, 1.3))  # noqa: E731
        found.append([evaluate(psi(vector(e))), *evaluate(gradient(psi, vector(e)))])
    # what the strains differ by
    np.testing.assert_allclose(found[0], found[1], rtol=1e-8, atol=1e-12)


NORMAL, D = np.array([0.6, 0.0, 0.8]), np.array([0.0, 0.6, 0.8])
CONSTRAINTS = {
    "kink": lambda q: joints.locked_kink(q[0], q[1], ufl.as_ufl(0.3)),
    "plane": lambda q: joints.in_plane(q[0], vector(NORMAL)),
    "director": lambda q: director_constraint(q[0], vector(D)),
}


@pytest.mark.parametrize("name", CONSTRAINTS)
def test_the_mid_point_gradient_of_constraints_is_exact(
    name: str, rng: np.random.Generator
) -> None:
    """`g(b) - g(a) = Dg(mid)[b - a]`: the multipliers do no work while g = 0 holds."""
    a, b = rng.normal(size=(2, 6))

    def g(q: Expr) -> Expr:
        halves = [ufl.as_vector([q[k] for k in range(s, s + 3)]) for s in (0, 3)]
        return CONSTRAINTS[name](halves)

    slope = evaluate(gradient(g, vector((a + b) / 2)))
    change = float(evaluate(g(vector(b)))) - float(evaluate(g(vector(a))))
    assert slope @ (b - a) == pytest.approx(change, rel=1e-13)


def test_the_director_constraint_is_the_length(rng: np.random.Generator) -> None:
    w = rng.normal(size=3)
    assert float(evaluate(director_constraint(vector(w), vector(D)))) == pytest.approx(
        (np.linalg.norm(D + w) ** 2 - 1) / 2
    )


def test_the_frame_constraints_are_lengths_and_angles(rng: np.random.Generator) -> None:
    """Of directors `d = D + w`: half of `|d_k|^2 - 1`, and `d_k . d_m`; none of a turned frame."""
    reference, turned = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
    for d in (turned, rng.normal(size=(3, 3))):
        w = (d - reference).ravel()
        found = evaluate(orthonormality(vector(w), vector(reference.ravel())))
        products = d @ d.T - np.eye(3)
        wanted = [products[k, m] / (2 if k == m else 1) for k, m in PAIRS]
        np.testing.assert_allclose(found, wanted, atol=1e-14)


@pytest.mark.parametrize(
    ("cosine", "share"), [(-0.5, 0), (-0.02, 0), (0.02, 0.2), (0.05, 0.5), (0.2, 1), (1, 1)]
)
def test_what_dissipates_is_scaled_down_where_it_would_gain(cosine: float, share: float) -> None:
    """By the angle of motion and change of slope alone, not by how large these are."""
    change = 3.0 * np.array([cosine, np.sqrt(1 - cosine**2), 0.0])
    for size in (1e-6, 7.0):
        found = evaluate(convex(vector(change), vector(np.array([size, 0.0, 0.0]))))
        assert np.allclose(found, share * change, rtol=0, atol=1e-9)
