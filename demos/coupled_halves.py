"""One plate split in two programs' worth of motions: coupled implicitly they are the whole plate.

Each half is a scene of its own, whose inputs are forces and moments at the three nodes of the cut.
Implicit coupling repeats each step until both halves have the same places and directors there
(interface quasi-Newton: a Jacobian by trials once, Broyden's updates from then on). Then they are
the whole plate to round-off, and what one half gets the other one gives. Explicit coupling by
springs, whose forces are those at the start of the step, takes one trial and makes energy of its
own: `work_inputs` of both halves shows how much. The file is no scene, because it steps two of
them: run it by

    python -m shellmb.demos.coupled_halves
"""

# CI: python -m shellmb.demos.coupled_halves

import numpy as np

import shellmb as sm

SECTION = sm.Isotropic(E=1e7, nu=0.3, thickness=0.02, density=1000.0)
LENGTH, WIDTH = 0.4, 0.2  # of a half [m]
NODES = [(LENGTH, y, 0.0) for y in (0.0, WIDTH / 2, WIDTH)]  # of the cut
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
DT, SPRING = 5e-3, 100.0  # [s], [N/m]


def plate(scheme="ep", begin=0.0, elements=2, cut=False):
    """The plate or a half of it, clamped at x = 0, with forces and moments at the cut."""
    loads: list[sm.Load] = [sm.Gravity((0.0, 1.0, -9.81))]
    for k, node in enumerate(NODES if cut else ()):
        loads += [sm.PointForce(node, e, time=sm.Input(f"F{k}{c}")) for c, e in AXES.items()]
        # a shell has no moment about its director
        loads += [sm.PointMoment(node, AXES[c], time=sm.Input(f"M{k}{c}")) for c in "xy"]
    return sm.Scene(
        "plate",
        sm.Shell(
            "plate",
            sm.Rectangle(LENGTH * elements, WIDTH, origin=(begin, 0.0, 0.0)),
            SECTION,
            mesh=(elements, 1),
        ),
        supports=sm.Clamped("left") if begin == 0.0 else (),
        loads=loads,
        scheme=scheme,
        dt=DT,
        t_end=1.0,
        solver=sm.Solver(tolerance=1e-9, newton="full"),
    )


class Half:
    """One side of the cut: takes forces, gives places."""

    def __init__(self, scheme, begin, sign):
        self.motion, self.sign = sm.SceneMotion(plate(scheme, begin, 1, cut=True)), sign
        known = self.motion.nodes("plate").reference
        self.rows = [int(np.argmin(np.linalg.norm(known - node, axis=1))) for node in NODES]

    def places(self):
        """Displacements at the cut, and what directors have along the plate, shape (15,)."""
        now = self.motion.nodes("plate")
        parts = now.displacement[self.rows], now.director[self.rows, :2]
        return np.concatenate([part.ravel() for part in parts])

    def tried(self, forces, dt=DT):
        """Places at the end of a step under forces and moments, which is not accepted yet."""
        names = [f"F{k}{c}" for k in range(3) for c in "xyz"]
        names += [f"M{k}{c}" for k in range(3) for c in "xy"]
        self.motion.inputs.update(zip(names, (self.sign * forces).tolist(), strict=True))
        self.motion.trial(dt)
        return self.places()


def halves(scheme="ep"):
    """Both halves."""
    return Half(scheme, 0.0, 1.0), Half(scheme, LENGTH, -1.0)


class Implicit:
    """Interface quasi-Newton of both halves."""

    def __init__(self, scheme="ep"):
        self.halves, self.forces = halves(scheme), np.zeros(15)
        here = self.gap(self.forces)
        columns = [(self.gap(self.forces + 1e-3 * e) - here) / 1e-3 for e in np.eye(15)]
        self.jacobian = np.array(columns).T

    def gap(self, forces):
        """Distance of both sides of the cut at the end of a trial."""
        a, b = self.halves
        return a.tried(forces) - b.tried(forces)

    def step(self):
        """A step; returns the number of trials that it took."""
        here, count = self.gap(self.forces), 1
        # round-off of places of 1 m
        while np.abs(here).max() > 2e-14 and count < 30:
            change = np.linalg.solve(self.jacobian, -here)
            self.forces = self.forces + change
            new = self.gap(self.forces)
            rest = new - here - self.jacobian @ change
            self.jacobian += np.outer(rest, change) / (change @ change)
            here, count = new, count + 1
        for half in self.halves:
            half.motion.accept()
        return count


def explicit(dt, t_end=0.04):
    """Energy that explicit coupling by springs makes [J]."""
    both = halves()
    for _ in range(round(t_end / dt)):
        gap = both[1].places() - both[0].places()
        forces = SPRING * gap
        forces[9:] = 0.0
        for half in both:
            half.tried(forces, dt)
            half.motion.accept()
    gap = (both[1].places() - both[0].places())[:9]
    got = sum(half.motion.outputs["work_inputs"] for half in both)
    # what both got, and what the springs store by then: all of it came from nowhere
    return got + SPRING / 2 * float(gap @ gap)


def off(coupled, whole):
    """Largest difference of both halves from the whole plate, of places and directors."""
    now, found = whole.nodes("plate"), 0.0
    for half in coupled.halves:
        part = half.motion.nodes("plate")
        apart = np.linalg.norm(now.reference[:, None] - part.reference[None], axis=2)
        rows = np.argmin(apart, axis=0)
        found = max(found, np.abs(part.displacement - now.displacement[rows]).max())
        found = max(found, np.abs(part.director - now.director[rows]).max())
    return found


if __name__ == "__main__":
    coupled, whole = Implicit(), sm.SceneMotion(plate())
    for _ in range(8):
        trials = coupled.step()
        whole.trial(DT)
        whole.accept()
    one, two = (half.motion.outputs for half in coupled.halves)
    error, made = off(coupled, whole), one["work_inputs"] + two["work_inputs"]
    print(f"implicit, {trials} trials a step: {error:.1e} from the whole plate")
    print(f"the outer half gets {two['work_inputs']:.6f} J of {two['total_energy']:.6f} J")
    print(f"energy made by the coupling: {made:.1e} J")
    assert error < 1e-12
    assert abs(made) < 1e-12
    energies = [explicit(dt) for dt in (DT, DT / 2)]
    print(f"explicit: {energies[0]:.3e} J, with half the step {energies[1]:.3e} J")
    assert 1.7 < energies[0] / energies[1] < 2.3
