"""Forms that are alike share what is known of them, and no others do."""

from dataclasses import dataclass, replace
from functools import partial

from mpi4py import MPI

import dolfinx.mesh
import numpy as np
import pytest
import ufl
from dolfinx import fem

import shellmb as sm
from shellmb.native import kernels, later
from shellmb.native.alike import inputs
from shellmb.native.later import Later
from shellmb.running.loader import demos, load
from shellmb.simulate.simulation import Simulation
from tests.scenes import plate_scene

pytestmark = pytest.mark.usefixtures("compiled_forms")


@pytest.fixture(autouse=True)
def _forgotten(monkeypatch):
    """Nothing is known of forms at the start of a test."""
    monkeypatch.setattr(later, "_KNOWN", {})


@pytest.fixture
def made(monkeypatch):
    """All forms that are asked for something during a test."""
    found = []
    ask = Later.coefficients

    def asked(form):
        if not any(form is other for other in found):
            found.append(form)
        return ask(form)

    monkeypatch.setattr(Later, "coefficients", asked)
    return found


def is_written(form):
    return "written" in vars(form)


def assembled(form):
    """Vector of a linear form at states that have no symmetry."""
    for k, function in enumerate(form.coefficients()):
        function.x.array[:] = np.sin(1 + k + np.arange(len(function.x.array)))
    return fem.assemble_vector(kernels.compiled(form)).array


def chain_scene(elements):
    """A flexible link on a hinge, driven by a spring: beam, joint, frame and coordinate."""
    line = sm.Line((0, 0, 0), (1, 0, 0))
    section = sm.RectangularSection(210e9, 0.3, width=0.02, height=0.01, density=7850)
    hinge = sm.Revolute("hinge", sm.GROUND, "link", at=(0, 0, 0), axis=(0, 1, 0))
    return sm.Scene(
        "chain",
        beams=(sm.Beam("link", line, section, elements=elements),),
        joints=(hinge,),
        force_elements=(sm.JointSpring("spring", "hinge", stiffness=20.0),),
        scheme="ep4",
        dt=1e-3,
        t_end=2e-3,
    )


SCENES = {
    "ep": lambda n: plate_scene("ep", dt=0.1, t_end=0.2, mesh=(n, 1)),
    "ep4": lambda n: plate_scene("ep4", dt=0.1, t_end=0.2, mesh=(n, 1)),
    "mechanism": chain_scene,
}


@pytest.mark.parametrize("name", SCENES)
def test_a_companion_with_other_elements_writes_no_form(name, made):
    Simulation(SCENES[name](1), MPI.COMM_SELF)
    assert any(map(is_written, made))
    made.clear()
    with later.known_forms():
        Simulation(SCENES[name](2), MPI.COMM_SELF)
    assert made
    assert not any(map(is_written, made))
    for form in made:
        # what was taken from others is what the form has, up to the order of sums
        own = form.written
        right = assembled(own)
        assert np.abs(assembled(form) - right).max() <= 1e-12 * np.abs(right).max()
        for ask in ("coefficients", "constants", "arguments"):
            pairs = zip(getattr(form, ask)(), getattr(own, ask)(), strict=True)
            assert all(a is b for a, b in pairs), ask
        assert form.subdomain_data() == own.subdomain_data()


def test_the_next_model_of_a_process_writes_its_forms_anew(made):
    """Kind: an equation that is changed in a notebook, where the model before knew the old one."""
    Simulation(SCENES["ep"](1), MPI.COMM_SELF)
    made.clear()
    Simulation(SCENES["ep"](1), MPI.COMM_SELF)
    assert any(map(is_written, made))


def test_parameters_differ_and_what_they_switch_on_is_seen(made):
    """Numbers are Constants; what leaves a term out is another form, also on equal meshes."""
    scene = plate_scene("ep4", dt=0.1, t_end=0.2)
    (shell,) = scene.shells
    Simulation(scene, MPI.COMM_SELF)
    made.clear()
    thicker = replace(shell, section=replace(shell.section, thickness=2 * shell.section.thickness))
    with later.known_forms():
        Simulation(replace(scene, shells=(thicker,)), MPI.COMM_SELF)
    assert not any(map(is_written, made))
    made.clear()
    with later.known_forms():
        other = replace(shell, transverse_shear=False)
        Simulation(replace(scene, shells=(other,)), MPI.COMM_SELF)
    assert any(map(is_written, made))


def value(form):
    """Number, vector or matrix of a form."""
    compiled = kernels.compiled(form)
    if len(form.arguments()) == 0:
        return np.atleast_1d(fem.assemble_scalar(compiled))
    if len(form.arguments()) == 1:
        return fem.assemble_vector(compiled).array
    return fem.assemble_matrix(compiled).data


@pytest.mark.slow
def test_what_bundled_scenes_take_from_one_another_is_their_own(made):
    """Kind: two forms with one key that differ, in all bodies, joints and loads of scenes."""
    taken = 0
    with later.known_forms():
        for name in demos():
            made.clear()
            Simulation(load(name).build(), MPI.COMM_SELF)
            for form in [form for form in made if not is_written(form)]:
                taken += 1
                own = form.written
                for ask in ("coefficients", "constants", "arguments"):
                    pairs = zip(getattr(form, ask)(), getattr(own, ask)(), strict=True)
                    assert all(a is b for a, b in pairs), (name, form.written_from, ask)
                assert form.subdomain_data() == own.subdomain_data()
                for k, function in enumerate(own.coefficients()):
                    function.x.array[:] = np.sin(1 + k + np.arange(len(function.x.array)))
                right = value(own)
                # the order of sums
                bound = 1e-11 * np.abs(right).max(initial=0.0)
                assert np.abs(value(form) - right).max(initial=0.0) <= bound, (
                    name,
                    form.written_from,
                )
    # 620 at the time of writing
    assert taken > 300


MESH = dolfinx.mesh.create_unit_interval(MPI.COMM_SELF, 2)
FINER = dolfinx.mesh.create_unit_interval(MPI.COMM_SELF, 3)


def arguments(mesh=MESH, degree=1):
    space = fem.functionspace(mesh, ("Lagrange", degree))
    one, other = fem.Function(space), fem.Function(space)
    return mesh, one, other, fem.Constant(mesh, 2.0), ufl.dx(mesh)


def write(f, g, c, dx):
    return c * f * g * dx


def power(f, n, dx):
    return f**n * dx


def key(*of):
    found = inputs(*of)
    return None if found is None else found.key


def test_keys_differ_where_forms_do():
    # functions of a test are not ours: their parts are
    (_, f, g, c, dx), (_, p, q, e, dy) = arguments(), arguments(FINER)
    assert key(f, g, c, dx) == key(p, q, e, dy)
    assert key(f, g, c, dx) == key(g, f, c, dx), "they change names"
    others = [
        (f, f, c, dx),
        (f, g, 2.0, dx),
        (f, g, fem.Constant(MESH, np.ones(2)), dx),
        (f, arguments(degree=2)[1], c, dx),
        (f, q, c, dx),
        (f, g, c, dx(degree=3)),
        (f, g, c, dx(1)),
        (f, g, c, ufl.ds(MESH)),
        (f, ufl.TestFunction(f.function_space), c, dx),
    ]
    keys = [key(*of) for of in ((f, g, c, dx), *others)]
    assert None not in keys
    assert len(set(keys)) == len(keys)
    i, j, k, n = ufl.indices(4)
    x = ufl.as_matrix([[f, g], [g, c]])
    assert key(x[i, j] * x[i, j]) == key(x[k, n] * x[k, n]) != key(x[i, j] * x[j, i])


@dataclass
class Own:
    """A class of a user."""

    stiffness: float = 1.0


@pytest.mark.parametrize("of", [write, partial(write, 1), Own(), object(), np.ones(1000)])
def test_what_is_not_ours_has_no_key(of):
    assert key(of) is None


def test_what_has_no_key_is_written_each_time():
    """Functions of a user may look at anything."""
    mesh, f, _, _, dx = arguments()
    f.x.array[:] = 2.0
    for n in (2, 3):
        form = Later(power, f, n, dx)
        assert fem.assemble_scalar(kernels.compiled(form)) == pytest.approx(2.0**n)
        assert is_written(form)
    assert next(iter(form.subdomain_data())) is mesh.ufl_domain()


def test_sums_and_multiples_are_those_of_written_forms():
    _, f, g, c, dx = arguments()
    f.x.array[:], g.x.array[:] = 3.0, 5.0
    a, b = later.integral(f, dx), g * dx
    forms = [a + b, b + a, a - b, b - a, -a, c * a, sum([a, a])]
    for form, right in zip(forms, (8, 8, -2, 2, -3, 6, 6), strict=True):
        assert isinstance(form, Later)
        assert fem.assemble_scalar(kernels.compiled(form)) == pytest.approx(right)
    assert (a + b).coefficients() == (f, g)
    assert not (a + b).empty()
