"""Contact of shells with shells and with themselves: what it keeps, and what it may not depend on.

The kind: whatever the step, energy comes back, and both momenta stay; units, axes, meshes and which
body has the points do not matter.
"""

from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
from numpy.testing import assert_allclose

from shellmb.errors import ConvergenceError, SceneError
from shellmb.forms import contact
from shellmb.model.model import Model
from shellmb.running.execute import execute
from shellmb.scene import (
    Contact,
    EdgeForce,
    Faces,
    InitialVelocity,
    Isotropic,
    Parametric,
    Rectangle,
    Scene,
    Shell,
    Solver,
    StepControl,
)
from shellmb.simulate.simulation import Simulation

SLOW = pytest.mark.slow
SCHEMES = [("ep", None), *[pytest.param(s, a, marks=SLOW) for s, a in (("ep4", None), ("ed", 0.5))]]
SCHEMES += [pytest.param("ed3", 0.5, marks=SLOW)]
THICK, SIDE, GAP, SPEED = 5e-3, 0.2, 1e-4, 0.5
# mass per area 13.5 kg/m^2: an impact of 0.8 ms
K = 1e8
TURNED = np.array([[2.0, 2.0, 1.0], [-2.0, 1.0, 2.0], [1.0, -2.0, 2.0]]) / 3


def plates(
    units: float = 1.0,
    axes: Any = None,
    spin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    shift: tuple[float, float] = (0.017, 0.024),
    points: str = "up",
    meshes: tuple[int, int] = (2, 2),
    stiff: float = 1.0,
    **more: Any,
) -> Scene:
    """Two free plates that meet.

    Args:
        units: Units of length in a metre; a unit of mass is as many kilograms.
        axes: Axes of the scene as rows.
        spin: Of the upper plate, in these axes, rad/s.
        shift: Of the upper plate along the lower one, m.
        points: Which one has the points that touch.
        meshes: Elements along the sides of both.
        stiff: Times Young's modulus of aluminium.
        more: Of the scene.
    """
    R = np.eye(3) if axes is None else axes.T

    def place(*x: float) -> Any:
        return tuple(units * (R @ np.array(x)))

    def way(*x: float) -> Any:
        return tuple(R @ np.array(x))

    # forces are the same numbers; a unit of mass is 1/units kilograms
    section = Isotropic(
        stiff * 70e9 / units**2, 0.3, thickness=THICK * units, density=2700.0 / units**4
    )
    across = {"axis1": way(1, 0, 0), "axis2": way(0, 1, 0)}
    shells = [
        Shell(name, Rectangle(SIDE * units, SIDE * units, origin=o, **across), section, mesh=(n, n))
        for name, o, n in (
            ("low", place(0, 0, 0), meshes[0]),
            ("up", place(*shift, THICK / 2 + GAP), meshes[1]),
        )
    ]
    other = {"up": "low", "low": "up"}[points]
    touch = Contact(
        "touch",
        Faces(other, THICK * units),
        stiffness=K / units**3,
        body=points,
        smoothing=2e-5 * units,
    )
    start = (
        InitialVelocity(place(0, 0, SPEED / 2), body="low"),
        InitialVelocity(place(0, 0, -SPEED / 2), way(*spin), body="up"),
    )
    given = {"scheme": "ep", "dt": 1e-4, "t_end": 1.5e-3, "contacts": touch, "initial": start}
    return Scene("plates", shells, solver=Solver(tolerance=1e-11), **(given | more))


def momenta(found: Any) -> tuple[Any, Any]:
    """Linear and angular momentum, shape (n, 3) each."""
    names = [f"{kind}_{a}" for kind in ("momentum", "angular_momentum") for a in "xyz"]
    linear, angular = np.split(found.history[names].to_numpy(), 2, axis=1)
    return linear, angular


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_the_law_is_that_of_the_forms(
    scheme: str, alpha: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Kind: what is written twice. A factor in `forms.contact.energy` is one in the stiffness."""
    once = plates(scheme=scheme, alpha=alpha, t_end=5e-4)
    (touch,) = once.contacts
    stiffer = execute(replace(once, contacts=replace(touch, stiffness=1.5 * K))).history
    plain = execute(once).history
    law = contact.energy
    monkeypatch.setattr(contact, "energy", lambda p, k, s: 1.5 * law(p, k, s))
    changed = execute(once).history
    for name in ("touch.energy", "touch.Fz", "kinetic_energy"):
        # round-off of sums in another order
        size = np.nanmax(np.abs(stiffer[name]))
        assert_allclose(changed[name], stiffer[name], rtol=0, atol=1e-9 * size)
    found, before = changed["touch.energy"], plain["touch.energy"]
    assert np.max(np.abs(found - before)) > 0.1 * np.max(before)
    # what the tolerance of Newton's method leaves, far above the 1e-13 that was seen
    assert np.max(np.abs(changed["energy_balance"])) < 1e-10 * changed["total_energy"][0]


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_energy_and_momenta(scheme: str, alpha: float | None) -> None:
    """EP keeps all of them to round-off; EP4 keeps angular momentum to its order, 4."""
    found = execute(plates(spin=(0.5, -0.3, 0.5), t_end=1.8e-3, scheme=scheme, alpha=alpha))
    history, energy = found.history, found.history.total_energy
    assert history["touch.energy"].max() > 0.1 * energy[0]
    # they have parted again
    assert history["touch.energy"].iloc[-1] == 0
    assert found.summary["energy_balance_error"] < 1e-9
    if scheme in ("ep", "ep4"):
        assert_allclose(energy, energy[0], rtol=1e-10)
    else:
        assert np.max(np.diff(energy)) < 1e-10 * energy[0]
    linear, angular = momenta(found)
    size = 2700.0 * THICK * SIDE**2 * SPEED
    assert_allclose(linear, np.tile(linear[0], (len(linear), 1)), atol=1e-11 * size)
    bound = {"ep": 1e-11, "ep4": 1e-6}.get(scheme, 1e-4)
    assert_allclose(angular, np.tile(angular[0], (len(angular), 1)), atol=bound * size * SIDE)


@pytest.mark.parametrize(
    "change",
    [
        pytest.param({"units": 1000.0}, marks=SLOW),
        pytest.param({"axes": TURNED}, marks=SLOW),
        pytest.param({"units": 1e-3, "axes": TURNED, "scheme": "ep4"}, marks=SLOW),
    ],
)
def test_units_and_axes(change: dict[str, Any]) -> None:
    """Forces are the same numbers in other units and axes, to what Newton's method leaves."""
    scheme = {"scheme": change.get("scheme", "ep"), "spin": (3.0, -2.0, 5.0)}
    one, other = (execute(plates(**(scheme | more))).history for more in ({}, change))
    assert one["touch.normal"].max() > 10
    force = one["touch.normal"].max()
    assert_allclose(other["touch.normal"], one["touch.normal"], atol=1e-8 * force)
    depth = one["touch.penetration"] * change.get("units", 1.0)
    assert_allclose(other["touch.penetration"], depth, atol=1e-8 * depth.max())


@pytest.mark.slow
def test_it_does_not_matter_which_has_the_points() -> None:
    """Impulses with points on either plate agree as meshes become fine, and with half the step."""
    impulse = []
    for points, n, dt in (("up", 4, 1e-4), ("low", 4, 1e-4), ("up", 4, 5e-5)):
        found = execute(plates(points=points, meshes=(n, n), dt=dt)).history
        impulse.append(dt * found["touch.Fz"][1:].sum() * (1 if points == "up" else -1))
    assert impulse[1] == pytest.approx(impulse[0], rel=0.05)
    assert impulse[2] == pytest.approx(impulse[0], rel=1e-2)


@pytest.mark.slow
def test_plates_that_cover_one_another_exchange_their_velocities() -> None:
    """The pressure of equal plates is uniform: they are thrown back as rigid ones are.

    Points above corners of facets feel up to eight of them, and those at edges fewer: that makes a
    difference of 1e-4 of the distance at which they touch, and waves whose energy is the smaller
    the stiffer the plates are.
    """
    simulation = Simulation(plates(scheme="ep4", shift=(0.0, 0.0), stiff=1e4))
    simulation.run()
    for name, way in (("low", -1.0), ("up", 1.0)):
        levels = simulation.problem.levels[name]
        dofs = simulation.model.shells[name].mixed.dofs["u"].reshape(-1, 3)
        v = levels.rates["v"].x.array[dofs].mean(axis=0)
        assert_allclose(v, (0, 0, way * SPEED / 2), atol=1e-6 * SPEED)


def test_a_point_that_passes_through_in_a_step_is_not_missed() -> None:
    """At 40 m/s and 1 ms the plate would be 35 mm behind the other one after the first step."""
    fast = InitialVelocity((0, 0, -40.0), body="up")
    scene = plates(initial=fast, dt=1e-3, t_end=2e-3, step_control=StepControl(min_dt=5e-4))
    with pytest.raises(ConvergenceError, match=r"contact 'touch': the point of 'up' that was at"):
        Simulation(scene).run()


def test_edges_that_pass_through_edges_are_said() -> None:
    """A strip across another one has no point above it, and falls through.

    Its sides are inclined, and so pass through the other one for two steps; parallel ones never do.
    """

    def oblique(a: Any, b: Any) -> Any:
        return 0.02 * a - 0.01, 0.4 * b - 0.28, 0.004 + 0.1 * (0.4 * b - 0.28)

    section = Isotropic(70e9, 0.3, thickness=THICK, density=2700.0)
    strips = [
        Shell("low", Rectangle(0.4, 0.02, origin=(-0.2, -0.01, 0)), section, mesh=(1, 1)),
        Shell("up", Parametric(oblique), section, mesh=(1, 1)),
    ]
    touch = Contact("touch", Faces("low", THICK), stiffness=K, body="up", smoothing=2e-5)
    scene = Scene(
        "crossed",
        strips,
        contacts=touch,
        initial=InitialVelocity((0, 0, -1.0), body="up"),
        scheme="ep",
        dt=1e-3,
        t_end=6e-3,
    )
    found = [w for w in execute(scene).warnings if w.watch == "faces of shells"]
    assert len(found) == 1
    assert "'up' and 'low' intersect between the points that touch" in found[0].says


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"smoothing": 0.0}, "contact 'touch': smoothing is 0; with the faces of a shell it must"),
        ({"smoothing": 2e-3}, "smoothing is 0.002; it must be less than half of the distance"),
        ({"preloaded": True}, "preloaded is True; with the faces of a shell it must be left out"),
        ({"obstacle": Faces("floor", 1e-3)}, "shell of the faces: there is no shell 'floor'"),
        ({"obstacle": Faces("low", 6e-3)}, "16 of 25 points of 'up' start in 'low'"),
        ({"body": "low"}, None),
        ({"radius": 1e-3}, "points of 'up' start in 'low', the one at .* by 0.0009 m; they must"),
    ],
)
def test_refused(change: dict[str, Any], says: str | None) -> None:
    scene = plates()
    touch = replace(scene.contacts[0], **change)
    if says is None:
        # points of a shell on its own faces start in no other part of it
        Model(replace(scene, contacts=touch), MPI.COMM_WORLD)
        return
    with pytest.raises(SceneError, match=says):
        Model(replace(scene, contacts=touch), MPI.COMM_WORLD)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Faces("low", 0.0), "faces: thickness is 0.0; it must be greater than 0"),
        (lambda: Faces("low", -1e-3), "faces: thickness is -0.001; it must be greater than 0"),
        (lambda: Contact("c", Faces("low", 1e-3), K, friction=-0.1), "friction is -0.1; it must"),
        (lambda: Contact("c", Faces("low", 1e-3), K, friction=0.1), "slip_speed is missing"),
        (lambda: Contact("c", Faces("low", 1e-3), 0.0), "stiffness is 0.0; it must be greater"),
        (
            lambda: plates(contacts=Contact("c", Faces("low", 1e-3), K, "lid", smoothing=1e-5)),
            "contact 'c': there is no shell 'lid'",
        ),
    ],
)
def test_bad_numbers(make: Any, says: str) -> None:
    with pytest.raises(SceneError, match=says):
        make()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"scheme": "generalized-alpha"}, "the scheme is 'generalized-alpha'; with the faces of a"),
        ({"scheme": "linear-dynamics"}, "with scheme 'linear-dynamics' displacements are small"),
    ],
)
def test_refused_schemes(change: dict[str, Any], says: str) -> None:
    with pytest.raises(SceneError, match=says):
        plates(**change)


def bent(scheme: str = "ep", **more: Any) -> Scene:
    """A strip that is bent to a U, whose ends are pressed against one another."""
    radius, leg, width, thick = 0.01, 0.06, 0.02, 1e-3
    length = 2 * leg + np.pi * radius

    def place(xi: Any, eta: Any) -> Any:
        s = length * xi
        a = np.clip((s - leg) / radius, 0.0, np.pi)
        back = np.maximum(s - leg - np.pi * radius, 0.0)
        x = np.minimum(s, leg) + radius * np.sin(a) - back
        return np.array([x, width * eta, -radius * np.cos(a)])

    section = Isotropic(1e9, 0.3, thickness=thick, density=1000.0)
    press = [
        EdgeForce(edge, (0, 0, force), time=lambda t: min(t / 5e-3, 1.0))
        for edge, force in (("left", 8.0), ("right", -8.0))
    ]
    touch = Contact(
        "touch", Faces("u", thick), stiffness=5e8, radius=thick / 2, smoothing=5e-5, body="u"
    )
    given = {"scheme": scheme, "dt": 5e-4, "t_end": 0.02, "loads": press, "contacts": touch}
    return Scene("bent", Shell("u", Parametric(place), section, mesh=(8, 1)), **(given | more))


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_a_strip_touches_itself(scheme: str) -> None:
    """Its legs meet; forces within one body change no momentum, and the account closes."""
    found = execute(bent(scheme))
    history = found.history
    assert history["touch.normal"].max() > 0.5
    assert 0 < history["touch.penetration"].max() < 5e-4
    # the legs have come to a tenth of their distance
    assert found.summary["energy_balance_error"] < 1e-9
    linear, _ = momenta(found)
    assert_allclose(linear, 0 * linear, atol=1e-9)
