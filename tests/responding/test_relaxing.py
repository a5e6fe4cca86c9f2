"""Linear systems of what relaxes, beside closed forms and runs.

The kind: the stiffness `K + sum i w tau/(1 + i w tau) K_tau` at each frequency, of springs, beams
and shells, whatever acts (loads, ground, prescribed motions) and is seen (motions, resultants,
forces of joints), as systems of second and of first order, of all unknowns or of modes.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la

import shellmb as sm
from shellmb.api.responding.system import LinearSystem
from shellmb.errors import SceneError
from tests.modes.test_relaxing_modes import E, beam, poles

MOTION: dict[str, Any] = {"scheme": "ep", "dt": 1e-3, "t_end": 1.0}
F = 1.5


def fading(w: Any, series: Any) -> Any:
    """Complex modulus over the one at once, of (g, tau)."""
    return 1 - sum(g / (1 + 1j * w * tau) for g, tau in series)


@pytest.mark.parametrize("spring", ["joint", "between points"])
def test_a_mass_on_a_standard_linear_solid(spring: str, tmp_path: Path) -> None:
    k, m, series = 4e4, 10.0, ((0.3, 0.01), (0.1, 0.2))
    relaxation: Any = {"stiffness": k, "relaxation": sm.Prony(series)}
    ends: Any = {"at": (0, 0, -1.0), "second_at": (0, 0, 0)}
    scene = sm.Scene(
        "mass",
        rigid_bodies=sm.RigidBody("mass", m, (1.0, 1.0, 1.0)),
        joints=sm.Prismatic("slide", sm.GROUND, "mass", at=(0, 0, 0), axis=(0, 0, 1)),
        force_elements=sm.JointSpring("s", "slide", **relaxation)
        if spring == "joint"
        else sm.Spring("s", sm.GROUND, "mass", **ends, **relaxation),
        loads=sm.PointForce("center", (0, 0, 1.0), body="mass"),
        probes=sm.Probe("z", "center", body="mass"),
        **MOTION,
    )
    f = np.array([0.0, 0.3, 3.0, 9.0, 80.0])
    w = 2 * np.pi * f
    system = sm.linearise(scene)
    exact = 1 / (k * fading(w, series) - m * w**2)
    for found in (system, LinearSystem.load(system.save(tmp_path / "mass.npz"))):
        given: Any = {"frequencies": f, "outputs": "z"}
        seen = sm.response(found, inputs="load1", **given).frf[0, 0]
        np.testing.assert_allclose(seen, exact, rtol=1e-9)
        # storage and loss stiffness
        stiff = 1 / seen + m * w**2
        loss = k * sum(g * w * tau / (1 + (w * tau) ** 2) for g, tau in series)
        np.testing.assert_allclose(stiff.imag, loss, rtol=1e-6, atol=1e-6 * k)
        shaken = sm.response(
            found, inputs="base.z", absolute=True, quantity="acceleration", **given
        )
        np.testing.assert_allclose(shaken.frf[0, 0], 1 + m * w**2 * exact, rtol=1e-6)
    # poles, of the polynomial
    whole = np.poly1d([m, 0, k * (1 - 0.4)]) * np.poly1d([0.01, 1]) * np.poly1d([0.2, 1])
    whole += k * np.poly1d([0.3 * 0.01, 0]) * np.poly1d([0.2, 1])
    whole += k * np.poly1d([0.1 * 0.2, 0]) * np.poly1d([0.01, 1])
    (s,) = [root for root in whole.roots if root.imag > 0]
    assert abs(system.poles(1)[0] - s) < 1e-9 * abs(s)
    made = sm.modes(scene, rates=[0.0], count=1).computed
    assert made is not None and abs(made.modes[0].values[0] - s) < 1e-9 * abs(s)
    # mean squares to white noise are Lyapunov's
    ss = system.select("load1", "z").state_space()
    P = la.solve_continuous_lyapunov(ss.A, -ss.B @ ss.B.T / 2)
    many = np.linspace(0.0, 200.0, 4001)
    found = sm.response(system, frequencies=many, psd={"load1": 1.0}, outputs="z")
    assert found.rms is not None
    assert found.rms[0] == pytest.approx(np.sqrt(ss.C @ P @ ss.C.T).item(), rel=1e-3)


SERIES = ((0.3, 0.05), (0.2, 0.5))


def strip(**more: Any) -> sm.Scene:
    made = beam(E, sm.Prony(SERIES))
    force = sm.PointForce("end", (0, 0, 1.0), body="strip")
    probes = [
        sm.Probe("tip", "end", body="strip"),
        sm.Probe("moment", "start", "moment", 1, body="strip"),
    ]
    return replace(made, **{"loads": force, "probes": probes} | more)


def test_a_strip_in_bending() -> None:
    """Clamped, of Euler and Bernoulli with a complex modulus; modes and states of first order."""
    length, area, inertia = 1.0, 0.2 * 0.02, 0.2 * 0.02**3 / 12
    system = sm.linearise(strip())
    f = np.array([0.05, 0.4, 2.0, 3.0])
    found = sm.response(system, frequencies=f, inputs="load1")
    for frequency, seen in zip(f, found.frf[0, 0], strict=True):
        w = 2 * np.pi * frequency
        modulus = E * fading(w, SERIES)
        b = (1000.0 * area * w**2 / (modulus * inertia)) ** 0.25 * length
        above = np.sin(b) * np.cosh(b) - np.cos(b) * np.sinh(b)
        exact = above / (1 + np.cos(b) * np.cosh(b)) * length**3 / (modulus * inertia * b**3)
        assert abs(seen - exact) < 1e-2 * abs(exact)
        if frequency < 0.1:
            # storage and loss of the modulus
            assert (1 / seen).imag / (1 / seen).real == pytest.approx(
                modulus.imag / modulus.real, rel=3e-3
            )
    # the moment at the clamped end is that of the force, whatever relaxes
    assert abs(found.frf[1, 0, 0]) == pytest.approx(length, rel=2e-2)
    few = sm.response(system, frequencies=f, inputs="load1", modes=4)
    # four modes: not round-off
    np.testing.assert_allclose(few.frf, found.frf, rtol=1e-4)
    first = system.select("load1").descriptor()
    for n, frequency in enumerate(f):
        s = 2j * np.pi * frequency
        x = np.linalg.solve(s * first.E.toarray() - first.A.toarray(), first.B)
        np.testing.assert_allclose(first.C @ x + first.D, found.frf[:, :, n], rtol=1e-7)
    # resonances of modes are resolved, and damped as their poles are
    ss = system.select("load1", "tip").modal(2).state_space()
    P = la.solve_continuous_lyapunov(ss.A, -ss.B @ ss.B.T / 2)
    random = sm.response(
        system, frequencies=[0.0, 60.0], modes=2, psd={"load1": 1.0}, outputs="tip"
    )
    assert random.rms is not None
    assert random.rms[0] == pytest.approx(np.sqrt(ss.C @ P @ ss.C.T).item(), rel=3e-3)
    hit = sm.response(system, frequencies=[1.0], modes=2, spectrum={"base.z": 1.0})
    assert hit.largest is not None
    # of a beam the first mode has 1.566 at its end
    assert hit.largest[0] == pytest.approx(1.566 / abs(system.poles(1)[0]) ** 2, rel=1e-2)
    with pytest.raises(SceneError, match="damping is given, and what relaxes has its own"):
        sm.response(system, frequencies=[1.0], modes=2, damping=0.1)


def plate(**more: Any) -> sm.Scene:
    """A plate with a ply that relaxes, on an edge that is moved, with a force at its end."""
    stiff: Any = {"nu12": 0.3, "G12": E / 2.6, "G13": E / 2.6, "G23": E / 2.6, "density": 1000.0}
    soft = sm.PlyMaterial(E, E, **stiff, relaxation=sm.Prony(SERIES))
    plies = [sm.Ply(soft, 0.005), sm.Ply(sm.PlyMaterial(E, E, **stiff), 0.01)]
    section = sm.Laminate(plies, shear_correction=5 / 6)
    cell = more.pop("cell", "quad")
    shell = sm.Shell("p", sm.Rectangle(1.0, 0.2), section, mesh=(3, 1), cell=cell)
    force = sm.EdgeForce("right", (0, 0, 5.0), time=lambda t: float(np.sin(2 * np.pi * F * t)))
    probes = [
        sm.Probe("tip", "right-top", component=2, body="p"),
        sm.Probe("moment", (1 / 3, 0.0, 0.0), "bending", 0, body="p"),
    ]
    parts: Any = {"supports": sm.Clamped("left"), "loads": force, "probes": probes}
    return sm.Scene("p", shells=shell, **MOTION | parts | more)


@pytest.mark.parametrize("what", ["load1", "support1.z"])
@pytest.mark.parametrize("cell", ["quad", pytest.param("tri", marks=pytest.mark.slow)])
def test_the_steady_end_of_a_run(what: str, cell: Any) -> None:
    """Of `linear-dynamics`, whose step makes frequencies `tan(w dt/2) 2/dt`."""
    more: dict[str, Any] = {"cell": cell}
    if what == "support1.z":

        def lifted(t: float) -> float:
            # a smooth start rings no stiff modes, which branches hardly damp
            return float(1e-4 * np.sin(2 * np.pi * F * t) * (1 - np.exp(-(t**4))))

        more["supports"] = sm.Fixed("left", (0.0, 0.0, lifted), (0.0, 0.0, 0.0))
    dt = 1 / F / 40
    scene = plate(scheme="linear-dynamics", dt=dt, t_end=12 / F, **more)
    if what != "load1":
        scene = replace(scene, loads=())
    history = sm.run(scene, pictures=False).history
    system = sm.linearise(scene)
    np.testing.assert_allclose(system.poles(3), poles(scene, 3)[:3], rtol=1e-9)
    seen = np.tan(np.pi * F * dt) / (np.pi * dt)
    # a load is the mean over a step, in place of the mean of both of its ends
    half = np.pi * F * dt
    size = np.sin(half) / half / np.cos(half) if what == "load1" else 1e-4
    found = sm.response(system, frequencies=[seen], inputs=what)
    t = history["t"].to_numpy()
    last = t > t[-1] - 3 / F + 1e-9
    # resultants are means over steps
    mean = np.cos(np.pi * F * dt) * np.exp(-1j * np.pi * F * dt)
    for k, factor in ((0, 1.0), (1, mean)):
        values = history[found.outputs[k]].to_numpy()[last]
        amplitude = 2j * np.mean(values * np.exp(-2j * np.pi * F * t[last]))
        exact = size * factor * found.frf[k, 0, 0]
        assert abs(amplitude - exact) < 1e-4 * abs(exact)


def test_matrices_and_other_states() -> None:
    scene = strip(supports=sm.Clamped("start"))
    M = sm.matrices(scene)
    ((_, first), (_, second)) = M.branches.items()
    np.testing.assert_allclose(first.toarray() * 2 / 3, second.toarray(), rtol=1e-12, atol=1e-3)
    assert M.state_space(modes=2).A.shape == (8, 8)
    # about the equilibrium of a load that stretches it, and kept constraints
    pulled = replace(scene, loads=sm.PointForce("end", (500.0, 0, 0), body="strip"))
    exact = poles(pulled, 3, loaded=True)[:3]
    for kept in ("eliminated", "kept"):
        found = sm.linearise(pulled, at="equilibrium", constraints=kept)  # type: ignore[arg-type]
        np.testing.assert_allclose(found.poles(3), exact, rtol=1e-8)
    np.testing.assert_allclose(sm.linearise(pulled).poles(3), poles(scene, 3)[:3], rtol=1e-9)
