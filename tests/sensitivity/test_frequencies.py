"""Derivatives of natural frequencies: of a thin strip they are known."""

import numpy as np
import pytest

import shellmb as sm


def strip(thickness: float = 2e-3, E: float = 210e9, length: float = 1.0) -> sm.Scene:
    """A cantilever strip, whose bending frequencies go by `h sqrt(E) / L^2`."""
    steel = sm.Isotropic(E=E, nu=0.0, thickness=thickness, density=7800.0)
    shell = sm.Shell("strip", sm.Rectangle(length, 0.05), steel, mesh=(4, 1))
    return sm.Scene("strip", shell, supports=sm.Clamped("left"), scheme="ep", dt=1e-3, t_end=1e-3)


def test_frequencies_of_a_strip() -> None:
    found = sm.frequency_sensitivities(strip, ("thickness", "E"), count=2)
    f = found["frequency"].to_numpy()
    # exact for the modulus; of the thickness less what shear and rotary inertia take
    np.testing.assert_allclose(found["E"] * 210e9 / f, 0.5, rtol=1e-7)
    np.testing.assert_allclose(found["thickness"] * 2e-3 / f, 1.0, rtol=1e-3)


def test_loads_have_no_frequencies() -> None:
    """Unloaded modes: the scene changes with its load, no frequency does."""

    def pushed(push: float = 1.0) -> sm.Scene:
        made = strip()
        return sm.Scene(**{**vars(made), "loads": sm.EdgeForce("right", (0, 0, push))})

    with pytest.warns(sm.ShellmbWarning, match="no frequency depends on 'push' near 1"):
        found = sm.frequency_sensitivities(pushed, ("push",), count=1)
    assert (found["push"] == 0).all()


def test_equal_frequencies_have_no_derivative() -> None:
    def bar(size: float = 0.02) -> sm.Scene:
        section = sm.RectangularSection(width=size, height=size, E=210e9, nu=0.3, density=7800.0)
        beam = sm.Beam("bar", sm.Line((0, 0, 0), (1, 0, 0)), section, elements=2)
        clamp = sm.Clamped("start", body="bar")
        return sm.Scene("bar", beams=beam, supports=clamp, scheme="ep", dt=1e-3, t_end=1e-3)

    with pytest.warns(sm.ShellmbWarning, match=r"frequencies 1, 2 nearly coincide"):
        found = sm.frequency_sensitivities(bar, ("size",), count=2)
    assert found["size"].isna().all()


@pytest.mark.parametrize(("second", "simple"), [(100.3, True), (100.1, False)])
def test_scenes_with_few_frequencies(second: float, simple: bool) -> None:
    """There is none behind the last one, which says whether that is simple."""

    def masses(stiffness: float = 100.0, mass: float = 1.0) -> sm.Scene:
        body = {"mass": mass, "inertia": (1, 1, 1)}
        names, stiffnesses = ("a", "b"), (stiffness, second)
        return sm.Scene(
            "masses",
            rigid_bodies=[sm.RigidBody(n, position=(k, 0, 0), **body) for k, n in enumerate(names)],
            joints=[
                sm.Prismatic(f"slide {n}", sm.GROUND, n, at=(k, 0, 0), axis=(0, 0, 1))
                for k, n in enumerate(names)
            ],
            force_elements=[
                sm.JointSpring(f"spring {n}", f"slide {n}", stiffness=k)
                for n, k in zip(names, stiffnesses, strict=True)
            ],
            scheme="ep",
            dt=0.1,
            t_end=0.1,
        )

    if not simple:
        with pytest.warns(sm.ShellmbWarning, match="frequencies 1, 2 nearly coincide"):
            assert sm.frequency_sensitivities(masses, ("mass",)).mass.isna().all()
        return
    found = sm.frequency_sensitivities(masses, ("stiffness", "mass"))
    exact = np.sqrt([100.0, second]) / (2 * np.pi)
    # the square of the distance of both sides, 1e-8
    np.testing.assert_allclose(found.frequency, exact, rtol=1e-9)
    np.testing.assert_allclose(found.mass, -exact / 2, rtol=1e-7)
    np.testing.assert_allclose(found.stiffness, [exact[0] / 200, 0.0], rtol=1e-7, atol=1e-9)
