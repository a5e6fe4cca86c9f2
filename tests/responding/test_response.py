"""Responses of linear systems beside runs, Lyapunov's equation, and closed forms.

The kind: whatever the input (loads, motors, ground, prescribed motions) and however it is found
(of all unknowns, or of modes), a response is the steady end of a run, and its mean squares are
those of stochastic differential equations.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from typer.testing import CliRunner

import shellmb as sm
from shellmb.api.responding.reduction import lowest_modes
from shellmb.cli.main import app
from shellmb.demos.verification.cases import CASES
from shellmb.demos.verification.problems import forced  # noqa: F401
from shellmb.errors import SceneError
from tests.responding.test_linearise import MOTION, TIP, static, strip

F = 1.5


def damped(**more: Any) -> sm.Scene:
    """A strip with dampers at its end, and a force there."""
    dampers = [
        sm.Damper(
            f"damper {y:g}",
            sm.GROUND,
            "strip",
            at=(1.0, y, -1.0),
            second_at=(1.0, y, 0.0),
            damping=1.0,
        )
        for y in (0.0, 0.25)
    ]
    probes = [sm.Probe("tip", TIP), sm.Probe("moment", (0.5, 0.125, 0.0), "bending", 0)]
    force = sm.PointForce(TIP, (0, 0, 1e-3), time=lambda t: float(np.sin(2 * np.pi * F * t)))
    given: dict[str, Any] = {
        "force_elements": dampers,
        "loads": force,
        "probes": probes,
        "supports": sm.Clamped("left"),
    }
    return strip(**given | more)


def amplitude(t: np.ndarray, values: np.ndarray) -> complex:
    """Complex amplitude of the last two periods, of `sin`."""
    last = t > t[-1] - 2 / F + 1e-9
    return complex(2 * np.mean(values[last] * np.exp(-2j * np.pi * F * t[last])) * 1j)


@pytest.mark.parametrize("what", ["load1", "support1.z"])
def test_the_steady_end_of_a_run(what: str) -> None:
    """Of `linear-dynamics`, whose step makes frequencies `tan(w dt/2) 2/dt`."""
    more: dict[str, Any] = {}
    if what == "support1.z":
        lifted = lambda t: 1e-4 * float(np.sin(2 * np.pi * F * t))  # noqa: E731
        held = sm.Fixed("left", (0.0, 0.0, lifted), (0.0, 0.0, 0.0))
        more = {"supports": held, "loads": ()}
    dt = 1 / F / 60
    scene = damped(scheme="linear-dynamics", dt=dt, t_end=10 / F, **more)
    run = sm.run(scene, pictures=False)
    history = run.history
    t = history["t"].to_numpy() if "t" in history else history.index.to_numpy()
    seen = np.tan(np.pi * F * dt) / (np.pi * dt)
    found = sm.response(scene, frequencies=[seen], inputs=[what])
    size = 1.0 if what == "load1" else 1e-4
    exact = size * found.frf[found.outputs.index("tip"), 0, 0]
    assert abs(amplitude(t, history["tip"].to_numpy()) - exact) < 1e-3 * abs(exact)


def test_mean_squares_to_white_noise_are_lyapunovs() -> None:
    """`A P + P A' + B B' S/2 = 0` of the same modes, S one-sided."""
    system = sm.linearise(damped())
    # without what other modes do in statics, whose density has no end
    part = system.select("load1", "tip").modal(4)
    ss = part.state_space()
    P = la.solve_continuous_lyapunov(ss.A, -ss.B @ ss.B.T / 2)
    exact = np.sqrt(ss.C @ P @ ss.C.T).item()
    found = sm.response(part, frequencies=[0.0, 200.0], psd={"load1": 1.0})
    assert found.rms is not None
    assert found.rms[0] == pytest.approx(exact, rel=1e-3)
    # of modes and of all unknowns, at few frequencies and with a density that begins between them
    few = sm.response(system, frequencies=[0.0, 200.0], psd={"load1": 1.0}, outputs="tip", modes=4)
    curve = ([1e-3, 50.0], [1.0, 1.0])
    whole = sm.response(system, frequencies=[0.0, 50.0], psd={"load1": curve}, outputs="tip")
    for other in (few, whole):
        assert other.rms is not None
        assert other.rms[0] == pytest.approx(exact, rel=5e-3)
    # a band far below the first mode moves as in statics
    band = ([0.02, 0.03], [1.0, 1.0])
    slow = sm.response(part, frequencies=[0.0, 50.0], psd={"load1": band}).rms
    assert slow is not None
    assert slow[0] == pytest.approx(abs(static(part).item()) * 0.1, rel=1e-3)


def test_what_is_undamped_has_no_mean_square() -> None:
    undamped = sm.linearise(strip(supports=sm.Clamped("left"), probes=sm.Probe("tip", TIP)))
    for modes in (None, 3):
        with pytest.warns(sm.ShellmbWarning, match="rms is unreliable: near .* Hz a resonance"):
            found = sm.response(undamped, frequencies=[0.0, 5.0], psd={"base.z": 1.0}, modes=modes)
        assert found.rms is not None and np.isinf(found.rms[0])


def test_an_oscillator_on_ground_that_shakes() -> None:
    """Transmissibility, Miles' equation and the spectrum of one mode, in closed form."""
    k, m, ratio = 4e4, 10.0, 0.03
    w = np.sqrt(k / m)
    mass = sm.Scene(
        "mass",
        rigid_bodies=sm.RigidBody("mass", m, (1.0, 1.0, 1.0)),
        joints=sm.Prismatic("slide", sm.GROUND, "mass", at=(0, 0, 0), axis=(0, 0, 1)),
        force_elements=[
            sm.JointSpring("spring", "slide", k),
            sm.JointDamper("damper", "slide", 2 * ratio * m * w),
        ],
        probes=sm.Probe("mass", "center", body="mass"),
        **MOTION,
    )
    f = np.array([0.0, 1.0, w / (2 * np.pi), 30.0])
    r = 2 * np.pi * f / w
    exact = (1 + 2j * ratio * r) / (1 - r**2 + 2j * ratio * r)
    given: dict[str, Any] = {"inputs": ["base.z"], "outputs": ["mass"]}
    found = sm.response(mass, frequencies=f, absolute=True, quantity="acceleration", **given)
    np.testing.assert_allclose(found.frf[0, 0], exact, rtol=1e-6)
    found = sm.response(mass, frequencies=f, **given)
    np.testing.assert_allclose(found.frf[0, 0], -1 / w**2 / (1 - r**2 + 2j * ratio * r), rtol=1e-6)
    # as many modes as coordinates
    found = sm.response(mass, frequencies=f[1:], modes=1, damping=ratio, **given)
    alone = -1 / w**2 / (1 - r**2 + 2j * ratio * r)
    np.testing.assert_allclose(found.frf[0, 0], alone[1:], rtol=1e-6)
    with pytest.raises(SceneError, match=r"modes is 2; it must be from 1 to 1 \(coord"):
        sm.response(mass, frequencies=f, modes=2, **given)
    # what the joint carries across is nothing; sideways it carries the mass
    found = sm.response(
        mass, frequencies=f, inputs="base.x", outputs="slide.F1,slide.F2,slide.F3".split(",")
    )
    assert np.linalg.norm(found.frf[:, 0], axis=0) == pytest.approx(m, rel=1e-6)
    fine = np.linspace(0.0, 400.0, 40001)
    found = sm.response(
        mass, frequencies=fine, psd={"base.z": 2.0}, absolute=True, quantity="acceleration", **given
    )
    assert found.rms is not None
    # Miles (1954), with the part of the damper
    miles = np.sqrt(np.pi / 2 * w / (2 * np.pi) * 2.0 * (1 + 4 * ratio**2) / (2 * ratio))
    assert found.rms[0] == pytest.approx(miles, rel=2e-3)


def test_shock_spectra_of_a_half_sine() -> None:
    """Undamped, of a pulse as long as 0.8 periods: 1.768 times its height (Harris and Crede)."""
    t = np.linspace(0, 0.05, 5001)
    pulse = np.where(t <= 0.01, np.sin(np.pi * t / 0.01), 0.0)
    found = sm.shock_spectrum(t, pulse, [0.1, 81.0, 5000.0], damping=0.0)
    # slow ones see the momentum alone, stiff ones follow, and ring from its corners
    slow, stiff = 2 * np.pi * 0.1 * 2 * 0.01 / np.pi, 1 / (1 - 1 / (2 * 5000 * 0.01))
    assert found == pytest.approx([slow, 1.768, stiff], rel=3e-3)
    # however few times there are in a period: linear between them
    few, every = [1.0, 30.0, 81.0, 330.0, 900.0], np.linspace(0, 0.05, 51)
    rough = np.interp(every, t, pulse)
    for damping in (0.0, 0.05):
        fine = sm.shock_spectrum(t, np.interp(t, every, rough), few, damping)
        assert sm.shock_spectrum(every, rough, few, damping) == pytest.approx(fine, rel=3e-3)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (([0.0, 1.0, 3.0], [0, 0, 0], [1.0]), "times must be as many"),
        (([0.0, 1.0], [0, 0], []), "frequencies are None and damping is 0.05"),
        (([0.0, 1.0], [0, 0], [0.0]), "frequencies must be positive"),
        (([0.0, 1.0], [0, np.nan], [1.0]), "acceleration is .*; it must be finite numbers"),
        (([0.0, 1.0], [0, 0], [1.0], None), "damping is None; it must be finite numbers"),
        (([0.0, 1.0], np.ones(2) * 1j, [1.0]), "acceleration is .*; it must be finite numbers"),
    ],
)
def test_shock_spectra_of_nothing(given: Any, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        sm.shock_spectrum(*given)


def test_largest_outputs_by_spectra() -> None:
    """A cantilever has participation factors of its modes; one mode by hand."""
    scene = damped(force_elements=())
    system = sm.linearise(scene)
    found = sm.response(
        system, frequencies=[1.0], modes=6, damping=0.02, spectrum={"base.z": 3.0}, outputs="tip"
    )
    assert found.largest is not None
    values, V = lowest_modes(system.K, system.M, 1)
    part = system.select("base.z", "tip")
    first = abs((V.T @ part.F[0]).item() * (part.Y[0] @ V).item()) / values[0] * 3.0
    # of a beam the first mode has 1.566 at its end
    w = np.sqrt(values[0])
    assert first == pytest.approx(1.566 * 3.0 / w**2, rel=5e-3)
    assert found.largest[0] == pytest.approx(first, rel=1e-2)


def test_mobility_of_a_plate() -> None:
    """Mean real part of the mobility of a plate: 1/(8 sqrt(B m)), of an endless one (Cremer)."""
    E, nu, h, rho = 70e9, 0.3, 2e-3, 2700.0
    section = sm.Isotropic(E=E, nu=nu, thickness=h, density=rho)
    point = (0.5 * 5 / 12, 0.7 * 7 / 16, 0.0)
    sides = ("left", "right", "bottom", "top")
    plate = sm.Scene(
        "plate",
        sm.Shell("plate", sm.Rectangle(0.5, 0.7), section, mesh=(12, 16)),
        supports=sm.Clamped(sides),
        loads=sm.PointForce(point, (0, 0, 1.0)),
        probes=sm.Probe("point", point),
        **MOTION,
    )
    f = np.linspace(150, 700, 1500)
    found = sm.response(plate, frequencies=f, modes=60, damping=0.03, quantity="velocity")
    mean = float(np.mean(found.frf[0, 0].real))
    B = E * h**3 / 12 / (1 - nu**2)
    assert mean == pytest.approx(1 / (8 * np.sqrt(B * rho * h)), rel=0.15)


def test_nafems_deep_beam() -> None:
    """Tests 5H and 5T of Selected Benchmarks for Forced Vibration (1989); 13 are in `verify`."""
    for check in CASES["forced/NAFEMS 5"].checks():
        assert check.passed, check


def test_modes_of_one_frequency_that_are_cut_apart_are_said() -> None:
    """A round rod bends along any line: one mode of two resists some loads only.

    Kind: what is known by round-off only, near a resonance; far below it all follows as in statics.
    """
    section = sm.CircularSection(2e11, 0.3, radius=0.01, density=7800.0)
    rod = sm.Scene(
        "rod",
        beams=sm.Beam("rod", sm.Line((0, 0, 0), (1, 0, 0)), section, elements=4),
        supports=sm.Clamped("start"),
        loads=sm.PointForce("end", (0.0, 0.6, 0.8)),
        probes=[sm.Probe("y", "end", component=1), sm.Probe("z", "end")],
        scheme="ep",
        dt=1e-3,
        t_end=1e-2,
    )
    system = sm.linearise(rod)
    first = abs(system.poles(1)[0]) / (2 * np.pi)
    with pytest.warns(sm.ShellmbWarning, match="modes is 1, and mode 2 has the frequency of the l"):
        sm.response(system, frequencies=[0.9 * first], modes=1)
    for modes, part in ((1, 0.2), (2, 0.9)):
        found = sm.response(system, frequencies=[part * first], modes=modes)
        exact = sm.response(system, frequencies=[part * first])
        # what is left out follows as in statics: the other one without its 1/(1 - 0.2^2)
        left = np.linalg.norm(found.frf - exact.frf) / np.linalg.norm(exact.frf)
        assert left < (0.05 if modes == 1 else 2e-3)


def test_files_of_the_command(tmp_path: Path) -> None:
    density = tmp_path / "density.csv"
    density.write_text("# Hz, (m/s^2)^2/Hz\n1,0.1\n100,0.1\n")
    given = ["response", "damped_plate", "--frequencies", "1:100:50", "--modes", "4", "--psd"]
    out = tmp_path / "out"
    called = [*given, f"base.z={density}", "--out", str(out), "--errors"]
    result = CliRunner().invoke(app, called)
    assert result.exit_code == 0, result.output
    assert "rms tip" in result.output
    assert (out / "bode.png").stat().st_size > 1000
    summary = json.loads((out / "summary.json").read_text())
    rms, error = summary["results"]["rms tip"], summary["errors"]["rms tip"]
    assert 0 < error < 0.02 * rms
    table = np.genfromtxt(out / "response.csv", delimiter=",", names=True)
    assert len(table) == 50
    assert np.sqrt(np.trapezoid(table["psd_tip"], table["frequency_hz"])) < 2 * rms


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({}, "frequencies are None; they must be one or more"),
        ({"frequencies": [2.0, 1.0]}, "frequencies are 2, 1; they must be one or more numbers"),
        (
            {"frequencies": [1.0], "inputs": ["force"]},
            "input is 'force'; it must be one of 'load1'",
        ),
        ({"frequencies": [1.0], "outputs": ["top"]}, "output is 'top'; it must be one of 'tip'"),
        ({"frequencies": [1.0], "psd": {"load1": -1.0}}, "psd of 'load1' is -1 somewhere; it must"),
        (
            {"frequencies": [1.0], "psd": {"load1": ([2, 1], [1, 1])}},
            "frequencies of psd of 'load1'",
        ),
        ({"frequencies": 5.0}, "frequencies are 5; they must be one or more"),
        (
            {"frequencies": [5.0], "quantity": "jerk"},
            "quantity is 'jerk'; it must be one of 'displ",
        ),
        ({"frequencies": [5.0], "psd": {"load1": 1.0}}, "psd is given with one frequency; rms is"),
        ({"frequencies": [1.0], "psd": {"load1": ([1, 2], [1])}}, "2 frequencies and 1 values"),
        ({"frequencies": [1.0], "psd": {"load1": ([], [])}}, "0 frequencies and 0 values"),
        (
            {"frequencies": [1.0], "spectrum": {"base.rotation": 1.0}, "modes": 2},
            "given for 'base.rotation'; it must be of base",
        ),
        ({"frequencies": [1.0], "damping": 0.1}, "damping is 0.1 without modes; give modes"),
        (
            {"frequencies": [1.0], "damping": 1.1, "modes": 2},
            "damping is 1.1; it must be one ratio",
        ),
        ({"frequencies": [1.0], "spectrum": {"base.z": 1.0}}, "spectrum is given without modes"),
        (
            {"frequencies": [1.0], "spectrum": {"load1": 1.0}, "modes": 2},
            "spectrum is given for 'load1'; it must be of base",
        ),
    ],
)
def test_bad_input_gets_a_sentence(options: dict[str, Any], said: str, system: Any) -> None:
    with pytest.raises(SceneError, match=said):
        sm.response(system, **options)


def test_what_nothing_holds_has_no_response_at_rest() -> None:
    body = sm.RigidBody("body", 1.0, (1.0, 1.0, 1.0))
    free = sm.Scene(
        "free",
        rigid_bodies=body,
        loads=sm.PointForce("center", (0, 0, 1.0), body="body"),
        probes=sm.Probe("z", "center", body="body"),
        scheme="ep",
        dt=0.1,
        t_end=0.1,
    )
    with pytest.raises(SceneError, match="at 0 Hz nothing resists the motion"):
        sm.response(free, frequencies=[0.0])
    found = sm.response(free, frequencies=[1.0]).frf[0, 0, 0]
    assert found == pytest.approx(-1 / (2 * np.pi) ** 2)


@pytest.fixture(scope="module")
def system() -> sm.LinearSystem:
    return sm.linearise(damped())


def test_an_edge_that_is_moved_is_ground_that_moves() -> None:
    """Seen from ground that accelerates by `-w^2` all moves as on an edge that goes up and down."""
    edge = sm.Driven(
        "left", axis=(0, 1, 0), rotation=lambda t: 0.0, translation=lambda t: (0, 0, 0)
    )
    found = sm.linearise(strip(supports=edge, loads=(), probes=sm.Probe("tip", TIP)))
    assert found.inputs[3:] == ("support1.rotation", *(f"support1.{axis}" for axis in "xyz"))
    # ten modes have the motion of the others to 5e-5
    for modes, close in ((None, 1e-6), (10, 1e-3)):
        given: dict[str, Any] = {"inputs": ["support1.z", "base.z"], "modes": modes}
        lifted, shaken = sm.response(found, frequencies=[0.0, 3.0], **given).frf[0]
        assert lifted[0] == pytest.approx(1.0, rel=close)
        assert lifted[1] == pytest.approx(1 - (6 * np.pi) ** 2 * shaken[1], rel=close)
    turned = sm.response(found, frequencies=[0.0], inputs="support1.rotation").frf
    assert turned[0, 0, 0] == pytest.approx(-1.0, rel=1e-6)


@pytest.mark.parametrize("length, mass, time", [(1e9, 1.0, 1.0), (1e6, 1e9, 1e3), (1e-3, 1.0, 1.0)])
def test_units_do_not_matter(length: float, mass: float, time: float) -> None:
    """Two bodies welded to a panel on a hinge: in km it was off by 4e-3, in micrometres by 1e-5.

    Unknowns were counted as they are, lengths beside directors. What is left is round-off: the
    system has a condition of 5e8, and five systems of units were within 3e-8 of one another.
    """

    def frf(u: float, m: float, t: float) -> np.ndarray:
        aluminium = sm.Isotropic(70e9 * m / u / t**2, 0.3, 4e-3 * u, density=2700 * m / u**3)
        panel = sm.Rectangle(1.5 * u, 0.5 * u, (0.1 * u, -0.25 * u, 0))
        spring = sm.JointSpring("spring", "shaft", stiffness=100 * m * (u / t) ** 2)
        scene = sm.Scene(
            "panel",
            sm.Shell("panel", panel, aluminium, mesh=(6, 2)),
            rigid_bodies=[
                sm.RigidBody("hub", 1.0 * m, (2e-3 * m * u * u,) * 3),
                sm.RigidBody("end", 0.3 * m, (1e-3 * m * u * u,) * 3, position=(1.8 * u, 0, 0)),
            ],
            joints=[
                sm.Revolute("shaft", sm.GROUND, "hub", at=(0, 0, 0), axis=(0, 1, 0)),
                sm.Weld("bolts", "hub", "panel", second_at="left"),
                sm.Weld("others", "end", "panel", second_at="right"),
            ],
            force_elements=spring,
            loads=sm.PointForce("center", (0, 0, m * u / t**2), body="end"),
            probes=[
                sm.Probe("w", "center", component=2, body="end"),
                sm.Probe("M", (0.85 * u, 0, 0), "bending", 0, body="panel"),
            ],
            scheme="ep",
            dt=1e-2 * t,
            t_end=1.0 * t,
        )
        found = sm.response(scene, frequencies=np.array([0.0, 1.0, 20.0, 100.0]) / t)
        rows = [found.outputs.index(name) for name in ("w", "M", "shaft.F3")]
        units = [u, m * u / t**2, m * u / t**2]
        return np.asarray(found.frf[rows, 0] / np.array(units)[:, None])

    np.testing.assert_allclose(frf(length, mass, time), frf(1.0, 1.0, 1.0), rtol=3e-7, atol=1e-12)
