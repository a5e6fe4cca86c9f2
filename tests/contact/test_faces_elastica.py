"""A strip that is folded onto itself, against an elastica that touches its mirror image.

The fold is a half circle when nothing acts, with straight legs. Forces on both ends press these
together until they touch; what then presses them on each other is what the elastica does not hold.
The reference is the planar elastica of one half, from the free end to the fold, whose tangent is
normal to the plane of symmetry: SciPy integrates `theta' = kappa_0 + P x/EI` and finds force and
angle at the end for a given distance from that plane.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

from shellmb.running.execute import execute
from shellmb.scene import (
    Contact,
    EdgeForce,
    Faces,
    Fixed,
    Isotropic,
    Parametric,
    Scene,
    Shell,
)
from shellmb.simulate.simulation import Simulation

RADIUS, LEG, WIDTH, THICK, YOUNG = 0.01, 0.06, 0.02, 1e-3, 1e9
LENGTH = 2 * LEG + np.pi * RADIUS


def held(distance: float) -> float:
    """Force per width with which an elastica ends at a distance from its plane of symmetry, N/m."""
    stiffness = YOUNG * THICK**3 / 12

    def fold(force: float, angle: float) -> np.ndarray:
        state = np.array([0.0, 0.0, angle])
        for begin, end, curvature in ((0, LEG, 0.0), (LEG, LENGTH / 2, 1 / RADIUS)):

            def slopes(_: float, q: np.ndarray, k: float = curvature) -> list[float]:
                return [np.cos(q[2]), np.sin(q[2]), k + force * q[0] / stiffness]

            found = solve_ivp(slopes, (begin, end), state, rtol=1e-10, atol=1e-13)
            state = found.y[:, -1]
        return state

    def missed(unknown: np.ndarray) -> list[float]:
        _, y, theta = fold(*unknown)
        return [theta - np.pi / 2, (y - distance) / RADIUS]

    found = root(missed, [3.0, -0.1])
    assert found.success
    return float(found.x[0])


def folded(elements: int, force: float) -> Scene:
    """The strip, pressed by forces per width on its ends.

    Args:
        elements: Elements along it.
        force: The force, N/m.
    """

    def place(xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        s = LENGTH * xi
        a = np.clip((s - LEG) / RADIUS, 0.0, np.pi)
        back = np.maximum(s - LEG - np.pi * RADIUS, 0.0)
        x = np.minimum(s, LEG) + RADIUS * np.sin(a) - back
        return np.array([x, WIDTH * eta, -RADIUS * np.cos(a)])

    # without Poisson's ratio the strip is a beam
    section = Isotropic(YOUNG, 0.0, thickness=THICK, density=1000.0)
    fold = (LEG + RADIUS, 0.0, 0.0)
    touch = Contact("touch", Faces("strip", THICK), stiffness=5e8, radius=THICK / 2, smoothing=2e-5)
    return Scene(
        "folded",
        Shell("strip", Parametric(place), section, mesh=(elements, 1)),
        supports=[
            Fixed(fold, (0, 0, 0), director=(None, 0, 0)),
            Fixed((LEG + RADIUS, WIDTH, 0.0), (None, None, 0)),
        ],
        loads=[EdgeForce("left", (0, 0, force)), EdgeForce("right", (0, 0, -force))],
        contacts=touch,
        scheme="static",
        dt=0.1,
        t_end=1.0,
    )


@pytest.mark.parametrize(
    ("elements", "bound"),
    [(12, 0.02), *(pytest.param(n, 5e-3, marks=pytest.mark.slow) for n in (16, 24, 32))],
)
def test_legs_press_on_each_other_with_what_the_elastica_does_not_hold(
    elements: int, bound: float
) -> None:
    """Of twelve elements three are along the arc, of 16 four; it begins and ends within others.

    With 24 and 32 the legs would pass through each other in the step in which they meet.
    """
    force = 12.0
    run = execute(folded(elements, force))
    history = run.history
    for t in (0.6, 1.0):
        now = history.iloc[int(np.argmin(abs(history["t"] - t)))]
        distance = (THICK - now["touch.penetration"]) / 2
        expected = (now.t * force - held(distance)) * WIDTH
        # of the force that the strip holds 0.6 and 0.06 % were seen, by the mesh
        assert now["touch.normal"] == pytest.approx(expected, abs=bound * held(distance) * WIDTH)
    # none before they touch
    assert history["touch.normal"][4] == 0 and held(THICK / 2) > 0.4 * force
    # ends that face each other slide off; there are no paths and modes with faces
    (unstable,) = (w.says for w in run.warnings if w.watch == "stability")
    assert "A node that faces a node or an end" in unstable and "path=" not in unstable
    assert len(run.warnings) == 1


@pytest.mark.slow
def test_solutions_that_touch_elsewhere_each_time_end() -> None:
    """Pairs are found about the end of a solution, which the next one may not reach.

    The kind: a step that is solved anew until its pairs cover it. This one was solved for ever,
    with two sets of pairs in turn.
    """
    simulation = Simulation(folded(24, 12.0))
    simulation.run()
    assert simulation.t == pytest.approx(1.0)
