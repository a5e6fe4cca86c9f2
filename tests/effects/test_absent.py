"""Off means absent: no unknown, no coefficient, no integral, no kernel, no function."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import pytest
from dolfinx import fem

from shellmb.demos.effects.catalogue.registry import changed
from shellmb.demos.effects.count import coefficients, count, kernels_of
from shellmb.demos.verification.solve import displacement
from shellmb.model.body import kinetic_energy
from shellmb.native.kernels import watched
from shellmb.scene import Gravity, Hyperelastic, JointSpring, Scene
from shellmb.simulate.simulation import Simulation

STILL: dict[str, Any] = {"scheme": "static", "dt": None, "t_end": None}

_MADE: dict[str, Simulation] = {}


@pytest.fixture(scope="module", autouse=True)
def _forget() -> Iterator[None]:
    """Behind these tests nothing is kept: some sixty meshes have half of MPI's communicators."""
    yield
    _MADE.clear()


def built(key: str, scene: Scene) -> Simulation:
    """A scene built once."""
    if key not in _MADE:
        _MADE[key] = Simulation(scene)
    return _MADE[key]


def written(simulation: Simulation) -> list[Any]:
    """All residuals as they are written in UFL."""
    fields = simulation.problem.fields
    terms = [term.residual for field in fields for term in field.terms]
    return [form for field in fields for form in field.residual] + terms


def shapes(simulation: Simulation) -> list[tuple[int, ...]]:
    """Shapes of the constants in the residuals."""
    found = coefficients(written(simulation))
    return sorted(c.ufl_shape for c in found if isinstance(c, fem.Constant))


def functions(simulation: Simulation) -> set[str]:
    """Names of the functions in the residuals."""
    return {c.name for c in coefficients(written(simulation)) if isinstance(c, fem.Function)}


def without(key: str, make: Callable[..., Scene], name: str, **given: Any) -> tuple[Any, Any]:
    """A scene as it is, and without an effect."""
    scene = make(**given)
    less = changed(scene, [name], [])
    return built(key, scene), built(f"{key} without {name}", less)


def test_a_static_scene_has_no_velocities(plate) -> None:
    moving, still = without("plate", plate, "inertia")
    for levels in still.problem.levels.values():
        assert not levels.rates
    assert {"q_plate", "v_plate"} <= functions(moving)
    # not even the state at the start of the step is in its forms
    assert not {"q_plate", "v_plate"} & functions(still)
    assert moving.model.shells["plate"].mass is not None
    assert still.model.shells["plate"].mass_of_section is None
    assert "projection" not in vars(still.problem)
    # beside the states of earlier steps, by which the next one is guessed
    assert [name for name in still.arrays() if not name.startswith("past/")] == ["plate/q"]
    more, less = count(moving.problem), count(still.problem)
    assert more.stored == 2 * less.stored
    # mass and rotary inertia
    assert more.integrals - less.integrals == 2
    # m, I*, dt; the state and the velocity at the start
    assert more.coefficients - less.coefficients == 5


def test_a_static_mechanism_has_no_velocities(pendulum) -> None:
    # statics asks for something that holds the hinge, too
    springs = [JointSpring(f"at {joint}", joint, stiffness=10.0) for joint in ("pin", "hinge")]
    scene = changed(pendulum(force_elements=springs), ["inertia"], [])
    still = built("static pendulum", scene)
    assert all(not levels.rates for levels in still.problem.levels.values())
    assert not any(name.startswith("v_") for name in functions(still))
    # of the joint's mass only the weight is left
    masses = [body for body in still.model.bodies if body.name.startswith("joint masses")]
    assert {kinetic_energy(m, still.problem.state(m.name)) for m in masses} == {None}
    assert "projection" not in vars(still.problem)


def test_rotary_inertia_is_an_integral_and_a_constant(plate) -> None:
    with_it, off = without("plate", plate, "rotary_inertia")
    difference = count(with_it.problem) - count(off.problem)
    assert (difference.integrals, difference.coefficients) == (1, 1)
    assert off.model.shells["plate"].mass.I is None


def test_eccentric_inertia_is_a_constant(plate, eccentric) -> None:
    with_it, off = without("eccentric", plate, "eccentric_inertia", section=eccentric)
    assert (count(with_it.problem) - count(off.problem)).coefficients == 1
    assert with_it.model.shells["plate"].mass.s is not None
    assert off.model.shells["plate"].mass.s is None
    assert off.model.shells["plate"].mass.I is not None


@pytest.mark.parametrize(
    ("name", "gone", "come"),
    [
        ("coupling", [(3, 3)], []),
        ("transverse_shear", [(2, 2)], [()]),
        # without stretching there is nothing to be coupled to
        ("stretching", [(3, 3), (3, 3)], [()]),
    ],
)
def test_parts_of_the_energy_are_stiffnesses(name, gone, come, plate, unsymmetric) -> None:
    """`B`; the inverse of `G`; the inverse of `A` with `B`; what holds strains has a slack."""
    with_it, off = without("static", plate, name, section=unsymmetric, **STILL)
    expected = shapes(with_it)
    for shape in gone:
        expected.remove(shape)
    assert shapes(off) == sorted(expected + come)


def test_a_linear_material_has_no_assumed_strains(plate) -> None:
    def energy(strains: Any, p: Any) -> Any:
        return p["mu"] * sum(x * x for part in strains for x in (part[k] for k in range(2)))

    rubber = Hyperelastic(energy, {"mu": 1e4}, thickness=0.01, density=1000.0, stiffness=1e4)
    linear = built("static steel", plate(**STILL))
    other = built("static rubber", plate(section=rubber, **STILL))
    assert "S" in other.model.shells["plate"].mixed.parts
    assert "S" not in linear.model.shells["plate"].mixed.parts
    assert linear.problem.system.size < other.problem.system.size


def test_dissipation_is_a_state_and_its_rows(plate) -> None:
    damped, off = without("damped", plate, "dissipation", scheme="ed")
    assert damped.problem.system.size == 2 * off.problem.system.size
    assert damped.problem.iteration.linear.size == 2 * off.problem.iteration.linear.size
    assert "q_j_plate" in functions(damped) - functions(off)
    more, less = count(damped.problem), count(off.problem)
    assert more.integrals >= 2 * less.integrals
    # the section's forces have the kernels of all schemes
    assert more.kernels > less.kernels


def test_loads_are_integrals(plate) -> None:
    loaded, off = without("plate", plate, "dead_load")
    difference = count(loaded.problem) - count(off.problem)
    # the force, and its time factor; all that is in the same rows is one program
    assert (difference.integrals, difference.coefficients, difference.kernels) == (1, 2, 0)
    heavy = built("heavy", changed(plate(), [], ["gravity"]))
    more = count(heavy.problem) - count(loaded.problem)
    assert more.integrals == 1 and more.unknowns == 0


def tangent(simulation: Simulation) -> set[str]:
    """Names of the programs of the Jacobian."""
    return kernels_of(f for some in simulation.problem.system.jacobians.values() for f in some)


def test_a_dead_load_has_no_stiffness_and_a_pressure_has(plate) -> None:
    from shellmb.scene import Pressure

    made = built("pushed", plate(loads=Pressure(10.0))), built("plate", plate())
    pushed, dead, none = (tangent(s) for s in (*made, built("free", plate(loads=()))))
    assert dead == none != pushed


@pytest.mark.parametrize(
    ("name", "prefixes", "unknowns"),
    [
        # the coordinate of the joint, with its equation, goes with the element
        ("joint_spring", ("springs",), 2),
        ("joint_damper", ("dampers",), 2),
        ("joint_mass", ("joint masses",), 0),
    ],
)
def test_elements_are_bodies_of_their_own(name, prefixes, unknowns, pendulum) -> None:
    with_it, off = without("pendulum", pendulum, name)
    assert any(body.name.startswith(prefixes) for body in with_it.model.bodies)
    assert not any(body.name.startswith(prefixes) for body in off.model.bodies)
    difference = count(with_it.problem) - count(off.problem)
    assert difference.unknowns == unknowns
    assert difference.integrals > 0
    assert difference.kernels >= 0


def test_a_joint_is_its_multipliers(pendulum) -> None:
    scene = pendulum(force_elements=())
    with_it = built("joined", scene)
    off = built("apart", changed(scene, ["revolute_joint:hinge"], []))
    difference = count(with_it.problem) - count(off.problem)
    # five of the eleven freedoms of two bodies at a hinge
    assert difference.unknowns == 5
    assert difference.kernels > 0


def test_a_rigid_body_has_no_mesh_of_unknowns(pendulum) -> None:
    """A frame of three positions, nine components and six multipliers."""
    soft, stiff = without("pendulum", pendulum, "flexibility")
    assert not stiff.model.beams
    assert "bar" not in stiff.problem.levels
    nodes, cells = 3, 1
    assert soft.problem.system.size - stiff.problem.system.size == 18 * nodes + 6 * cells - 18


def test_programs_that_are_not_needed_are_not_made(plate) -> None:
    """What is read as a scene is built."""
    with watched() as all_of_them:
        Simulation(plate(scheme="ed"))
    with watched() as fewer:
        Simulation(plate())
    with watched() as fewest:
        Simulation(plate(loads=(), **STILL))
    # residual and Jacobian; with inertia those of other forms; in ED both rows have their own
    assert len(fewest) == len(fewer) == 2 and not fewest & fewer
    assert len(all_of_them) > len(fewer)


def test_observers_have_kernels_of_their_own_only_where_they_look(plate) -> None:
    from shellmb.observers.account.energy import EnergyAccount

    still, moving = built("static steel", plate(**STILL)), built("plate", plate())
    found = []
    for simulation in (still, moving):
        with watched() as kernels:
            EnergyAccount().start(simulation)
        found.append(len(kernels))
    assert 0 < found[0] < found[1]


def test_a_section_is_not_touched_by_switches(plate) -> None:
    """Equal scenes have equal kernels: options that say what is so anyway change nothing."""
    scene = plate(**STILL)
    same = replace(scene, shells=replace(scene.shells[0], coupling=False, eccentric_inertia=False))
    with watched() as first:
        Simulation(scene)
    with watched() as second:
        Simulation(same)
    assert first == second


@pytest.mark.parametrize("name", ["rotary_inertia", "eccentric_inertia"])
def test_inertia_left_out_leaves_the_weight(name, plate, eccentric) -> None:
    """A weight along the plate acts in its middle surface, whatever of its inertia is left out.

    There it stretches the plate alone. On the reference surface, to which the nodes belong, its
    moment would bend the plate.
    """
    pull, width = Gravity((9.81, 0.0, 0.0)), eccentric.thickness
    weight = eccentric.density * width * 9.81
    stretch = weight / (2 * eccentric.E * width)
    bent = weight * eccentric.offset / (eccentric.E * width**3 / 4)
    for shell in ({}, {name: False}):
        run = Simulation(
            plate(
                section=eccentric, loads=pull, shell=shell, **STILL | {"scheme": "linear-statics"}
            )
        )
        run.run()
        tip = displacement(run, (1.0, 0.0, 0.0))
        # the clamped edge cannot contract
        assert tip[0] == pytest.approx(stretch, rel=0.1)
        assert abs(tip[2]) < 1e-6 * bent
