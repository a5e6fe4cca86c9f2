"""Linear systems about any state: poles, forces, motions, and what they are saved as.

The kind: whatever a scene consists of, its linear system has the poles of its modes, and follows
loads, prescribed motions and accelerations of ground as closed forms and runs do.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse.linalg as spla

import shellmb as sm
from shellmb.api.responding.system import LinearSystem
from shellmb.errors import SceneError
from tests.rotating.test_spinning import rotor

MOTION: dict[str, Any] = {"scheme": "ep", "dt": 1e-3, "t_end": 1.0}
TIP = (1.0, 0.125, 0.0)


def strip(**more: Any) -> sm.Scene:
    """A strip on an edge whose height is prescribed, with a force at its end and a pressure."""
    section = sm.Isotropic(E=70e9, nu=0.3, thickness=2e-3, density=2700.0)
    shell = sm.Shell("strip", sm.Rectangle(1.0, 0.25), section, mesh=(4, 1))
    held = sm.Fixed("left", (0.0, 0.0, lambda t: 0.0), (0.0, 0.0, 0.0))
    probes = [
        sm.Probe("tip", TIP),
        sm.Probe("between", (0.3, 0.1, 0.0)),
        sm.Probe("speed", TIP, "velocity"),
        sm.Probe("moment", (0.5, 0.125, 0.0), "bending", 0),
    ]
    loads = (sm.PointForce(TIP, (0, 0, 1.0)), sm.Pressure(1.0))
    parts: dict[str, Any] = {"supports": held, "loads": loads, "probes": probes}
    return sm.Scene("strip", shell, **parts | MOTION | more)


def static(found: LinearSystem) -> np.ndarray:
    """Outputs by inputs, all at rest."""
    x = spla.spsolve(found.K.tocsc(), found.F[0])
    return np.asarray(found.Y[0] @ x + found.D[0])


def pendulum(**more: Any) -> sm.Scene:
    """A flexible rod with a ball at its end, on a sprung and damped hinge, with a motor."""
    section = sm.RectangularSection(E=2e9, nu=0.3, width=0.02, height=0.02, density=1000.0)
    return sm.Scene(
        "pendulum",
        beams=sm.Beam("rod", sm.Line((0, 0, 0), (1, 0, 0)), section, elements=2),
        rigid_bodies=sm.RigidBody("ball", 0.2, (1e-4, 1e-4, 1e-4), position=(1.1, 0, 0)),
        joints=[
            sm.Revolute("pin", sm.GROUND, "rod", at=(0, 0, 0), axis=(0, 1, 0)),
            sm.Weld("weld", "rod", "ball", at=(1, 0, 0)),
        ],
        force_elements=[
            sm.JointSpring("k", "pin", 5.0),
            sm.JointDamper("c", "pin", 0.1),
            sm.Motor("motor", "pin", law=lambda q, v, t: -0.5 * q - 0.05 * v),
        ],
        probes=[
            sm.Probe("ball", "center", body="ball"),
            sm.Probe("turn", "center", "rotation", 1, body="ball"),
        ],
        **MOTION | more,
    )


@pytest.mark.parametrize("kept", ["eliminated", "kept"])
def test_a_strip_at_rest(kept: Any, tmp_path: Path) -> None:
    found = sm.linearise(strip(), constraints=kept)
    exact = sm.modes(strip(), count=4, pictures=False).summary["omega_rad_per_s"]
    np.testing.assert_allclose(np.abs(found.poles(4)), exact, rtol=1e-9)
    assert found.inputs == ("load1", "load2", "base.x", "base.y", "base.z", "support1.z")
    still = strip(
        loads=sm.PointForce(TIP, (0, 0, 1.0)),
        probes=[probe for probe in strip().probes if probe.name != "speed"],
        scheme="linear-statics",
    )
    run = sm.run(still, pictures=False).history.iloc[-1]
    given = static(found)
    for row, name in ((0, "tip"), (1, "between"), (3, "moment")):
        assert given[row, 0] == pytest.approx(run[name], rel=1e-7)
    # all goes along with its support, and nothing bends
    assert given[:, 5] == pytest.approx([1, 1, 0, 0], abs=1e-6)
    assert found.input_names[-2:] == ("support1.z", "support1.z''")
    for ending in (".npz", ".mat"):
        read = LinearSystem.load(found.save(tmp_path / f"strip{ending}"))
        np.testing.assert_array_equal(static(read), given)
        assert (read.inputs, read.outputs, read.kept) == (found.inputs, found.outputs, found.kept)


def test_state_spaces_of_all_unknowns_and_of_modes() -> None:
    found = sm.linearise(strip())
    whole, few = found.state_space(), found.state_space(modes=8)
    gain = -whole.C @ np.linalg.solve(whole.A, whole.B) + whole.D
    np.testing.assert_allclose(gain[0, :6], static(found)[0], rtol=1e-6, atol=1e-12)
    low = -few.C @ np.linalg.solve(few.A, few.B) + few.D
    names = found.modal(8).input_names
    # eight modes have a force's deflection to a part in a thousand, and a motion's at once
    assert low[0, names.index("load1")] == pytest.approx(gain[0, 0], rel=2e-3)
    assert low[0, names.index("support1.z")] == pytest.approx(1.0, rel=1e-6)
    assert found.to_scipy(modes=3).A.shape == (6, 6)
    first = found.descriptor()
    x = spla.spsolve(-first.A.tocsc(), first.B)
    np.testing.assert_allclose(
        (first.C @ x + first.D)[0, :6], static(found)[0], rtol=1e-7, atol=1e-12
    )


def test_joints_motors_and_dampers() -> None:
    found = sm.linearise(pendulum())
    made = sm.modes(pendulum(), rates=[0.0], count=3, pictures=False).table
    exact = made["growth_per_s"] + 1j * made["omega_rad_per_s"]
    np.testing.assert_allclose(found.poles(3), exact.to_numpy(), rtol=1e-8)
    assert "motor" in found.inputs
    gain = dict(zip(found.inputs, static(found).T, strict=True))
    # a torque on the hinge turns its springs, and the rod with it: about y, down by the arm
    turned = 1 / 5.5
    out = dict(zip(found.outputs, gain["motor"], strict=True))
    assert out["turn"] == pytest.approx(turned, rel=1e-7)
    assert out["ball"] == pytest.approx(-1.1 * turned, rel=1e-7)
    # ground that accelerates upwards is a weight: the pin carries all of it, the weld the ball's
    weight = 0.2 + 1000 * 0.02**2
    out = dict(zip(found.outputs, gain["base.z"], strict=True))
    assert out["weld.F3"] == pytest.approx(0.2, rel=1e-6)
    pin = np.array([out[f"pin.F{k}"] for k in (1, 2, 3)])
    assert np.linalg.norm(pin) == pytest.approx(weight, rel=1e-6)
    other = sm.linearise(pendulum(), constraints="kept")
    np.testing.assert_allclose(static(other), static(found), rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(other.poles(3), found.poles(3), rtol=1e-9)


def test_a_loaded_strip_and_a_run_of_it(tmp_path: Path) -> None:
    """Tension stiffens: poles are those of `modes --loaded`, and of the run's last state."""
    pulled = strip(loads=sm.EdgeForce("right", (2000.0, 0, 0)), supports=sm.Clamped("left"))
    exact = sm.modes(pulled, count=3, loaded=True, pictures=False).summary["omega_rad_per_s"]
    found = sm.linearise(pulled, at="equilibrium")
    np.testing.assert_allclose(np.abs(found.poles(3)), exact, rtol=1e-9)
    assert exact[0] > 1.1 * abs(sm.linearise(pulled).poles(1)[0])
    assert "equilibrium" in found.about
    run = sm.run(pulled.with_options(scheme="static", t_end=1.0), tmp_path / "run", pictures=False)
    np.testing.assert_allclose(np.abs(sm.linearise(run).poles(3)), exact, rtol=1e-9)
    read = sm.linearise(pulled, state=tmp_path / "run")
    np.testing.assert_allclose(read.poles(3), found.poles(3), rtol=1e-9)


def test_each_free_motion_is_one_pole() -> None:
    """Poles count motions: a double zero is one motion, and two single ones are two."""
    count = 3
    bodies = [sm.RigidBody(f"b{k}", 1.0 + k, (0.1,) * 3, position=(k, 0, 0)) for k in range(count)]
    slides = [
        sm.Prismatic(f"p{k}", sm.GROUND, f"b{k}", at=(k, 0, 0), axis=(0, 1, 0))
        for k in range(count)
    ]

    def scene(*elements: Any) -> sm.Scene:
        more = {**MOTION, "force_elements": elements}
        return sm.Scene("slides", rigid_bodies=bodies, joints=slides, **more)

    springs = [sm.JointSpring("s0", "p0", stiffness=100.0)]
    dampers = [sm.JointDamper(f"d{k}", f"p{k}", damping=3.0) for k in range(count)]
    for given, exact in (
        ((), [0, 0, 0]),
        (springs, [0, 0, 10j]),
        (dampers, [0, 0, 0, -1, -1.5, -3]),
        (dampers[1:], [0, 0, 0, -1, -1.5]),
    ):
        found = sm.linearise(scene(*given))
        for wanted in (len(exact), 1):
            np.testing.assert_allclose(found.poles(wanted), exact[:wanted], atol=1e-9)
    # and so do modes about states
    for given in ((), springs, dampers):
        made = sm.modes(sm.run(scene(*given), pictures=False), count=count, pictures=False)
        assert made.summary["rigid_modes"] == count - (given is springs)


@pytest.mark.parametrize("flexible", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_rotor_in_bearings_that_differ(flexible: bool) -> None:
    """In a frame that stands: the poles of its modes, in space."""
    scene = rotor("ep4", 1000.0, flexible)
    run = sm.run(scene, pictures=False)
    made = sm.modes(run, count=6, pictures=False).summary
    exact = np.array(made["growth_per_s"]) + 1j * np.array(made["omega_rad_per_s"])
    found = sm.linearise(run)
    poles = found.poles(10)
    for s in exact[np.abs(exact) > 1.0]:
        # modes of a flexible rotor are known to the tolerance of their eigensolver
        assert np.abs(poles - s).min() < (1e-7 if flexible else 1e-9) * abs(s)
    kept = sm.linearise(run, constraints="kept").poles(10)
    low, other = (p[(np.abs(p) > 1) & (np.abs(p) < 3000)] for p in (poles, kept))
    np.testing.assert_allclose(low, other, rtol=1e-9)
    # gyroscopic terms are no damping: they do no work
    skew = found.C - found.C.T
    assert abs(skew).max() > 100 * abs(found.C + found.C.T).max() * 1e-3


def test_a_steady_rotation() -> None:
    """A mass on an arm that turns: softer by the square of the rate, in the frame that turns."""
    arm = sm.Scene(
        "arm",
        rigid_bodies=[
            sm.RigidBody("arm", 1.0, (0.1, 0.1, 0.1)),
            sm.RigidBody("mass", 2.0, (0.1, 0.1, 0.1), com=(0.5, 0, 0)),
        ],
        joints=[
            sm.Revolute("axle", sm.GROUND, "arm", at=(0, 0, 0), axis=(0, 0, 1)),
            sm.Prismatic("slide", "arm", "mass", at=(0, 0, 0), axis=(1, 0, 0)),
        ],
        drivers=sm.Driver("motor", "axle", rotation=lambda t: 12.0 * t),
        force_elements=sm.JointSpring("spring", "slide", stiffness=1800.0),
        probes=sm.Probe("mass", "center", component=0, body="mass"),
        **MOTION,
    )
    found = sm.linearise(arm, rate=12.0)
    assert abs(found.poles(1)[0]) == pytest.approx(np.sqrt(900 - 144), rel=1e-9)
    # a driver that turns further accelerates the mass by Euler's and Coriolis' forces
    assert found.inputs == ("base.x", "base.y", "base.z", "motor.rotation")
    turned = found.F[1][:, 3]
    assert found.size == 1
    reach = 0.5 * 900 / (900 - 144)
    assert turned[0] / found.Y[0][0, 0] == pytest.approx(2 * 2.0 * 12.0 * reach, rel=1e-6)


def test_about_a_state_of_a_run_commands_are_held() -> None:
    """Kind: motors and loads that controllers command, by one output or several.

    A falling arm: `I phi'' = (f - m g) l cos phi + torque` with what is commanded at that time.
    """
    m, reach, g, inertia, tilt = 2.0, 0.5, 9.81, 0.3, 0.6
    middle = (reach * np.cos(tilt), 0, -reach * np.sin(tilt))
    arm = sm.RigidBody("arm", m, (inertia, inertia, inertia), com=middle)

    def law(t: float, readings: Any, state: Any, dt: float) -> Any:
        return (-0.2 * readings[0], 1.0 + 4.0 * t), state

    scene = sm.Scene(
        "arm",
        rigid_bodies=arm,
        joints=sm.Revolute("pin", sm.GROUND, "arm", at=(0, 0, 0), axis=(0, -1, 0)),
        # slow: a state that hardly moves
        force_elements=[
            sm.Motor("motor", "pin", command=sm.Command("c", "torque")),
            sm.JointDamper("slow", "pin", 200.0),
        ],
        controllers=sm.Controller(
            "c", sm.Sensor("pin.rotation"), law, outputs=("torque", "force"), period=0.05
        ),
        loads=[
            sm.Gravity(),
            sm.PointForce("center", (0, 0, 1.0), body="arm", time=sm.Command("c", "force")),
        ],
        probes=sm.Probe("z", "center", body="arm"),
        **MOTION | {"scheme": "ep4", "dt": 5e-3},
    )
    history = sm.run(scene.with_options(t_end=0.33), pictures=False).history
    phi = history["pin.rotation"].iloc[-1] - tilt
    # it creeps as slowly as its slowest mode
    with pytest.warns(sm.ShellmbWarning, match="is no steady motion"):
        found = sm.linearise(scene, at=0.33)
    # sampled last at 0.3; the speed that is left is not round-off
    exact = (1.0 + 4.0 * 0.3 - m * g) * reach * np.sin(phi) / (inertia + m * reach**2)
    assert found.K.toarray() / found.M.toarray() == pytest.approx(exact, rel=5e-4)
    assert exact < 0.95 * -m * g * reach * np.sin(phi) / (inertia + m * reach**2)
    # a torque and a force, each of one
    gain = static(found)[0]
    names = [found.inputs.index(name) for name in ("motor", "load2")]
    assert gain[names[1]] / gain[names[0]] == pytest.approx(reach * np.cos(phi), rel=1e-6)
    # commands are zero in an equilibrium
    hanging = replace(
        scene, force_elements=[*scene.force_elements, sm.JointSpring("k", "pin", 50.0)]
    )
    assert np.isfinite(sm.linearise(hanging, at="equilibrium").poles(1)).all()


def test_what_gravity_alone_holds_is_in_equilibrium() -> None:
    """A pendulum, in closed form, about where it hangs and about a state that it begins in."""
    arm = sm.RigidBody("arm", 2.0, (0.02, 0.02, 0.02), com=(0, 0, -0.4))
    scene = sm.Scene(
        "pendulum",
        rigid_bodies=arm,
        joints=sm.Revolute("pin", sm.GROUND, "arm", at=(0, 0, 0), axis=(0, 1, 0)),
        loads=sm.Gravity(),
        **MOTION,
    )
    exact = np.sqrt(2.0 * 9.81 * 0.4 / (0.02 + 2.0 * 0.4**2))
    for at in ("equilibrium", 0.0):
        found = sm.linearise(scene, at=at)  # type: ignore[arg-type]
        assert abs(found.poles(1)[0]) == pytest.approx(exact, rel=1e-9)


def test_a_motor_that_another_program_commands_has_its_default() -> None:
    """Kind: what is in the place of a command that is no controller's."""

    def driven(name: str = "motor", **own: Any) -> sm.Scene:
        elements = [sm.JointSpring("k", "pin", 5.0), sm.Motor(name, "pin", **own)]
        return replace(pendulum(), force_elements=elements, loads=(sm.Gravity(),))

    there = sm.linearise(driven(command=sm.Input("torque", 0.5)), at="equilibrium")
    same = sm.linearise(driven(law=lambda q, v, t: 0.5 + 0.0 * t), at="equilibrium")
    np.testing.assert_allclose(there.poles(3), same.poles(3), rtol=1e-9)
    without = sm.linearise(driven(law=lambda q, v, t: 0.0 * t), at="equilibrium")
    assert np.abs(there.poles(1) - without.poles(1)) > 1e-4
    with pytest.raises(SceneError, match="two inputs are called 'load1'"):
        sm.linearise(driven("load1", law=lambda q, v, t: 0.0 * t))


@pytest.mark.parametrize("along", [(0.2, 0.0, 0.0), (0.0, 0.3, 0.0), (0.1, 0.2, 0.3)])
def test_what_hangs_on_a_link_moves_as_its_modes(along: tuple[float, float, float]) -> None:
    """Kind: rows of constraints whose entries are zero, here of a link along an axis."""
    end = (1.0, 0.25, 0.25)
    scene = sm.Scene(
        "link",
        rigid_bodies=[
            sm.RigidBody("arm", 2.0, (0.1,) * 3, (1.0, 0, 0)),
            sm.RigidBody("mass", 5.0, (0.01,) * 3, tuple(np.add(end, along))),
        ],
        joints=[
            sm.Revolute("pin", sm.GROUND, "arm", at=(0, 0, 0), axis=(0, 1, 0)),
            sm.Distance("rod", "arm", "mass", at=end, second_at="center"),
        ],
        force_elements=sm.JointSpring("spring", "pin", stiffness=50.0),
        **MOTION,
    )
    found = sm.linearise(scene)
    # a rotation of the arm, and six motions of the mass less one
    assert found.size == 6
    exact = 2 * np.pi * sm.modes(scene, count=6).frequencies[-1]
    # a motion that is free is zero twice
    assert np.abs(found.poles(11))[-1] == pytest.approx(exact, rel=1e-9)


def test_a_law_that_fails_is_the_users(tmp_path: Path) -> None:
    """Kind: a function of ours around one of a user's stands in the sentence in its place."""

    def fails(angle: Any, rate: Any, time: Any) -> Any:
        raise KeyError("gain")

    def nothing(angle: Any, rate: Any, time: Any) -> Any:
        return None

    for law, said in ((fails, r"fails \(KeyError: 'gain'\)"), (nothing, "returns None; it must")):
        scene = replace(pendulum(), force_elements=sm.Motor("motor", "pin", law))
        with pytest.raises(
            SceneError, match=rf"test_linearise.py, line \d+: .* {law.__name__} {said}"
        ):
            sm.linearise(scene)


def test_bad_input_gets_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="at is 'there'; it must be 'rest', 'equilibrium' or a"):
        sm.linearise(strip(), at="there")  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="axis and about are given without rate"):
        sm.linearise(strip(), axis=(0, 0, 1))
    with pytest.warns(sm.ShellmbWarning, match="'all' is left out, as a norm is not linear"):
        unseen = sm.linearise(strip(probes=sm.Probe("all", TIP, component="norm")))
    assert not unseen.outputs
    with pytest.raises(SceneError, match=r"output is 'all', which is none \(a norm is not linear"):
        sm.response(unseen, outputs="all", frequencies=[1.0])
    found = sm.linearise(strip())
    with pytest.raises(SceneError, match="input is 'load3'; it must be one of 'load1', 'load2'"):
        found.select(inputs=["load3"])
    with pytest.raises(SceneError, match="modes is 0; it must be from 1 to"):
        found.state_space(modes=0)
    with pytest.raises(SceneError, match=r"must end in \.npz or \.mat"):
        found.save(tmp_path / "strip.txt")
    np.savez(tmp_path / "other.npz", a=1)
    (tmp_path / "empty.npz").touch()
    whole = found.save(tmp_path / "whole.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(whole[:300])
    (tmp_path / "empty.mat").touch()
    for name in ("other.npz", "empty.npz", "cut.npz", "empty.mat"):
        with pytest.raises(SceneError, match="holds no linear system"):
            LinearSystem.load(tmp_path / name)
    with pytest.raises(SceneError, match="cannot be written"):
        found.save(tmp_path / "gone" / "strip.npz")
    with pytest.raises(SceneError, match="rate is inf; it must be finite"):
        sm.linearise(strip(), rate=np.inf)
