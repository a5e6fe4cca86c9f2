"""The sweep backwards is the transpose of the tangent, and finds what tangents find.

The kind: a derivative of a number that follows from a motion. Schemes, bodies, joints, drivers,
springs, contact and parameters are varied; the references are steps that are linearised by
differences, and the derivatives of `sm.sensitivities`.
"""

import inspect
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from tests.sensitivity import scenes

SCHEMES = ("ep", "ed", "ep4", "ed3")
# options of runs, and what they are in a scene
TIGHT = {"newton": "full", "newton_tolerance": 1e-11}
SHARP: dict[str, object] = {"newton": "full", "tolerance": 1e-11}
# a difference that is exact for polynomials of degree four; residuals of shells have degree three,
# but for jumps of velocities across directors (ED)
POINTS, WEIGHTS = (-2, -1, 1, 2), (1 / 12, -2 / 3, 2 / 3, -1 / 12)
APART = 1e-4


def motions(scene: sm.Scene) -> sm.Scene:
    """A scene with those probes that are linear in the state."""
    kept = tuple(p for p in scene.probes if p.quantity == "displacement")
    return replace(scene, probes=kept or sm.Probe("end", "right-top", component=0))


def plate(scheme: str = "ep", thickness: float = 4e-3, steps: int = 3) -> sm.Scene:
    scene = motions(scenes.plate(scheme=scheme, thickness=thickness, steps=steps))
    return replace(scene, loads=(*scene.loads, sm.Gravity((0, 0, -9.81))))


def laminate(scheme: str = "ep", angle: float = 30.0, thickness: float = 1e-3) -> sm.Scene:
    """Two plies, on triangles: bending is coupled to stretching and twist."""
    glass = sm.PlyMaterial(E1=45e9, E2=12e9, nu12=0.3, G12=5e9, G13=5e9, G23=4e9, density=1900.0)
    plies = sm.Laminate((sm.Ply(glass, thickness, angle), sm.Ply(glass, thickness, -50.0)))
    strip = sm.Shell("strip", sm.Rectangle(1.0, 0.2), plies, mesh=(3, 1), cell="tri")
    return sm.Scene(
        "laminate",
        strip,
        supports=sm.Clamped("left"),
        loads=sm.EdgeForce("right", (0, 0, 20.0)),
        probes=sm.Probe("tip", (1.0, 0.2, 0), component=2),
        scheme=scheme,
        dt=2e-3,
        t_end=6e-3,
    )


def roof(scheme: str = "ep", thickness: float = 0.01) -> sm.Scene:
    """A curved panel from its reference."""
    return replace(scenes.vault(scheme=scheme, thickness=thickness), start="given")


def square(history: dict) -> float:
    """Squares of all probes over time, and their ends."""
    return float(sum(np.sum(h**2) + h[-1] for name, h in history.items() if name != "t"))


def assert_transposed(scene: sm.Scene, within: float) -> None:
    """A step taken back is the transpose of the step linearised by differences."""
    from shellmb.running.execute import execute
    from shellmb.sensitivity.adjoint.steps import Steps, copied, put, starts, unknowns
    from shellmb.sensitivity.adjoint.sweep import Sweep
    from shellmb.system.direct.linear import Unreduced

    scene, steps = replace(scene, solver=replace(scene.solver, **SHARP)), Steps()
    simulation = execute(scene, None, [steps]).simulation
    problem, system = simulation.problem, simulation.problem.system
    sweep, rng = Sweep(simulation, [], False), np.random.default_rng(1)
    *_, step, _ = list(steps.backwards(simulation))[::-1]
    t, dt = steps.times[step.number]
    live, stages = starts(problem), unknowns(problem)
    # of motions, in the units of the scene, and rates by the step; linked nodes are their bodies'
    direction = {key: np.zeros_like(a) for key, a in live.items()}
    w = copied(direction)
    for body in simulation.model.bodies:
        parts = [body.mixed.dofs[part] for part in ("u", "w") if part in body.mixed.dofs]
        dofs = np.concatenate([*parts, np.zeros(0, np.int32)])
        dofs = np.setdiff1d(dofs, np.concatenate([[], *(link.dofs for link in body.links)]))
        for name, unit in (("q", 1.0), ("v", dt)):
            if (body.name, name) in live:
                direction[body.name, name][dofs] = rng.normal(size=len(dofs)) / unit
                w[body.name, name][dofs] = rng.normal(size=len(dofs)) * unit
    sweep.covector = copied(w)
    sweep.back(step, t, dt)
    back = sum(float(sweep.covector[key] @ d) for key, d in direction.items())

    def move(h: float, moved: np.ndarray | None) -> None:
        """Go by `h` along the direction at the start, and along a change of the unknowns."""
        put({key: a + h * direction[key] for key, a in step.start.items()}, live)
        simulation.model.mechanism.refresh(problem.levels)
        problem.prepare(t, dt)
        put(step.unknown, stages)
        system.gather()
        system.update_fixed_values()
        system.residuals.refresh()
        if moved is not None:
            system.x.array[:] += h * moved
        system.scatter(system.x)

    def at(h: float, moved: np.ndarray | None) -> tuple[np.ndarray, float]:
        """Residual, and the end of the step times its covector."""
        move(h, moved)
        system.residual(system.x, system.b)
        rest = np.array(system.b.array_r)
        problem.advance(dt)
        return rest, sum(float(a @ w[key]) for key, a in live.items())

    def slope(which: int, moved: np.ndarray | None) -> np.ndarray:
        pairs = zip(POINTS, WEIGHTS, strict=True)
        return sum(c / APART * np.asarray(at(p * APART, moved)[which]) for p, c in pairs)

    system.b.array[:] = slope(0, None)
    right, change, full = system.b.copy(), system.x.duplicate(), Unreduced(system, "transposed_")
    move(0.0, None)
    assert full.factorise() is None and full.solve(right, change, True) is None
    forth = float(slope(1, -np.array(change.array_r)))
    assert forth == pytest.approx(back, rel=within)


def test_jumps_without_momentum_along_directors_are_transposed() -> None:
    """Of a shell whose mass is off its surface, too: motions of both are coupled."""
    from mpi4py import MPI

    from shellmb.model.model import Model

    scene = laminate("ed")
    (shell,) = scene.shells
    off = replace(shell, section=replace(shell.section, offset=0.02))
    for one, coupled in ((shell, False), (off, True)):
        model = Model(replace(scene, shells=one), MPI.COMM_WORLD)
        body, rng = model.shells[shell.name], np.random.default_rng(1)
        assert (body.mass.s is not None) == coupled
        size, dofs = len(body.mixed.dofs["w"]), sum(map(len, body.mixed.dofs.values()))
        jump, state, w, d_jump, d_state = np.zeros((5, dofs))
        for part in ("u", "w"):
            for values in (jump, w, d_jump):
                values[body.mixed.dofs[part]] = rng.normal(size=size)
        for values in (state, d_state):
            values[body.mixed.dofs["w"]] = 0.3 * rng.normal(size=size)
        tangent, h = body.manifold.tangent_values, 1e-3
        pairs = zip(POINTS, WEIGHTS, strict=True)
        exact = sum(
            c / h * (w @ tangent(jump + p * h * d_jump, state + p * h * d_state)) for p, c in pairs
        )
        by_jump, by_state = body.manifold.tangent_back(jump, state, w)
        # error of the differences
        assert by_jump @ d_jump + by_state @ d_state == pytest.approx(exact, rel=1e-9)


def test_a_step_back_is_the_transpose_of_a_step() -> None:
    # 1.3e-12 was seen
    assert_transposed(plate(), within=2e-11)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("make", [plate, laminate, scenes.mechanism])
def test_steps_back_are_transposes(make: Callable[..., sm.Scene], scheme: str) -> None:
    # differences under ED were seen 2e-11 off, all others 5e-12
    assert_transposed(motions(make(scheme=scheme)), within=2e-10)


def test_fields_add_up_to_the_parameter() -> None:
    """A thickness in each element changes as the thickness of all does, from a few states, too."""
    found = sm.adjoint(plate, square, [("strip", "thickness")], ("thickness",), **TIGHT)
    table = found.fields["strip", "thickness"]
    assert len(table) == 3 and table["area"].sum() == pytest.approx(0.2)
    # differences of the parameter's residuals, as of tangents
    assert table["derivative"].sum() == pytest.approx(found.parameters["thickness"], rel=1e-8)
    few = sm.adjoint(plate, square, [("strip", "thickness")], states=1, **TIGHT)
    # steps are solved again, from other guesses
    np.testing.assert_allclose(
        few.fields["strip", "thickness"]["derivative"], table["derivative"], rtol=1e-8
    )
    assert few.value == found.value


def struck(scheme: str = "ep", thickness: float = 4e-3) -> sm.Scene:
    """A free strip that strikes the ground and slides on it."""
    scene = plate(scheme, thickness)
    ground = sm.Contact(
        "ground",
        sm.Plane((0, 0, -1e-4), (0, 0, 1)),
        stiffness=2e4,
        friction=0.3,
        slip_speed=0.05,
        smoothing=1e-4,
    )
    thrown = sm.InitialVelocity((0.2, 0.0, -1.0))
    times = {"dt": 5e-4, "t_end": 0.01}
    return replace(scene, contacts=ground, initial=thrown, supports=(), **times)


@pytest.mark.parametrize(
    "scheme", ["ep", *(pytest.param(s, marks=pytest.mark.slow) for s in SCHEMES[1:])]
)
def test_fields_in_contact_add_up_to_the_parameter(scheme: str) -> None:
    """Kind: fields end their iteration earlier than parameters do; contact is stiff and slides."""
    place, values = ("strip", "thickness"), {"scheme": scheme}
    field = sm.adjoint(struck, square, [place], values=values).fields[place]
    named = sm.adjoint(struck, square, (), ("thickness",), values=values)
    # differences of the parameter's residuals; 2e-11 was seen
    assert field["derivative"].sum() == pytest.approx(named.parameters["thickness"], rel=1e-9)


@pytest.mark.parametrize(
    "scheme", ["ep", *(pytest.param(s, marks=pytest.mark.slow) for s in (*SCHEMES[1:], "static"))]
)
def test_what_relaxes_goes_backwards(scheme: str) -> None:
    """Kind: memory beside the state, of sections and springs, that parameters and fields change."""
    place, values = ("strip", "plies[0].angle"), {"scheme": scheme}
    names = ("g", "angle", "stiffness", "length", *(("tau",) if scheme != "static" else ()))
    back = sm.adjoint(scenes.fading, square, [place], names, values=values, **TIGHT)
    field = back.fields[place]["derivative"]
    assert field.sum() == pytest.approx(back.parameters["angle"], rel=1e-8)
    few = sm.adjoint(scenes.fading, square, [place], values=values, states=2, **TIGHT)
    np.testing.assert_allclose(few.fields[place]["derivative"], field, rtol=1e-7)
    forth = sm.sensitivities(
        scenes.fading, names, values=values, columns="probes", fields=False, **TIGHT
    )
    for name in names:
        exact = 0.0
        for p in ("u0", "u2"):
            slope = forth.history[name][p]
            exact += float(2 * forth.run.history[p].to_numpy() @ slope + slope.iloc[-1])
        assert back.parameters[name] == pytest.approx(exact, rel=1e-7), name


def assert_same(make: Callable[..., sm.Scene], given: dict, names: tuple, within: float) -> None:
    """The adjoint finds what tangents find."""

    def scene(**values: float) -> sm.Scene:
        return motions(make(**given | values))

    scene.__signature__ = inspect.signature(make)  # type: ignore[attr-defined]
    back = sm.adjoint(scene, square, parameters=names, **TIGHT)
    forth = sm.sensitivities(scene, names, columns="probes", fields=False, **TIGHT)
    probes = [p.name for p in forth.run.described.probes]
    for name in names:
        exact = 0.0
        for p in probes:
            slope = forth.history[name][p]
            exact += float(2 * forth.run.history[p].to_numpy() @ slope + slope.iloc[-1])
        assert back.parameters[name] == pytest.approx(exact, rel=within, abs=1e-12), name


@pytest.mark.slow
@pytest.mark.parametrize("scheme", (*SCHEMES, "static"))
def test_adjoint_of_a_plate_is_its_tangent(scheme: str) -> None:
    names = ("thickness", "E", "length", "force")
    if scheme != "static":
        names += ("density", "frequency", "speed", "damping")
    assert_same(scenes.plate, {"scheme": scheme}, names, within=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", SCHEMES)
def test_adjoint_of_a_mechanism_is_its_tangent(scheme: str) -> None:
    # the driver moves the crank, whatever its mass
    names = ("stiffness", "viscosity", "cord", "arm", "rate", "radius")
    assert_same(scenes.mechanism, {"scheme": scheme}, names, within=1e-6)
    with pytest.warns(sm.ShellmbWarning, match="does not depend on 'mass'"):
        assert_same(scenes.mechanism, {"scheme": scheme}, ("mass",), within=0.0)


def test_adjoint_of_contact_and_friction_is_their_tangent() -> None:
    assert_same(scenes.skid, {}, ("stiffness", "friction", "speed"), within=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plies[0].angle", "plies[1].thickness", "offset"])
def test_fields_of_laminates(name: str) -> None:
    """Derivatives by the field are those of runs with another constant."""
    place, size = ("strip", name), {"plies[0].angle": 0.05, "offset": 1e-6}.get(name, 1e-6)

    def changed(by: float = 0.0) -> sm.Scene:
        scene = laminate()
        section = scene.shells[0].section
        plies = list(section.plies)
        if name == "plies[0].angle":
            plies[0] = replace(plies[0], angle=plies[0].angle + by)
        elif name == "plies[1].thickness":
            plies[1] = replace(plies[1], thickness=plies[1].thickness + by)
        section = replace(section, plies=tuple(plies), offset=by if name == "offset" else 0.0)
        shell = replace(scene.shells[0], section=section, eccentric_inertia=False)
        return replace(scene, shells=(shell,))

    found = sm.adjoint(changed, square, [place], **TIGHT)
    values = [
        sm.adjoint(changed, square, [place], values={"by": p * size}, **TIGHT).value for p in POINTS
    ]
    exact = sum(w * v for w, v in zip(WEIGHTS, values, strict=True)) / size
    # round-off of the values over their distance
    assert found.fields[place]["derivative"].sum() == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize(
    ("make", "scheme"),
    [
        (plate, "ep"),
        (plate, "static"),
        *(pytest.param(roof, s, marks=pytest.mark.slow) for s in (*SCHEMES, "static")),
    ],
)
def test_numbers_of_elements_are_those_of_single_elements(make: Any, scheme: str) -> None:
    """A thickness that changes in the second element alone, of flat and of curved shells."""
    (first, *_) = make().probes
    shell = make().shells[0]

    def last(history: Any) -> float:
        return float(history[first.name][-1])

    found = sm.adjoint(make, last, [(shell.name, "thickness")], values={"scheme": scheme}, **TIGHT)
    table = found.fields[shell.name, "thickness"]
    # elements are behind each other, and all points of one nearer to its middle than to others
    middles, value = table[["x", "y", "z"]].to_numpy(), table["value"][0]

    def at(change: float) -> float:
        def thickness(x: Any) -> Any:
            apart = np.linalg.norm(x.T[:, None] - middles, axis=2)
            return value * np.where(apart.argmin(axis=1) == 1, 1 + change, 1.0)

        run = sm.run(make(scheme=scheme, thickness=thickness), **TIGHT)
        return float(run.history[first.name].iloc[-1])

    exact = (at(APART) - at(-APART)) / (2 * APART * value)
    # the square of the distance; 4e-9 was seen
    assert table["derivative"][1] == pytest.approx(exact, rel=1e-7)
    assert abs(exact) > 1e-3 * table["derivative"].abs().max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "body"),
    [(scenes.heated, "strip"), (scenes.balloon, "ball")],
    ids=["heated", "balloon"],
)
def test_fields_where_strains_or_volumes_are_given(make: Any, body: str) -> None:
    """All elements together are the parameter of the section, also of what depends on it twice."""
    (first, *_) = make().probes

    def last(history: Any) -> float:
        return float(history[first.name][-1])

    back = sm.adjoint(make, last, [(body, "thickness")], ("thickness",), **TIGHT)
    found = sm.sensitivities(make, ("thickness",), columns="probes", **TIGHT)
    exact = found.history["thickness"][first.name].iloc[-1]
    # 2e-10 was seen
    assert back.fields[body, "thickness"]["derivative"].sum() == pytest.approx(exact, rel=1e-8)
    assert back.parameters["thickness"] == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize(
    ("changes", "fields", "said"),
    [
        ({}, (), "neither fields nor parameters are named"),
        ({}, [("wing", "thickness")], "there is no shell 'wing'; there are 'strip'"),
        ({}, ("thickness",), "a field is 'thickness'; it must be the name of a shell and"),
        ({}, [("strip",)], r"a field is \('strip',\); it must be the name of a shell and"),
        ({}, [("strip", "angle")], "has no 'angle' that may vary; it has thickness, offset"),
        ({"probes": ()}, [("strip", "thickness")], "has no probe"),
        (
            {"probes": sm.Probe("n", "right-top", quantity="membrane", component=0)},
            [("strip", "thickness")],
            r"probe 'n' records membrane \(0\); it must be a component of displacement",
        ),
        ({"scheme": "ed-printed"}, [("strip", "thickness")], "does not go backwards"),
        ({"start": "equilibrium"}, [("strip", "thickness")], "starts from an equilibrium"),
        ({"start": sm.FromMode(1, 0.01)}, [("strip", "thickness")], "starts from a mode, whose"),
        (
            {"events": sm.Event("far", when=sm.Sensor("tip") >= 0.1)},
            [("strip", "thickness")],
            "has events, which cannot go backwards",
        ),
    ],
)
def test_bad_requests(changes: dict, fields: list, said: str) -> None:
    def scene() -> sm.Scene:
        made = motions(scenes.plate())
        (strip,) = made.shells
        plain = replace(strip, section=replace(strip.section, stiffness_damping=0.0))
        return replace(made, shells=plain, **changes)

    with pytest.raises(sm.SceneError, match=said):
        sm.adjoint(scene, square, fields)


@pytest.mark.parametrize(
    ("model", "at", "said"),
    [
        ("rigid", "tip", "shell 'strip' is rigid; fields of numbers need"),
        (sm.Modal(modes=2), "tip", "shell 'strip' is reduced to modes; fields of numbers need"),
        (sm.Modal(modes=2), "strip", "probe 'u' is on 'strip', which is reduced to modes; it must"),
    ],
)
def test_bodies_without_elements_of_their_own(model: Any, at: str, said: str) -> None:
    """Kind: bodies that a mechanism has beside those with nodes; fields on them ended in a bug."""

    def scene() -> sm.Scene:
        (strip,) = scenes.plate().shells
        return sm.Scene(
            "hung",
            replace(strip, section=replace(strip.section, stiffness_damping=0.0), model=model),
            rigid_bodies=sm.RigidBody("tip", 0.1, (1e-4, 1e-4, 1e-4), position=(1.0, 0.1, 0)),
            joints=sm.Spherical("pin", "strip", "tip", at=(1.0, 0.1, 0)),
            loads=sm.Gravity(),
            probes=sm.Probe("u", "right-top" if at == "strip" else "center", body=at, component=2),
            scheme="ep",
            dt=1e-3,
            t_end=1e-3,
        )

    with pytest.raises(sm.SceneError, match=said):
        sm.adjoint(scene, lambda h: float(h["u"][-1]), [("strip", "thickness")])


def test_an_objective_is_a_number() -> None:
    with pytest.raises(sm.SceneError, match="the objective is nan; it must be a finite number"):
        sm.adjoint(plate, lambda history: float("nan"), [("strip", "thickness")])


@pytest.mark.parametrize(
    ("objective", "says"),
    [
        (lambda history: history["tip"][99], "the objective fails: test_adjoint.py, line .*IndexE"),
        (lambda history: None, "the objective is None; it must be a finite number"),
        (lambda history: sys.exit(), "the objective fails: test_adjoint.py, line .*SystemExit"),
    ],
)
def test_an_objective_that_fails_is_said(objective, says: str) -> None:
    with pytest.raises(sm.SceneError, match=says):
        sm.adjoint(plate, objective, [("strip", "thickness")])


def test_an_objective_that_cannot_be_is_rejected_before_the_run(monkeypatch) -> None:
    monkeypatch.setattr("shellmb.sensitivity.adjoint.run.execute", None)
    field = [("strip", "thickness")]
    with pytest.raises(sm.SceneError, match="reads 'tap'; there are 't', 'tip'"):
        sm.adjoint(plate, lambda history: float(history["tap"][-1]), field)
    with pytest.raises(sm.SceneError, match="the objective is 3; it must be a function"):
        sm.adjoint(plate, 3, field)  # type: ignore[arg-type]


def test_states_are_for_fields() -> None:
    with pytest.raises(sm.SceneError, match="states is 'few'; it must be a whole number"):
        sm.adjoint(plate, square, [("strip", "thickness")], states="few")  # type: ignore[arg-type]
    with pytest.raises(sm.SceneError, match="states is 3, and parameters are named"):
        sm.adjoint(plate, square, parameters=("thickness",), states=3)


@pytest.mark.slow
def test_two_ranks_find_the_same_backwards(mpirun: Callable[..., str]) -> None:
    source = f"""
import sys; sys.path.append({str(Path(__file__).parents[2])!r})
import shellmb as sm
from mpi4py import MPI
from tests.sensitivity import test_adjoint as here

place = ("strip", "thickness")
found = sm.adjoint(here.plate, here.square, [place], **here.TIGHT)
if MPI.COMM_WORLD.rank == 0:
    print(*map(float, found.fields[place]["derivative"]))
"""
    one, two = ([float(x) for x in mpirun(n, "-c", source).split()[-3:]] for n in (1, 2))
    # the worst is 1e-11: elimination of resultants
    assert two == pytest.approx(one, rel=1e-9)
