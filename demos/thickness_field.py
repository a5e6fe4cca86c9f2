"""The thickness of a plate, element by element, with which it deflects least after a sudden load.

A cantilever plate of 12x8 elements is loaded suddenly at its free edge. SciPy chooses the 96
thicknesses, with the mass as it was; `sm.adjoint` gives all derivatives by one sweep backwards
through each run.
"""

# KIND: vibrations and motion
# CI: shellmb run thickness_field --check --no-pictures
# CI --all: python -m shellmb.demos.thickness_field

import numpy as np
from scipy.optimize import minimize

import shellmb as sm

NX, NY = 12, 8
LENGTH, WIDTH, THICKNESS = 0.6, 0.4, 4e-3
# largest and smallest thickness over that of the even plate
BOUNDS = (0.5, 2.0)
# the largest deflection as a mean of this power over time, which has derivatives
POWER = 8
ITERATIONS = 8


def number(x, y):
    """Number of the element at a position, for arrays alike."""
    i = np.clip((np.asarray(x) / LENGTH * NX).astype(int), 0, NX - 1)
    j = np.clip((np.asarray(y) / WIDTH * NY).astype(int), 0, NY - 1)
    return i * NY + j


def scene(shape=None):
    """The plate.

    Args:
        shape: Thickness of each element over that of the even plate, shape (96,); None: ones.
    """
    h = THICKNESS * (np.ones(NX * NY) if shape is None else np.asarray(shape))
    steel = sm.Isotropic(E=210e9, nu=0.3, thickness=lambda x: h[number(x[0], x[1])], density=7850.0)
    return sm.Scene(
        "thickness_field",
        sm.Shell("plate", sm.Rectangle(LENGTH, WIDTH), steel, mesh=(NX, NY)),
        supports=sm.Clamped("left"),
        loads=sm.EdgeForce("right", (0, 0, 500.0)),
        probes=[sm.Probe(f"edge_{k}", (LENGTH, k * WIDTH / 2, 0), component=2) for k in range(3)],
        scheme="ed",
        dt=4e-3,
        # half a period of the even plate is 45 ms
        t_end=0.06,
        units="m, kg, s",
    )


def deflection(history):
    """Nearly the largest deflection of the free edge [m]."""
    edge = np.array([history[f"edge_{k}"] for k in range(3)])
    return float(np.mean(edge**POWER) ** (1 / POWER))


def evaluate(shape):
    """The deflection over that of the even plate in mm, and its derivatives."""
    found = sm.adjoint(scene, deflection, [("plate", "thickness")], values={"shape": shape})
    table, slope = found.fields["plate", "thickness"], np.empty(NX * NY)
    slope[number(table.x, table.y)] = table.derivative * THICKNESS
    return 1e3 * found.value, 1e3 * slope


def optimise(iterations=ITERATIONS):
    """SciPy's sequential quadratic programming with the mass fixed."""
    start = np.ones(NX * NY)
    mass = {
        "type": "eq",
        "fun": lambda s: s.mean() - 1,
        "jac": lambda s: np.full_like(s, 1 / len(s)),
    }
    return minimize(
        evaluate,
        start,
        jac=True,
        method="SLSQP",
        bounds=[BOUNDS] * len(start),
        constraints=mass,
        options={"maxiter": iterations},
    )


def results(run):
    """The largest deflection of the middle of the edge."""
    return {"peak": float(run.column("edge_1").max())}


def check(results):
    """Twice the static deflection, 29 mm by beam theory, less what it is stiffer by across."""
    assert 0.04 < results["peak"] < 0.06


def main() -> None:
    """Optimise, and judge what was found."""
    before, slope = evaluate(np.ones(NX * NY))
    # a derivative is that of a run with one element thicker
    thick = np.ones(NX * NY)
    thick[number(0.02, 0.02)] += 1e-4
    assert abs((evaluate(thick)[0] - before) / 1e-4 / slope[number(0.02, 0.02)] - 1) < 1e-2
    found = optimise()
    shape = found.x.reshape(NX, NY)
    print(f"deflection {before:.2f} mm, optimised {found.fun:.2f} mm, {found.nfev} runs")
    for row in shape.T:
        print(*(f"{THICKNESS * 1e3 * t:.2f}" for t in row))
    assert abs(found.x.mean() - 1) < 1e-6
    assert found.fun < 0.4 * before
    # a spine from the clamp, thin where the plate is only moved, the same on both sides of it
    spine = shape[:, NY // 2 - 1 : NY // 2 + 1]
    assert spine[: NX // 2].min() > 1.9 and spine[-1].max() < 0.6
    assert shape[: NX // 2, [0, -1]].mean() < 1
    assert np.abs(shape - shape[:, ::-1]).max() < 0.05


if __name__ == "__main__":
    main()
