"""Springs and dampers with which the antenna of section 6.3 overshoots least (`sm.sensitivities`).

A reduced antenna: each panel with its beams is one rigid body, and both hinges of a line are one.
Its hinges overshoot nearly as those of the antenna with panels as beams. SciPy changes the springs
and the dampers of the four lines, each between a half and twice that of the paper; one run gives
the overshoot with all eight derivatives. All hinges must be open at the end.
"""

# KIND: vibrations and motion
# CI: shellmb run antenna_springs --check --no-pictures
# CI --all: python -m shellmb.demos.antenna_springs

import numpy as np
from scipy.optimize import minimize

import shellmb as sm
from shellmb.demos.antenna import CONNECTOR, JOINT_MASS, LAWS, REINFORCING, RHO, laminate, potential

LENGTH, WIDTH, GAP = 5.0, 2.0, 0.2
# springs first, then dampers, each of the lines A1, C1, C2, C3
NAMES = tuple(f"{kind}_{line}" for kind in ("spring", "damper") for line in LAWS)
BOUNDS = (0.5, 2.0)
# the largest overshoot as a mean of this power over time, which has derivatives
POWER = 8
# least opening at the end
OPEN = 0.95
ITERATIONS = 5
# of the overshoot for SciPy, whose first step is the derivative: half a factor
SCALE = 10.0


def scene(
    spring_A1: float = 1.0,
    spring_C1: float = 1.0,
    spring_C2: float = 1.0,
    spring_C3: float = 1.0,
    damper_A1: float = 1.0,
    damper_C1: float = 1.0,
    damper_C2: float = 1.0,
    damper_C3: float = 1.0,
    dt: float = 2.0,
    t_end: float = 110.0,
):
    """The antenna of rigid panels.

    Args:
        spring_A1: Moment of both springs of line A1 over that of the paper.
        spring_C1: Moment of both springs of line C1 over that of the paper.
        spring_C2: Moment of both springs of line C2 over that of the paper.
        spring_C3: Moment of both springs of line C3 over that of the paper.
        damper_A1: Constant of both dampers of line A1 over that of the paper.
        damper_C1: Constant of both dampers of line C1 over that of the paper.
        damper_C2: Constant of both dampers of line C2 over that of the paper.
        damper_C3: Constant of both dampers of line C3 over that of the paper.
        dt: Time step [s].
        t_end: End [s]; the hinges pass 90 % at 76 s.
    """
    springs = (spring_A1, spring_C1, spring_C2, spring_C3)
    dampers = (damper_A1, damper_C1, damper_C2, damper_C3)
    bodies, joints, elements = [], [], []
    A, before, sign = np.zeros(3), sm.GROUND, 1.0
    laws = zip(LAWS.items(), springs, dampers, strict=True)
    for k, ((line, (M_0, theta_0, n, mu)), spring, damper) in enumerate(laws):
        place = tuple(map(float, A if k == 0 else A - np.array([GAP, 0, 0])))
        bodies.append(panel(f"panel{k + 1}", A, sign, k > 0))
        axis = (0.0, sign, 0.0)
        joints.append(
            sm.Revolute(line, before, f"panel{k + 1}", at=place, mass=2 * JOINT_MASS, axis=axis)
        )
        law = potential(2 * spring * M_0, theta_0, n)
        elements.append(sm.JointSpring(f"spring-{line}", line, potential=law))
        elements.append(sm.JointDamper(f"damper-{line}", line, damping=2 * damper * mu))
        A = A + np.array([GAP, 0, sign * LENGTH])
        before, sign = f"panel{k + 1}", -sign
    return sm.Scene(
        "antenna_springs",
        rigid_bodies=bodies,
        joints=joints,
        force_elements=elements,
        probes=[
            sm.Probe(f"turn{k + 1}", "center", "rotation", 1, body=f"panel{k + 1}")
            for k in range(len(LAWS))
        ],
        scheme="ed",
        alpha=1.0,
        dt=dt,
        t_end=t_end,
        units="m, kg, s",
    )


def panel(name, A, sign, connected):
    """A panel with its two beams, and the connectors that hold it, as a rigid body.

    Args:
        name: Its name.
        A: Middle of its first edge [m].
        sign: Whether it is stowed upwards (1) or downwards (-1).
        connected: Whether connectors lead to it.
    """
    skin = laminate(True, 1600.0, 7.1e9, 3.2e9)
    beam, up = RHO * REINFORCING**2 * WIDTH, np.array([0.0, 0.0, sign])
    # mass, centre, and sides of each box
    boxes = [
        (skin.mass[0] * LENGTH * WIDTH, A + LENGTH / 2 * up, (0, WIDTH, LENGTH)),
        (beam, A, (REINFORCING, WIDTH, REINFORCING)),
        (beam, A + LENGTH * up, (REINFORCING, WIDTH, REINFORCING)),
    ]
    if connected:
        bar, half = RHO * CONNECTOR**2 * GAP, (GAP / 2, 0, 0)
        for side in (-WIDTH / 2, WIDTH / 2):
            boxes.append((bar, A - half + (0, side, 0), (GAP, CONNECTOR, CONNECTOR)))
    mass = sum(m for m, _, _ in boxes)
    centre = sum(m * np.asarray(x) for m, x, _ in boxes) / mass
    inertia = np.zeros((3, 3))
    for m, x, sides in boxes:
        r, s = x - centre, np.square(sides) / 12
        inertia += m * (np.diag(s.sum() - s) + r @ r * np.eye(3) - np.outer(r, r))
    return sm.RigidBody(
        name,
        float(mass),
        tuple(map(tuple, inertia.tolist())),
        tuple(map(float, centre)),
        # the sides of an equivalent box would be longer: beams are at the ends
        shape=(skin.thickness, WIDTH, LENGTH),
    )


def opening(history, line):
    """Rotation of a line of hinges as a part of its `theta_0`, over time.

    Args:
        history: Of a run, or its derivatives by a parameter.
        line: The line.
    """
    k = list(LAWS).index(line)
    turned = history[f"turn{k + 1}"] - (history[f"turn{k}"] if k else 0.0)
    return (-1) ** k * turned.to_numpy() / LAWS[line][1]


def evaluate(factors):
    """Overshoot and openings at the end, each with its derivatives by the factors.

    Args:
        factors: Of `NAMES`, shape (8,).

    Returns:
        Overshoot, its derivatives (8,), openings (4,), their derivatives (4, 8).
    """
    values = dict(zip(NAMES, map(float, factors), strict=True))
    found = sm.sensitivities(scene, NAMES, values=values, columns="probes")
    run = found.run.history
    turned = np.array([opening(run, line) for line in LAWS])
    # (line, time, parameter)
    slopes = np.array([[opening(found.history[p], line) for p in NAMES] for line in LAWS])
    slopes = slopes.transpose(0, 2, 1)
    over = np.maximum(turned - 1, 0)
    mean = np.mean(over**POWER)
    weights = over ** (POWER - 1) / over.size * mean ** (1 / POWER - 1)
    overshoot = mean ** (1 / POWER)
    return overshoot, np.einsum("lt,ltp->p", weights, slopes), turned[:, -1], slopes[:, -1]


def optimise(iterations=ITERATIONS):
    """SciPy's sequential quadratic programming; each run is used for all that it asks of it."""
    known = {}

    def at(factors):
        key = tuple(factors)
        if key not in known:
            known[key] = evaluate(factors)
        return known[key]

    open_ = {"type": "ineq", "fun": lambda x: at(x)[2] - OPEN, "jac": lambda x: at(x)[3]}
    found = minimize(
        lambda x: SCALE * at(x)[0],
        np.ones(len(NAMES)),
        jac=lambda x: SCALE * at(x)[1],
        method="SLSQP",
        bounds=[BOUNDS] * len(NAMES),
        constraints=open_,
        options={"maxiter": iterations},
    )
    return found, known


def results(run):
    """Largest overshoot of a hinge, and the least opening at the end."""
    turned = np.array([opening(run.history, line) for line in LAWS])
    return {"overshoot": float(turned.max() - 1), "open": float(turned[:, -1].min())}


def check(results):
    """As the paper's antenna: about a tenth beyond, and open at the end."""
    assert 0.08 < results["overshoot"] < 0.15
    assert results["open"] > 0.9


def main() -> None:
    """Optimise, and judge what was found."""
    found, known = optimise()
    begin, *_ = known[(1.0,) * len(NAMES)]
    least = found.fun / SCALE
    print(f"overshoot {100 * begin:.1f} %, optimised {100 * least:.1f} %, {len(known)} runs")
    for name, factor in zip(NAMES, found.x, strict=True):
        print(f"{name} {factor:.2f}")
    opened = known[tuple(found.x)][2].min()
    # six runs: 6.6 % become 1.2 %, and the constraint holds to the step that is left
    assert least < 0.25 * begin
    assert opened > OPEN - 0.02


if __name__ == "__main__":
    main()
