"""Forces that are not known, as they alternate, are round-off or have no limit."""

import re

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Cautions, Watch, said_of
from shellmb.simulate.simulation import Simulation

# what alternates, as a part of what does not
SHARE = 0.1
# part of the steps whose change is against that of the step before: two thirds, in noise
TURNS = 0.8
# steps from which on that can be told
STEPS = 50
# part of the largest force, or torque over the size of the scene: below is round-off
NOTHING = 1e-9
# part of a force: a component below it, as friction that is a thousandth of the pressure, is none
SLIGHT = 1e-3

# relative change of an unknown by round-off alone that is said: six digits are enough
KNOWN = 1e-6


class Alternating(Watch):
    """Looks at the end of a run at forces of joints, contacts, drivers and force elements.

    They are means over a step; velocities of EP violate constraints a little, by what changes its
    sign from step to step, and with them the means of joints and drivers. With `end_forces` there
    are means without that, and values at the ends of steps. These alternate where anything vibrates
    faster than the steps resolve and is not damped.
    """

    name = "alternation"

    def cautions(self, simulation: Simulation) -> Cautions:
        """Warnings about the means and end values that alternate most."""
        scheme, rows, length = simulation.scheme, self.sources.history.rows, simulation.model.length
        if not scheme.dynamic or len(rows) <= STEPS:
            return
        # one that dissipates already has nothing more to damp it with
        damped = scheme.dissipation()[0] > 0
        ways = "a smaller step" if damped else "--scheme ed3 or a smaller step"
        if not simulation.scene.output.end_forces:
            says = (
                "alternates from step to step, by {share:.2g} times its mean over two: velocities "
                "violate constraints a little, or something vibrates faster than the steps "
                f"resolve; use {ways}, or --end-forces for means without alternation"
            )
            yield from self._judged("", says, length)
            return
        why = "times its mean over two: something vibrates faster than steps resolve; use"
        says = f"alternates from step to step, by {{share:.2g}} {why} {ways}"
        yield from self._judged("_mean", says, length)
        says = (
            f"at the ends of steps alternates, by {{share:.2g}} {why} means over steps, or {ways}"
        )
        yield from self._judged("_end", says, length)
        says = (
            "at the ends of steps is not what it is over steps, by {share:.2g} times that: "
            f"something vibrates faster than steps resolve; use means over steps, or {ways}"
        )
        yield from self._judged("_end", says, length, "_mean")

    def _judged(self, ending: str, says: str, length: float, beside: str | None = None) -> Cautions:
        """A sentence about the columns that alternate, or are apart.

        Args:
            ending: That of the columns.
            says: What is wrong, and what to do.
            length: Size of the scene, m.
            beside: Ending of the columns of means that values at the ends of steps are compared
                with; None: they are looked at by themselves.
        """
        rows, found = self.sources.history.rows, []
        others = () if beside is None else _units(rows, beside)
        means = {_bare(names[0]): names for unit in others for names in unit}
        units = [[(n, _series(rows, n)) for n in unit] for unit in _units(rows, ending)]
        force, torque = (max((_size(f) for _, f in unit), default=0.0) for unit in units)
        largest = max(force, torque / length)
        for unit, least in zip(units, (NOTHING * largest, NOTHING * largest * length), strict=True):
            for names, f in unit:
                if _size(f) <= least:
                    continue
                whole = _bare(names[0])
                owner = re.sub(r"\.F[1x]$", "", whole)
                if beside is not None:
                    mean = means.get(whole)
                    found.append((0.0 if mean is None else _apart(f, _series(rows, mean)), owner))
                elif f"{owner}.friction" in rows[0]:
                    # whichever way the contact faces
                    found.append((_share(_by_changes(f))[0], owner))
                else:
                    share, worst = _share(f)
                    found.append((share, _bare([*names, owner][worst])))
        alternate = [(share, what) for share, what in found if share > SHARE]
        if not alternate:
            return
        share, what = max(alternate)
        more = f", and {len(alternate) - 1} more" if len(alternate) > 1 else ""
        said = f"the force of '{what}'{more} {says.format(share=share)}"
        yield self.caution(None, share, SHARE, said)


def _units(rows: list[dict[str, float]], ending: str) -> list[list[list[str]]]:
    """Columns of forces and of torques, with an ending; those of joints and supports as vectors."""
    known = rows[0]
    names = [n.removesuffix(ending) for n in known if n.endswith(ending)]
    if ending == "_mean":
        # of force elements, supports and contacts there is one mean only
        names += [n for n in known if f"{n}_mean" not in known]

    def column(name: str) -> str:
        return f"{name}{ending}" if f"{name}{ending}" in known else name

    axes = {".F1": "123", ".Fx": "xyz"}
    vectors = ((column(n[:-1] + k) for k in axes[n[-3:]]) for n in names if n[-3:] in axes)
    # of a controller that reads one of them there is no other
    forces = [[c for c in vector if c in known] for vector in vectors]
    forces += [[column(n)] for n in names if n.endswith("force")]
    return [forces, [[column(n)] for n in names if n.endswith("torque")]]


def _series(rows: list[dict[str, float]], names: list[str]) -> Floats:
    """Columns over the steps, shape (n, number of names); from where on all are known."""
    values = np.array([[row[name] for name in names] for row in rows])
    return values[np.all(np.isfinite(values), axis=1)]


def _bare(column: str) -> str:
    return re.sub(r"(_mean|_end)$", "", column)


def _apart(ends: Floats, means: Floats) -> float:
    """Usual difference between the mean of values at the ends of a step and that over it."""
    n = min(len(ends), len(means)) - 1
    if n < STEPS:
        return 0.0
    difference = (ends[-n:] + ends[-n - 1 : -1]) / 2 - means[-n:]
    return float(np.median(np.linalg.norm(difference, axis=1))) / max(_size(means), 1e-300)


def _sizes(f: Floats) -> Floats:
    """Sizes of the components: roots of the mean squares over the steps."""
    return np.asarray(np.sqrt(np.mean(f**2, axis=0))) if len(f) else np.zeros(f.shape[1])


def _size(f: Floats) -> float:
    return float(np.linalg.norm(_sizes(f)))


def _share(f: Floats) -> tuple[float, int]:
    """Largest ratio of what alternates to what does not, and in which component; 0 without one.

    Components are compared with themselves: friction beside the pressure of a contact is small.
    Those count of which most steps reverse those before, and which are more than `SLIGHT`; behind
    them comes the force as a whole.
    """
    if len(f) <= STEPS:
        return 0.0, 0
    change = np.diff(f, axis=0)
    products = change[1:] * change[:-1]
    turns = np.mean(np.column_stack([products, products.sum(axis=1)]) < 0, axis=0)
    parts = f, f[2:] - 2 * f[1:-1] + f[:-2], f[2:] + 2 * f[1:-1] + f[:-2]
    sizes, swings, means = (np.append(s, np.linalg.norm(s)) for s in map(_sizes, parts))
    counts = (turns >= TURNS) & (sizes > SLIGHT * sizes[-1])
    shares = np.where(counts, swings / np.maximum(means, 1e-300), 0.0)
    return float(shares.max()), int(shares.argmax())


def _by_changes(f: Floats) -> Floats:
    """A force by its components along the axes in which it changes: friction, and pressure."""
    return np.asarray(f @ np.linalg.svd(f[2:] - 2 * f[1:-1] + f[:-2], full_matrices=False)[2].T)


class Undetermined(Watch):
    """Watches what round-off alone changes in solutions."""

    name = "round-off"
    remembered = ("_largest",)

    def accepted(self, simulation: Simulation) -> None:
        """Take what changed most in the last update, if that was round-off."""
        what, change = simulation.problem.iteration.roundoff.found
        self._note(self.name, change, simulation.t, what)

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence if it is much."""
        worst, when, *what = self._noted(self.name)
        if worst > KNOWN:
            says = (
                f"the {what[0]} is known to {worst:.1e} of its largest value only, at "
                f"t = {when:g}: constraints nearly depend on one another there, and "
                "round-off decides how they share forces; use joints with fewer constraints, or do "
                "not rely on their forces near such positions"
            )
            yield self.caution(None, worst, KNOWN, says)


class Pointed(Watch):
    """Watches where reserve factors are least."""

    name = "singular stress"

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each that is least at a point load."""
        for name, load in self.sources.reserves.at_loads().items():
            body = self.sources.reserves.critical(name).body
            says = (
                f"reserve '{name}' is least where a {load} acts on {said_of(simulation, body)}: it "
                "falls towards zero with each refinement there; leave the place out by where, or "
                "spread the load"
            )
            yield self.caution(body, None, None, says)
