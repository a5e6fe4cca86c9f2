"""Bodies in modes where they are hard on a scheme, and where they must say that they are wrong.

Stiff modes in steps of many of their periods: a plate of 4 x 0.3 x 0.02 m whose highest mode has
some hundred oscillations in a step, which spins by half a radian in it. And a soft one that spins
at a third of its lowest frequency: a linear theory about a frame knows no centrifugal stiffness.
"""

import pytest

from shellmb.running.execute import RunResult, execute
from shellmb.scene import InitialVelocity, Isotropic, Modal, Rectangle, Scene, Shell

STIFF = Isotropic(E=40e9, nu=0.0, thickness=0.02, density=1900.0)
SOFT = Isotropic(E=1e9, nu=0.0, thickness=0.02, density=1900.0)
RATE, DT = 10.0, 0.05
LATER = (("ed", 1.0), ("ep4", 0.0))
SCHEMES = [("ep", 0.0), *(pytest.param(*pair, marks=pytest.mark.slow) for pair in LATER)]


def spin(section: Isotropic, scheme: str, alpha: float, rate: float) -> RunResult:
    """A free plate that spins about its normal and tumbles a little."""
    surface = Rectangle(4.0, 0.3, (-2.0, -0.15, 0.0))
    plate = Shell("plate", surface, section, mesh=(4, 1), model=Modal(modes=7))
    given = InitialVelocity(spin=(0.05 * rate, 0.0, rate))
    more = {"scheme": scheme, "alpha": alpha, "dt": DT, "t_end": 40 * DT}
    return execute(Scene("spin", plate, initial=given, **more))


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_stiff_modes_spin_in_steps_of_many_periods(scheme, alpha, worst) -> None:
    result = spin(STIFF, scheme, alpha, RATE)
    worst("energy law", result.summary["energy_balance_error"], 1e-9)
    worst("constraints", result.summary["constraint_max"], 1e-10)
    worst("linear momentum drift", result.summary["linear_momentum_drift"], 1e-10)
    if scheme == "ep":
        worst("angular momentum drift", result.summary["angular_momentum_drift"], 1e-10)


def test_modes_that_spin_fast_say_what_they_do_not_know() -> None:
    slow, fast = (
        [item.says for item in spin(SOFT, "ep", 0.0, rate).warnings if item.body == "plate"]
        for rate in (0.05, 2.0)
    )
    assert not any("its modes do not know" in text for text in slow)
    (said,) = [text for text in fast if "its modes do not know" in text]
    # the first free mode of a bar: 22.37 sqrt(E t^2 / 12 rho) / L^2 = 5.86 rad/s, nearly a plate's
    assert "spins at 2 rad/s" in said and "0.34 of its lowest frequency" in said
