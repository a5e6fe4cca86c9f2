"""Wrong scenes that only the meshes or the forms tell, refused before anything is compiled."""

import re
from pathlib import Path

import numpy as np
import pytest
import ufl

from shellmb.errors import SceneError
from shellmb.scene import (
    Beam,
    Clamped,
    Driven,
    EdgeForce,
    EdgeMoment,
    Fixed,
    FollowerEdgeForce,
    FollowerForce,
    HardSupport,
    Hinged,
    Hyperelastic,
    Isotropic,
    Join,
    Line,
    Parametric,
    PointForce,
    PointMoment,
    Probe,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
    SoftSupport,
    SymmetryPlane,
)

STEEL = Isotropic(E=2e11, nu=0.3, thickness=0.01, density=7800)
ROD = RectangularSection(E=2e11, nu=0.3, width=0.01, height=0.01, density=7800)
HELD = Clamped("left")


def slit(xi, eta):
    """An annular plate, cut open along the x axis."""
    r, a = 6 + 4 * eta, 2 * np.pi * xi
    return np.stack([r * np.cos(a), r * np.sin(a), 0 * r])


RING = Shell("ring", Parametric(slit, slit=True), STEEL, mesh=(4, 1))


def shell(section=STEEL, **more):
    return Shell("plate", Rectangle(1, 1), section, mesh=(2, 2), **more)


def plate(*supports, loads=(), **more):
    return Scene("s", shell(), supports=supports or HELD, loads=loads, **more)


def beam(*loads, **more):
    rod = Beam("rod", Line((0, 0, 0), (1, 0, 0)), ROD, elements=2)
    return Scene("s", beams=rod, supports=Clamped("start"), loads=loads, **more)


def two(*supports):
    other = Shell("flap", Rectangle(1, 1, origin=(1, 0, 0)), STEEL, mesh=(2, 2))
    join = Join("plate", "flap", "right", "left")
    return Scene("s", (shell(), other), supports=supports, joins=join)


def ring(*loads, **more):
    return Scene("s", RING, **({"supports": HELD, "loads": loads} | more))


def with_term(term, **more):
    moving = {"scheme": "ep", "dt": 0.1, "t_end": 1.0}
    return Scene("s", shell(terms=(term,)), supports=HELD, **moving | more)


def with_energy(energy):
    rubber = Hyperelastic(energy, {"mu": 1.0}, thickness=0.1, density=1.0, stiffness=1.0)
    return Scene("s", shell(section=rubber), supports=HELD)


def of_everything(strains, parameters):
    return parameters["mu"] * sum(ufl.inner(e, e) for e in strains)


def angle(t):
    return 0.5 * np.pi * t


AGREE = "; they must agree, or one must be left out"
SLIT = "because it is slit there and its edges lie on each other; give the name of a point, "
NO_WORK = "which is not linear in the variation; it must be a virtual work, as ufl.dot(force, "
UFL = "it must be written with operators and functions of UFL"

CONTRADICTIONS = {
    "clamped edge 'left' and driven edge 'left' contradict one another on shell 'plate': at (0, "
    "0.25, 0) the displacement along x is 0 by the former and -0.25 by the latter at t = 1"
    + AGREE: lambda: plate(HELD, Driven("left", rotation=angle)),
    "driven edge 'left' and clamped edge 'left' contradict one another on shell 'plate': at (0, 0, "
    "0) the displacement along x is 0.1 by the former and 0 by the latter at t = 1"
    + AGREE: lambda: plate(Driven("left", translation=lambda t: (0.1 * t, 0, 0)), HELD),
    "fixed components at 'left' and fixed components at 'left' contradict one another on shell "
    "'plate': at (0, 0, 0) the displacement along z is 0.1 by the former and 0.2 by the latter at "
    "t = 0" + AGREE: lambda: plate(
        Clamped("right"), Fixed("left", (0, 0, 0.1)), Fixed("left", (0, 0, 0.2))
    ),
    "clamped edge 'left' and fixed components at 'left-top' contradict one another on shell "
    "'plate': at (0, 1, 0) the displacement along z is 0 by the former and 0.1 by the latter at t "
    "= 0" + AGREE: lambda: plate(HELD, Fixed("left-top", (None, None, 0.1))),
    "hinged edge 'left' and fixed components at (0.0, 0.5, 0.0) contradict one another on shell "
    "'plate': at (0, 0.5, 0) the displacement along z is 0 by the former and 1 by the latter at t "
    "= 1" + AGREE: lambda: plate(Hinged("left"), Fixed((0, 0.5, 0), (None, None, lambda t: t))),
    "soft support at 'left' and fixed components at 'left' contradict one another on shell "
    "'plate': at (0, 0, 0) the displacement along z is 0 by the former and 0.1 by the latter at t "
    "= 0" + AGREE: lambda: plate(
        Clamped("right"), SoftSupport("left"), Fixed("left", (None, None, 0.1))
    ),
    # only the corner that two edges share
    "clamped edge 'bottom' and driven edge 'left' contradict one another on shell 'plate': at (0, "
    "0, 0) the displacement along z is 0 by the former and 1 by the latter at t = 1"
    + AGREE: lambda: plate(Clamped("bottom"), Driven("left", translation=lambda t: (0, 0, t))),
    # in combination: what two supports hold leaves nothing to the third
    "driven edge 'left' and symmetry plane at 'left' contradict one another on shell 'plate': at "
    "(0, 0, 0) the displacement along (0.707107, 0.707107, 0) is 0.707107 by the former and 0 by "
    "the latter at t = 1" + AGREE: lambda: plate(
        SymmetryPlane("left", (1, 1, 0)), Driven("left", translation=lambda t: (t, 0, 0))
    ),
    # of directors alone
    "clamped edge 'left' and fixed components at 'left' contradict one another on shell 'plate': "
    "at (0, 0, 0) the change of the director along x is 0 by the former and 0.1 by the latter at t "
    "= 0" + AGREE: lambda: plate(HELD, Fixed("left", director=(0.1, None, None))),
    # across a join: one node, two bodies
    "clamped edge 'right' and fixed components at 'left' contradict one another on shell 'flap': "
    "at (1, 0, 0) the displacement along z is 0 by the former and 0.1 by the latter at t = 0"
    + AGREE: lambda: two(
        Clamped("right", body="plate"), Fixed("left", (None, None, 0.1), body="flap")
    ),
    # with itself: a director has the length 1
    "fixed components at 'left': it makes the director of shell 'plate' at (0, 0, 0) 1.10905 long "
    "at t = 0; the director must keep its length 1": lambda: plate(
        Fixed("left", (0, 0, 0), (0.1, 0.1, 0.1))
    ),
    "fixed components at 'left': it makes the director of shell 'plate' at (0, 0, 0) 1.2 long at t "
    "= 0; the director must keep its length 1": lambda: plate(
        Fixed("left", (0, 0, 0), (1.2, None, None))
    ),
}
IDLE = {
    "edge force: it has no effect at 'left' of shell 'plate', where clamped edge 'left' holds it; "
    "it must act elsewhere, or be left out": lambda: plate(loads=EdgeForce("left", (0, 0, 1))),
    "edge force: it has no effect at 'left' of shell 'plate', where soft support at 'left' holds "
    "it; it must act elsewhere, or be left out": lambda: plate(
        Clamped("right"), SoftSupport("left"), loads=EdgeForce("left", (0, 0, 1))
    ),
    "follower edge force: it has no effect at 'left' of shell 'plate', where clamped edge 'left' "
    "holds it; it must act elsewhere, or be left out": lambda: plate(
        loads=FollowerEdgeForce("left", (0, 0, 1))
    ),
    "edge moment: it has no effect at 'left' of shell 'plate', where clamped edge 'left' holds it; "
    "it must act elsewhere, or be left out": lambda: plate(loads=EdgeMoment("left", (0, 1, 0))),
    "edge force: it has no effect at 'left' of shell 'plate', where driven edge 'left' holds it; "
    "it must act elsewhere, or be left out": lambda: plate(
        Driven("left", rotation=angle), loads=EdgeForce("left", (0, 0, 1))
    ),
    "point force: it has no effect at 'left-top' of shell 'plate', where clamped edge 'left' holds "
    "it; it must act elsewhere, or be left out": lambda: plate(
        loads=PointForce("left-top", (0, 0, 1))
    ),
    "point force: it has no effect at (0.0, 0.5, 0.0) of shell 'plate', where hinged edge 'left' "
    "holds it; it must act elsewhere, or be left out": lambda: plate(
        Hinged("left"), loads=PointForce((0, 0.5, 0), (0, 0, 1))
    ),
    "point force: it has no effect at 'start' of beam 'rod', where clamped edge 'start' holds it; "
    "it must act elsewhere, or be left out": lambda: beam(PointForce("start", (0, 0, 1))),
    "point moment: it has no effect at 'start' of beam 'rod', where clamped edge 'start' holds it; "
    "it must act elsewhere, or be left out": lambda: beam(PointMoment("start", (0, 0, 1))),
    "follower force: it has no effect at 'start' of beam 'rod', where clamped edge 'start' holds "
    "it; it must act elsewhere, or be left out": lambda: beam(FollowerForce("start", (0, 0, 1))),
}
PLACES = {
    f"probe 'p': shell 'ring' has 2 nodes at (6, 0, 0), {SLIT}'left-bottom' or 'right-bottom', or "
    "of an edge where one is possible": lambda: ring(probes=Probe("p", (6, 0, 0))),
    f"point force: shell 'ring' has 2 nodes at (10, 0, 0), {SLIT}'left-top' or 'right-top', or of "
    "an edge where one is possible": lambda: ring(PointForce((10, 0, 0), (0, 0, 1))),
    f"fixed components: shell 'ring' has 2 nodes at (8, 0, 0), {SLIT[:-2]}, or of an edge where "
    "one is possible": lambda: ring(supports=Fixed((8, 0, 0), (0, 0, 0))),
    "probe 'p': (0.1, 0.1, 0.01) is not on shell 'plate'; it is 0.01 m away from its nearest "
    "point (0.1, 0.1, 0)": lambda: plate(probes=Probe("p", (0.1, 0.1, 0.01))),
}
WRITTEN = {
    f"shell 'plate': term <lambda> returns 3.0, {NO_WORK}point.du)": lambda: with_term(
        lambda *a: 3.0
    ),
    f"shell 'plate': term <lambda> returns an expression, {NO_WORK}point.du)": lambda: with_term(
        lambda p: ufl.dot(p.du, p.du)
    ),
    f"shell 'plate': term affine returns an expression, {NO_WORK}point.du)": lambda: with_term(
        affine
    ),
    f"shell 'plate': term power returns an expression, {NO_WORK}point.du)": lambda: with_term(
        power
    ),
    "shell 'plate': term <lambda> returns None; it must return a scalar of UFL": lambda: with_term(
        lambda p: None
    ),
    "shell 'plate': term <lambda> returns True; it must return a scalar of UFL": lambda: with_term(
        lambda p: True
    ),
    "shell 'plate': term <lambda> returns an expression of shape (3,); it must return a scalar of "
    "UFL": lambda: with_term(lambda p: p.du),
    "shell 'plate': term <lambda> fails (ZeroDivisionError: division by zero); " + UFL: lambda: (
        with_term(lambda p: 1 / 0)
    ),
    "shell 'plate': term nullary fails (nullary() takes 0 positional arguments but 1 was given); "
    + UFL: lambda: with_term(nullary),
    "shell 'plate': term power fails (Invalid type conversion: None can not be converted to any "
    "UFL type.); " + UFL: lambda: with_term(power, scheme="static"),
    "shell 'plate': energy <lambda> returns None; it must return a scalar of UFL": lambda: (
        with_energy(lambda s, p: None)
    ),
    "shell 'plate': energy <lambda> returns an expression of shape (3,); it must return a scalar "
    "of UFL": lambda: with_energy(lambda s, p: s.eps),
    "shell 'plate': energy <lambda> fails (KeyError: 'E'); " + UFL: lambda: with_energy(
        lambda s, p: p["E"]
    ),
    "shell 'plate': energy <lambda> does not depend on eps and kap and gam; it must resist all "
    "strains": lambda: with_energy(lambda s, p: 3.0),
    "shell 'plate': energy <lambda> does not depend on gam; it must resist all strains": lambda: (
        with_energy(lambda s, p: p["mu"] * (ufl.inner(s.eps, s.eps) + ufl.inner(s.kap, s.kap)))
    ),
}


def nullary():
    return 1


def affine(p):
    return p.du[2] + 1.0


def power(p):
    """The power of a drag, where its virtual work is meant."""
    return -ufl.dot(p.v, p.v)


BAD = {**CONTRADICTIONS, **IDLE, **PLACES, **WRITTEN}

# what looks like the above and is right
GOOD = {
    "clamped twice": lambda: plate(HELD, HELD),
    "clamped and hinged": lambda: plate(HELD, Hinged("left")),
    "the same value twice": lambda: plate(
        Fixed("left", (0, 0, 0.1)), Fixed("left", (0, None, 0.1)), Fixed("left", (None, 0, None))
    ),
    "the same motion in other words": lambda: plate(
        Driven("left", axis=(1, 0, 0), about=(0, 0, 0), rotation=lambda t: 0.2 * t),
        Driven(
            "left", axis=(-2, 0, 0), rotation=lambda t: -0.2 * t, translation=lambda t: (0, 0, 0)
        ),
    ),
    "a corner on the axis": lambda: plate(
        Hinged("bottom"), Driven("left", axis=(0, 0, 1), rotation=angle)
    ),
    "a plane that a drive keeps": lambda: plate(
        SymmetryPlane("left", (1, 1, 0)), Driven("left", translation=lambda t: (t, -t, 0))
    ),
    "three planes of symmetry": lambda: plate(
        *(SymmetryPlane("left", n) for n in ((1, 0, 0), (0, 1, 0), (1, 2, 0)))
    ),
    "hard supports all around": lambda: plate(
        Fixed("left-bottom", (0, 0, 0)), HardSupport(("left", "right", "bottom", "top"))
    ),
    "a director that turns": lambda: plate(
        Fixed("left", (0, 0, 0), (np.sin, 0, lambda t: np.cos(t) - 1))
    ),
    "both sides of a join": lambda: two(
        Clamped("right", body="plate"), Clamped("left", body="flap")
    ),
    "a load that a support holds in part": lambda: plate(
        Clamped("right"), SoftSupport("left"), loads=EdgeForce("left", (0, 1, 1))
    ),
    "a load on a held and a free edge": lambda: plate(
        loads=EdgeForce(("left", "right"), (0, 0, 1))
    ),
    "a moment at a hinge": lambda: plate(Hinged("left"), loads=EdgeMoment("left", (0, 1, 0))),
    "no load": lambda: plate(loads=EdgeForce("left", (0, 0, 0))),
    "a named point at a slit": lambda: ring(PointForce("right-top", (0, 0, 1))),
    "a term of nothing": lambda: with_term(lambda p: 0),
    "a term of gradients": lambda: with_term(lambda p: ufl.dot(ufl.grad(p.u)[:, 0], p.dw)),
    "a term that is switched": lambda: with_term(
        lambda p: ufl.conditional(ufl.gt(p.time, 1.0), p.du[2], 0)
    ),
    "an energy of all strains": lambda: with_energy(of_everything),
}


@pytest.mark.parametrize("message", BAD)
def test_refused(message, bind):
    with pytest.raises(SceneError) as caught:
        bind(BAD[message]())
    said = str(caught.value)
    if message in WRITTEN:
        # first the file and the line of the function, or of what fails in it
        name, line, said = re.fullmatch(r"(\S+), line (\d+): (.*)", said).groups()
        source = Path(__file__).with_name(name).read_text().splitlines()
        function = re.search(r"(?:term|energy) (\S+)", message).group(1)
        near = "\n".join(source[int(line) - 1 : int(line) + 2])
        assert function.strip("<>") in near or "fails" in message
        assert "1 / 0" in near or "ZeroDivision" not in message
    assert said == message


@pytest.mark.parametrize("what", GOOD)
def test_welcome(what, bind):
    """Nothing of it is refused or warned of; and each dof is given once."""
    for body in bind(GOOD[what]()).model.bodies:
        fixed = np.concatenate([*(f.dofs for f in body.fixed), np.zeros(0, dtype=int)])
        assert len(np.unique(fixed)) == len(fixed)
