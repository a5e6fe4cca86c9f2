"""Off means absent, effect by effect, in the small scenes that `tests.bench --effects` times."""

import subprocess
import sys
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import pytest

from shellmb.demos.effects.catalogue.registry import EFFECTS, changed
from shellmb.demos.effects.count import count, kernels_of
from shellmb.demos.effects.stepping import Stepping
from shellmb.native.kernels import watched
from shellmb.scene import FromMode, Scene
from shellmb.simulate.simulation import Simulation
from tests.bench.effects.rows import CASES, NO_ROW

MESH = (2, 1)
# what a scene has more with an effect than without it: unknowns, integrals, coefficients, kernels
MORE = {
    # a force with its factor of time; weight also has the density, and no program of its own, since
    # all that is in the same rows is one
    "gravity": (0, 1, 3, 0),
    # the state in it, too
    "follower_load": (0, 1, 3, 0),
    # a stress with its factor, on the strains of the state, by each of the section's rules
    "natural_strain": (0, 4, 8, 0),
    # the force depends on the velocity: no number of its own
    "added_terms": (0, 1, 0, 0),
    # forces of a row, which are terms: no form of the residual itself
    "material_damping": (0, 0, 0, 0),
    # by the rules of the mass and of its moments; its rate
    "mass_damping": (0, 2, 1, 0),
    # multipliers: as many as freedoms are taken; frames at both ends, and where and how they are
    "spherical_joint": (3, 1, 4, 2),
    # the other joint of the scene is of its kind, and all of a kind are one form
    "revolute_joint": (5, 0, 0, 0),
    "universal_joint": (4, 1, 5, 2),
    "cylindrical_joint": (4, 1, 5, 2),
    "prismatic_joint": (5, 1, 5, 2),
    "planar_joint": (3, 1, 5, 2),
    "weld_joint": (6, 1, 5, 2),
    "distance_joint": (1, 1, 6, 2),
    "in_plane_joint": (1, 1, 5, 2),
    "shell_revolute_joint": (5, 1, 5, 2),
    # three nodes with three rows each, a vector of three with as many rows, an angle with its own
    "edge_hinge_joint": (3 * (3 + 6 + 2), 3, 14, 6),
    # contact coordinates, 11 of a sphere and 4 of a blade, and their equations; a sphere has 14
    "rolling_joint": (25, 1, 8, 2),
    "knife_edge_joint": (10, 1, 8, 2),
    # with the angle and the way, two unknowns each, that are in proportion
    "screw_joint": (9, 4, 19, 8),
    "joint_windows": (0, 0, 1, 0),
    "driver": (2, 1, 5, 2),
    # one multiplier; the angle that it holds, with its equation
    "lock": (3, 2, 9, 4),
    # its law depends on time: it is there at three instants of a step
    "motor": (2, 4, 14, 4),
    # a motor with its torque for a parameter, and no law
    "controller": (2, 2, 6, 3),
    # the angle that is watched, with its equation
    "event": (2, 1, 5, 2),
    # the length and its equation
    "spring": (2, 2, 9, 4),
    "damper": (2, 2, 10, 4),
    # the coordinate, its equation, and the five numbers of a stop
    "joint_stop": (2, 2, 14, 4),
    # no unknown of its own: the places of nodes
    "potential": (0, 1, 8, 2),
    "contact": (0, 1, 11, 2),
    # the pressure and the change of the volume; cones, what fills them, and the energy of the gas
    "enclosed_volume": (2, 3, 11, 4),
}
# looked into in test_absent.py
BEFORE = {
    *("inertia", "rotary_inertia", "eccentric_inertia", "dissipation", "flexibility", "stretching"),
    *("transverse_shear", "coupling", "nonlinear_material", "dead_load"),
    *("joint_spring", "joint_damper", "joint_mass"),
}
# looked into below, one by one
SINGLE = {
    *("initial_velocity", "adaptivity", "path_following", "equilibrium_start", "assembly"),
    "state_start",
    *(
        "geometric_nonlinearity",
        "own_strains",
        "prescribed_motion",
        "large_deformation",
        "all_modes",
        "supports",
        "joins",
        "glues",
    ),
    *("modes_in_rotation", "modes_of_states", "linear_buckling"),
}
# there is nothing to leave out
NEVER = {"bending", "drilling"}

# no body of their own: of the kind of the scene's other hinge; a factor in its forms; a coordinate
SHARED = {"revolute_joint", "joint_windows", "driver"}
VALUES = {"revolute_joint"}


def both(name: str) -> tuple[Simulation, Simulation]:
    """The case of an effect, with it and without it."""
    scene, less = CASES[name].pair("ep", MESH)
    # not kept for other tests: MPI has no more than 2048 communicators, and each mesh takes some
    return Simulation(scene), Simulation(less)


def needed(scene: Scene) -> set[str]:
    """Names of all kernels that a scene compiles, or finds in the cache, before its first step."""
    with watched() as found:
        Simulation(scene)
    return found


def kernels(simulation: Simulation) -> set[str]:
    """Names of the kernels of the block system."""
    system = simulation.problem.system
    rows = [form for form, _ in system.residual_forms]
    return kernels_of([*rows, *(form for forms in system.jacobians.values() for form in forms)])


def linked(simulation: Simulation) -> int:
    """Number of unknowns that belong to two fields."""
    return sum(len(link.dofs) for field in simulation.problem.fields for link in field.links)


def test_every_effect_is_looked_into() -> None:
    observers = {name for name, effect in EFFECTS.items() if effect.observer is not None}
    groups = [set(MORE), BEFORE, SINGLE, NEVER, observers]
    assert sorted(EFFECTS) == sorted(name for group in groups for name in group)
    # the bench has a row for each that a step pays for
    assert set(CASES) | set(NO_ROW) == set(EFFECTS)
    assert not set(CASES) & set(NO_ROW)


@pytest.mark.parametrize("name", MORE)
def test_what_is_left_out_has_no_part_in_a_step(name) -> None:
    having, lacking = both(name)
    more = count(having.problem) - count(lacking.problem)
    found = (more.unknowns, more.integrals, more.coefficients, more.kernels)
    assert found == MORE[name]
    # programs have their names by what they do: without the effect other ones, but where all of it
    # is in values, or where it is one of several of a kind
    assert (kernels(having) != kernels(lacking)) == (name not in VALUES)
    if EFFECTS[name].group in ("joints", "force elements") and name not in SHARED:
        # a kind is a body of its own: its functions, its rows, its kernels; the rest is the same
        own = EFFECTS[name].bodies
        assert any(body.name.startswith(own) for body in having.model.bodies)
        assert not any(body.name.startswith(own) for body in lacking.model.bodies)
        assert not any(field.name.startswith(own) for field in lacking.problem.fields)
        assert kernels(lacking) < kernels(having)


def test_supports_are_dofs_that_are_held() -> None:
    having, lacking = both("supports")
    assert not len(lacking.problem.fields[0].fixed)
    # of the three nodes of the edge the displacement, the director and its multiplier
    assert len(having.problem.fields[0].fixed) == 3 * (3 + 3 + 1)
    assert kernels(having) == kernels(lacking)


# what is without its join is what is counted
@pytest.mark.filterwarnings("ignore:shells 'plate' and 'second' touch")
def test_joins_and_glues_are_shared_unknowns() -> None:
    nodes, per_node = 3, 3 + 3 + 1
    having, lacking = both("joins")
    assert (linked(having), linked(lacking)) == (nodes * per_node, 0)
    more = count(having.problem) - count(lacking.problem)
    assert more.unknowns == -nodes * per_node
    assert (more.integrals, more.coefficients, more.kernels) == (0, 0, 0)
    having, lacking = both("glues")
    assert linked(having) > 0 and linked(lacking) == 0
    assert not any(body.name.startswith("shell revolute") for body in lacking.model.bodies)
    assert (count(having.problem) - count(lacking.problem)).kernels == 2


def test_a_support_that_does_not_move_has_no_motion() -> None:
    moved, held = both("prescribed_motion")
    for simulation, moves in ((moved, True), (held, False)):
        found = [fixed.moving for body in simulation.model.bodies for fixed in body.fixed]
        assert any(found) == moves
    assert kernels(moved) == kernels(held)


def test_a_linear_jacobian_lasts() -> None:
    large, small = both("geometric_nonlinearity")
    # one factorisation for all steps
    assert not large.problem.iteration.refresh.lasts
    assert small.problem.iteration.refresh.lasts


def test_a_body_in_modes_has_no_nodes() -> None:
    """Nor kernels of shells in its steps; what finds the modes is compiled besides."""
    # the smallest mesh has hardly more unknowns than ten modes
    exact, modal = map(Simulation, CASES["all_modes"].pair("ep", (4, 2)))
    assert modal.problem.system.size < exact.problem.system.size
    assert not modal.model.shells
    assert not any(body.name.startswith(("modes", "inertia")) for body in exact.model.bodies)
    assert not kernels(modal) & kernels(exact)


def test_an_exact_body_has_no_frame() -> None:
    exact, linear = both("large_deformation")
    assert not {"frame", "hold"} & exact.model.shells["plate"].mixed.parts.keys()
    assert not exact.model.shells["plate"].ties
    # nine numbers of a frame, and what holds it
    assert linear.problem.system.size == exact.problem.system.size + 18


def test_load_steps_have_no_path() -> None:
    having, lacking = both("path_following")
    assert having.path is not None and lacking.path is None
    assert kernels(lacking) == kernels(having)
    # a load step neither needs nor makes the derivative by the load
    assert having.stepping is having.path and lacking.problem.load_factor is None


def test_fixed_steps_are_neither_judged_nor_repeated() -> None:
    having, lacking = both("adaptivity")
    assert having.size.too_large(1.0) and not lacking.size.too_large(1.0)
    assert not lacking.size.reject(lacking.size.dt)
    assert kernels(having) == kernels(lacking)
    # without the state j there is not even a jump to look at
    assert Simulation(CASES["supports"].make("ep", MESH))._jump() is None


def test_strains_of_the_paper_have_their_own_kernels() -> None:
    having, lacking = both("own_strains")
    assert kernels(having) != kernels(lacking)
    plain = Simulation(CASES["supports"].make("ep", MESH))
    assert kernels(lacking) == kernels(plain)


def test_velocities_at_the_start_are_values(plate, free) -> None:
    flying = free()
    assert needed(flying) == needed(changed(flying, ["initial_velocity"], []))


def test_what_happens_before_the_first_step_has_kernels_of_its_own(pendulum) -> None:
    """An equilibrium is a static problem; joints that are closed need no assembly."""
    held = pendulum(assemble=True, redundant="drop")
    assert needed(held) == needed(changed(held, ["assembly"], []))
    hanging = pendulum(start="equilibrium")
    fewer = needed(changed(hanging, ["equilibrium_start"], []))
    assert fewer < needed(hanging)
    assert fewer == needed(pendulum())
    moved = pendulum(start=FromMode(1, 1e-6))
    assert needed(changed(moved, ["state_start"], [])) == fewer < needed(moved)


def test_observers_compile_what_they_look_at(plate, tmp_path) -> None:
    """A run without observers has none of their kernels, and they none where nothing is seen."""

    def looked(scene: Scene, name: str) -> set[str]:
        stepping = Stepping(scene, tmp_path / name)
        stepping.finish()
        kernels = {name: timed.kernels for name, timed in stepping.observers.items()}
        assert set().union(*kernels.values()) - needed(scene)
        return {name for name, found in kernels.items() if found}

    # where a body in motion stores most energy its elements are compared with better ones
    moving = {"energy", "momentum", "watch of coarse mesh"}
    assert looked(plate(), "moving") == moving
    still: dict[str, Any] = {"scheme": "static", "dt": None, "t_end": None, "probes": ()}
    assert looked(plate(**still), "still") == moving - {"momentum"}
    # forces of joints are found with kernels that the scene has anyway
    hinged = CASES["observe_joints"].make("ep", MESH)
    assert looked(hinged, "hinged") == {"energy", "momentum"}


def test_modes_beside_runs_are_not_even_loaded() -> None:
    """Their terms and kernels are those of modules that a run does not know."""
    code = "import sys, shellmb.running.execute as e; e.Simulation; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout
    assert b"shellmb.running.execute" in loaded
    assert b"shellmb.running.rotating" not in loaded
