"""Identify modulus, damping and tip mass of a plate from a noisy record of its tip (`sm.fit`).

A steel strip carries a small mass at its free end, and is pulled to the side by a sudden force.
What is measured is the deflection of the tip and of the middle, each with noise. The record is made
by a run with known values, so that the fit can be judged.

`python -m shellmb.demos.identify_plate 20` fits twenty records with other noise, and judges by
statistics whether the fitted values are as far off as their standard deviations say.
"""

# KIND: vibrations and motion
# CI: shellmb run identify_plate --check --no-pictures
# CI: python -m shellmb.demos.identify_plate

import sys
from collections.abc import Sequence
from functools import cache

import numpy as np
from scipy import stats

import shellmb as sm

# what the record is made with, and where a fit begins
TRUTH = {"E": 200e9, "damping": 3e-3, "mass": 0.08}
GUESS = {"E": 215e9, "damping": 2e-3, "mass": 0.06}
# standard deviation of the noise of both sensors [m]: a tenth of a millimetre
NOISE = 1e-4
# a normal distribution has 95 % within two deviations, and all of a few hundred within five
WITHIN, ALL = 2.0, 5.0
# runs that a fit takes at most
RUNS = 12
# records at most: of these values all are within five deviations as seldom as a test rejects
RECORDS = 500
# a test rejects what would be found so seldom if deviations were right
SELDOM = 1e-3


def scene(
    E: float = TRUTH["E"],
    damping: float = TRUTH["damping"],
    mass: float = TRUTH["mass"],
    t_end: float = 0.4,
):
    """The strip with the mass at its end.

    Args:
        E: Young's modulus [Pa].
        damping: Time of the damping in bending [s].
        mass: Mass at the end [kg].
        t_end: End of the record [s].
    """
    steel = sm.Isotropic(
        E=E,
        nu=0.3,
        thickness=2e-3,
        density=7850.0,
        stiffness_damping=sm.ShellDamping(bending=damping),
    )
    size = 0.02  # of the mass, a cube [m]
    return sm.Scene(
        "identify_plate",
        sm.Shell("strip", sm.Rectangle(0.5, 0.04), steel, mesh=(4, 1)),
        rigid_bodies=sm.RigidBody(
            "tip mass", mass, (mass * size**2 / 6,) * 3, position=(0.5, 0.02, 0)
        ),
        joints=sm.Spherical("bolt", "strip", "tip mass", at=(0.5, 0.02, 0)),
        supports=sm.Clamped("left"),
        loads=sm.EdgeForce("right", (0, 0, 40.0)),
        probes=(
            sm.Probe("tip", (0.5, 0.02, 0), body="strip", component=2),
            sm.Probe("middle", (0.25, 0.02, 0), body="strip", component=2),
        ),
        scheme="ep4",
        dt=1e-2,
        t_end=t_end,
        units="m, kg, s",
    )


@cache
def exact():
    """The record without noise."""
    return sm.run(scene(), pictures=False).history[["t", "tip", "middle"]].iloc[1:]


def record(seed: int):
    """A record of both sensors with noise.

    Args:
        seed: Which noise.
    """
    history = exact()
    noise = NOISE * np.random.default_rng(seed).standard_normal((len(history), 2))
    return history.assign(tip=history.tip + noise[:, 0], middle=history.middle + noise[:, 1])


def identify(seed: int) -> sm.Fit:
    """Fit the three parameters to a record."""
    return sm.fit(scene, record(seed), tuple(GUESS), noise=NOISE, values=GUESS)


def off(fitted: sm.Fit) -> dict[str, float]:
    """Distance of values from the truth, in their deviations."""
    return {
        name: (fitted.values[name] - true) / fitted.deviations[name] for name, true in TRUTH.items()
    }


def independent(fitted: sm.Fit) -> np.ndarray:
    """Distances from the truth in uncorrelated directions, in their deviations."""
    apart = np.array([fitted.values[name] - true for name, true in TRUTH.items()])
    covariance = fitted.covariance.loc[list(TRUTH), list(TRUTH)].to_numpy()
    units = np.sqrt(np.diag(covariance))
    return np.linalg.solve(np.linalg.cholesky(covariance / np.outer(units, units)), apart / units)


def judge(far: np.ndarray, normal: np.ndarray) -> dict[str, float]:
    """Judge values of many records, each with other noise.

    Args:
        far: Distances of values from the truth in their deviations, shape (records, parameters).
        normal: Distances in uncorrelated directions (`independent`), of the same shape.

    Returns:
        `within`: how many are within two deviations; `largest`: the largest distance; and how
        probable results are that fit worse: `coverage` with fewer or more values within two
        deviations, `chi_square` with another sum of squares, `normality` with another distribution
        (Kolmogorov and Smirnov).
    """
    numbers, count = normal.ravel(), normal.size
    inside = int(np.sum(np.abs(numbers) < WITHIN))
    share = stats.norm.cdf(WITHIN) - stats.norm.cdf(-WITHIN)
    squares = float(numbers @ numbers)
    side = stats.chi2.cdf(squares, count)
    return {
        "within": int(np.sum(np.abs(far) < WITHIN)),
        "largest": float(np.abs(far).max()),
        "coverage": float(stats.binomtest(inside, count, share).pvalue),
        "chi_square": float(2 * min(side, 1 - side)),
        "normality": float(stats.kstest(numbers, "norm").pvalue),
    }


def study(seeds: Sequence[int]) -> dict[str, float]:
    """Fit records with other noise, print a line for each, and judge the values.

    Args:
        seeds: Noise of each.
    """
    far, normal = [], []
    for seed in seeds:
        fitted = identify(seed)
        assert fitted.converged and fitted.runs <= RUNS
        far.append(list(off(fitted).values()))
        normal.append(independent(fitted))
        print(f"{seed:4} {fitted.runs:4} runs " + " ".join(f"{x:+.2f}" for x in far[-1]))
    found = judge(np.array(far), np.array(normal))
    print(f"{found['within']} of {3 * len(far)} values within two deviations; " + str(found))
    return found


def check_study(found: dict[str, float]) -> None:
    """Values are as far off as deviations say."""
    assert found["largest"] < ALL
    assert min(found[test] for test in ("coverage", "chi_square", "normality")) > SELDOM


def results(run):
    """Largest deflection of the tip, of the record without noise."""
    return {"peak_tip": float(run.column("tip").max())}


def check(results):
    """About twice the static deflection `F L^3/(3 E I)`, less what damping takes."""
    stiff = 3 * TRUTH["E"] * 0.04 * 2e-3**3 / 12 / 0.5**3
    static = 40.0 * 0.04 / stiff
    assert 1.5 * static < results["peak_tip"] < 2.0 * static


def main() -> None:
    """Identify, and judge what was found; with a number of records by statistics."""
    if given := " ".join(sys.argv[1:]):
        count = int(given) if given.isdecimal() else 0
        if not 1 <= count <= RECORDS:
            sys.exit(f"records are '{given}'; they must be a whole number from 1 to {RECORDS}")
        check_study(study(range(count)))
        return
    fitted = identify(seed=1)
    print(fitted)
    assert fitted.converged and not fitted.warnings
    assert fitted.runs <= RUNS
    assert all(abs(far) < WITHIN for far in off(fitted).values()), off(fitted)
    fitted.plot().savefig("identify_plate.png")


if __name__ == "__main__":
    main()
