"""The energy balance: energies, work of loads, terms and prescribed motions, dissipation.

It closes as "energy change = work - alpha c^2" (eq. 33) to the tolerance of Newton's method,
whatever the step, the mesh and the scene; how well it closes is the first thing to look at in any
run.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence

from mpi4py import MPI

import numpy as np
from dolfinx import fem
from ufl import Form

from shellmb.arrays import Floats
from shellmb.model.body import Body, kinetic_energy
from shellmb.model.body import strain_energy as stored_energy
from shellmb.model.sections.branches import MaxwellBranches
from shellmb.observers.account.sizes import stiffness_of
from shellmb.observers.deferred_observer import STEPS, DeferredObserver, Row
from shellmb.schemes.base import Levels
from shellmb.schemes.linearised import change, strain_energy
from shellmb.simulate.couplings.faces import FacesCoupling
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.functionals import functionals, functionals_of_steps

# work from outside that has columns of its own
WORKS = ("loads", "terms")

# strains, and motions relative to the scene, below which an energy account cannot close to 1e-8:
# round-off of 1e-16 in strains is an energy of 1e-12 of theirs, and forces that are in balance
# work on round-off of 1e-16 in positions
ROUND_OFF_STRAIN, ROUND_OFF_MOTION = 1e-10, 1e-6

Scalar = Callable[[], float]


def scalar(forms: list[Form | None], comm: MPI.Comm) -> Scalar | None:
    """Sum of scalar forms over all meshes and ranks, read once; None if there are none."""
    some = present(forms)
    if not some:
        return None
    functional = functionals([some], comm)
    return lambda: float(functional()[0])


def present(forms: Sequence[Form | None]) -> list[Form]:
    """Forms that there are, of some."""
    return [form for form in forms if form is not None and not form.empty()]


# sums that a restart needs, and what they are compared with
_SUMS = ("_values", "_error", "_exchanged", "_dissipated", "_initial", "_shift")
_SIZES = ("_largest", "_lowest", "_fastest", "_floor", "_there")


class EnergyAccount(DeferredObserver):
    """Keeps the energy balance of a dynamic run."""

    NAMES = (
        "kinetic_energy",
        "strain_energy",
        "total_energy",
        "work_loads",
        "work_terms",
        "work_supports",
        "dissipation",
        "energy_balance",
    )
    remembered = (*_SUMS, *_SIZES)

    def __init__(self) -> None:
        super().__init__()
        self._values = dict.fromkeys(self.NAMES, 0.0)
        self._error = self._largest = self._exchanged = self._fastest = self._floor = 0.0
        self._dissipated: dict[str, float] = {}
        self._there = self._lowest = 0.0
        self._initial: float | None = None
        # what of the energy is by natural strains
        self._shift = 0.0

    @property
    def values(self) -> dict[str, float]:
        """The balance at the current time, J.

        Kinetic, strain, total energy, and since the start work of loads, of added terms (with
        dampers and the damping of sections), of prescribed motions, and dissipation.
        """
        self.book()
        return self._values

    @property
    def error(self) -> float:
        """Largest violation of the energy law so far, J."""
        self.book()
        return self._error

    @property
    def largest(self) -> float:
        """Largest energy seen so far, J."""
        self.book()
        return self._largest

    @property
    def exchanged(self) -> float:
        """Largest energy, work of one kind, or dissipation so far, J."""
        self.book()
        return self._exchanged

    @property
    def floor(self) -> float:
        """Energy below which there is round-off only, J."""
        self.book()
        return self._floor

    @property
    def fastest(self) -> float:
        """Largest kinetic energy so far, J."""
        self.book()
        return self._fastest

    @property
    def dissipated(self) -> dict[str, float]:
        """Energy that the scheme has dissipated so far in each body of the system, J.

        Beside it, `dissipation` counts what impacts take at which something begins to act, and
        friction and damping of contacts.
        """
        self.book()
        return self._dissipated

    def start(self, simulation: Simulation) -> None:
        """Make the functionals and take the initial energy."""
        problem, comm = simulation.problem, simulation.model.comm
        bodies, scheme = simulation.model.bodies, simulation.scheme
        kinetic: list[Form | None] = []
        if "v" in scheme.rates:
            kinetic = [kinetic_energy(b, problem.levels[b.name].rates["v"]) for b in bodies]
        self._potentials = simulation.model.stores
        # contacts with faces, and branches that relax: what no form knows
        self._faces: list[FacesCoupling | MaxwellBranches] = [*problem.couplings]
        self._faces += problem.branches.values()
        levels = problem.levels
        others = [b for b in bodies if b not in self._potentials]
        strain = [strain_energy(b, levels[b.name]) for b in others]
        stored = [present([stored_energy(b, levels[b.name].q)]) for b in self._potentials]
        elastic, inert = self._dissipation(simulation)
        natural = present([_natural(b, levels[b.name]) for b in others])
        self._natural = bool(natural)
        ends = [present(kinetic), present(strain), *stored, *inert.values()]
        ends += [natural] if natural else []
        self._ends = functionals_of_steps(ends, comm, STEPS)
        loads, terms = (present(work_forms(simulation, kind, others)) for kind in WORKS)
        self._resisting = [b for b in self._potentials if b.resists]
        losses = [present(work_forms(simulation, "terms", [b])) for b in self._resisting]
        steps = [loads, terms, *losses, *elastic.values()]
        if self._potentials or self._faces:
            self._values.setdefault("potential_energy", 0.0)
            losing = [b.item.name for b in self._resisting]
            losing += [faces.name for faces in self._faces]
            self._values |= {f"{name}.loss": 0.0 for name in losing} | self._values
        self._names = tuple(inert)
        # of each step: the work of all kinds and what is lost, work of supports, and energies
        self._works = functionals_of_steps(steps, comm, STEPS)
        self._supports = [0.0] * STEPS
        self._dynamic, self._acting = scheme.dynamic, scheme.dynamic and any(steps)
        for name in self._names:
            self._dissipated.setdefault(name, 0.0)
        self._scales = _reaction_scales(simulation)
        stiff = [stiffness_of(body) for body in simulation.model.meshed.values()]
        at_rest = ROUND_OFF_STRAIN**2 * sum(s.unit_energy for s in stiff)
        self._floor = max(self._floor, at_rest)
        self._driven = any(fixed.moving for b in bodies for fixed in b.fixed)
        # of contacts with faces of shells, which no form knows: what is lost in the scheme, and by
        # friction and damping, and energies
        self._losses = np.zeros((STEPS, len(self._faces), 2))
        # reactions, of which the largest tell what round-off works, or where ranks share them that
        self._comm, held = comm, len(problem.system.reactions)
        self._alone = comm.size == 1
        self._reactions, self._reach = np.zeros((STEPS, held)), np.zeros(STEPS)
        self._touch = np.zeros((STEPS, len(self._faces)))
        if natural:
            self._shift = self._there_now()[-1]
        if self._initial is None:
            self._energies(self._there_now(), self._touching())
            self._initial = self._values["total_energy"]
            self._sizes([self._values])
        self.begin(dict(self._values))

    def _dissipation(self, simulation: Simulation) -> tuple[dict[str, list[Form]], ...]:
        """Dissipation over alpha by body, eqs. (34), (Q5): by states, and by velocities."""
        elastic: dict[str, list[Form]] = {}
        inert: dict[str, list[Form]] = {}
        self._alpha, stage = simulation.scheme.dissipation()
        self._jumps: list[_VelocityJump] = []
        for body in simulation.model.bodies if self._alpha else ():
            losses, moving = present(simulation.problem.steps[body.name].dissipated()), []
            if stage is not None:
                jump = _VelocityJump(simulation.problem.levels[body.name])
                moving = present([kinetic_energy(body, jump.function)])
                self._jumps += [jump] if moving else []
            if losses or moving:
                elastic[body.name], inert[body.name] = losses, moving
        return elastic, inert

    def _touching(self) -> list[float]:
        """Energies of contacts with faces of shells, J."""
        return [faces.energy() for faces in self._faces]

    def _energies(self, found: list[float], touching: list[float]) -> None:
        values = self._values
        kinetic, strain, *rest = found
        if self._natural:
            shift = rest.pop()
            strain, self._shift = strain + shift, shift
        count = len(self._potentials)
        stored, self._inert = rest[:count], rest[count:]
        values["kinetic_energy"], values["strain_energy"] = kinetic, strain
        values["total_energy"] = kinetic + strain + sum(stored)
        for body, energy in zip(self._potentials, stored, strict=True):
            values[f"{body.item.name}.energy"] = energy
        for faces, energy in zip(self._faces, touching, strict=True):
            values[f"{faces.name}.energy"] = energy
            values["total_energy"] += energy
            stored.append(energy)
        if stored:
            values["potential_energy"] = sum(stored)

    def switched(self, simulation: Simulation) -> None:
        """The impact at which something begins to act dissipates kinetic energy."""
        super().switched(simulation)
        before = self._values["kinetic_energy"]
        self._energies(self._there_now(), self._touching())
        self._values["dissipation"] += before - self._values["kinetic_energy"]
        self.begin(dict(self._values))

    def _there_now(self) -> list[float]:
        """Energies of the state, all steps being booked; collective."""
        self._ends.take(0)
        (found,) = self._ends.of(slice(0, 1)).tolist()
        return list(found)

    def _reach_of(self, reactions: Floats) -> Floats:
        """Largest work of reactions, shape (..., n), on large motions for their unknowns, J."""
        return np.asarray(np.maximum.reduce(np.abs(reactions) * self._scales, -1, initial=0.0))

    def _dissipate(self, parts: list[float]) -> None:
        for name, part in zip(self._names, parts, strict=True):
            self._dissipated[name] += self._alpha * part
            self._values["dissipation"] += self._alpha * part

    def take_solved(self, simulation: Simulation, row: int) -> None:
        """Take the work and the dissipation of the step."""
        if not self._dynamic:
            return
        if self._acting:
            self._works.take(row)
        if self._faces:
            self._losses[row] = [faces.loss() for faces in self._faces]
        if self._driven:
            self._supports[row] = simulation.problem.support_work()
        reactions = simulation.problem.system.reactions
        if self._alone:
            self._reactions[row] = reactions
        else:
            # booking is not collective
            self._reach[row] = self._comm.allreduce(float(self._reach_of(reactions)), op=MPI.MAX)
        for jump in self._jumps:
            jump.begin()

    def take_accepted(self, simulation: Simulation, row: int) -> None:
        """Take the energies."""
        if simulation.last is not None:
            for jump in self._jumps:
                jump.end(simulation.last.dt)
        self._ends.take(row)
        if self._faces:
            self._touch[row] = self._touching()

    def book_rows(self, rows: slice) -> list[Row]:
        """Add steps up, and see whether the balance closes."""
        found = []
        if self._dynamic:
            alone = self._alone
            reach = self._reach_of(self._reactions[rows]) if alone else self._reach[rows]
            self.raise_floor(ROUND_OFF_MOTION * float(reach.max()))
        works, energies = self._works.of(rows).tolist(), self._ends.of(rows).tolist()
        faces = zip(self._losses[rows].tolist(), self._touch[rows].tolist(), strict=True)
        for work, supports, energy, (losses, touching) in zip(
            works, self._supports[rows], energies, faces, strict=True
        ):
            if self._dynamic:
                self._work_of(work, supports, losses)
            shift = self._shift
            self._energies(energy, touching)
            self._dissipate(self._inert)
            if self._dynamic:
                self._close(self._shift - shift)
            found.append(dict(self._values))
        if self._dynamic:
            self._error = max(self._error, *(abs(row["energy_balance"]) for row in found))
            self._sizes(found)
        return found

    def _work_of(self, works: list[float], supports: float, losses: list[list[float]]) -> None:
        values = self._values
        if self._acting:
            loads, terms, *rest = works
            values["work_loads"] += loads
            values["work_terms"] += terms
            for body, work in zip(self._resisting, rest, strict=False):
                # friction, and damping in contact
                values[f"{body.item.name}.loss"] -= work
                values["dissipation"] -= work
            self._dissipate(rest[len(self._resisting) :])
        for faces, (part, spent) in zip(self._faces, losses, strict=True):
            if self._alpha:
                self._dissipated[faces.name] = self._dissipated.get(faces.name, 0.0) + part
            values[f"{faces.name}.loss"] += spent
            values["dissipation"] += part + spent
        if self._driven:
            values["work_supports"] += supports

    def _close(self, natural: float) -> None:
        values = self._values
        # the stress of natural strains works, and what it stores is no work from outside
        values["work_loads"] += natural
        assert self._initial is not None
        values["energy_balance"] = (
            values["total_energy"]
            - self._initial
            - values["work_loads"]
            - values["work_terms"]
            - values["work_supports"]
            + values["dissipation"]
        )

    def _sizes(self, rows: Sequence[Row]) -> None:
        """Largest and smallest values so far, by those of some steps."""
        ports = ("work_loads", "work_terms", "work_supports", "dissipation")
        names = ("total_energy", "kinetic_energy", *ports)
        total, kinetic, *others = ([row[name] for row in rows] for name in names)
        self._largest = max(self._largest, *map(abs, total))
        self._fastest = max(self._fastest, *kinetic)
        # what potentials below zero give to bodies is energy that was seen, though the sum is not
        seen = max(self._largest, self._fastest)
        self._exchanged = max(self._exchanged, seen, *(abs(x) for each in others for x in each))
        self._there = max(self._there, *map(operator.add, total, others[-1]))
        self._lowest = min(self._lowest, *total)

    def raise_floor(self, energy: float) -> None:
        """Energies below this one are round-off, J."""
        self._floor = max(self._floor, energy)

    @property
    def relative_error(self) -> float:
        """Largest violation of the energy law relative to the energy that was exchanged."""
        return self.error / max(self.exchanged, self.floor) if self.error > 0 else 0.0

    @property
    def dissipated_share(self) -> float:
        """Dissipation of the scheme over the energy at the start and all that was put in.

        Potentials of springs may fall below zero: what they give is energy that was there.
        """
        losses = sum(self.dissipated.values())
        return losses / max(self._there - self._lowest, self.floor) if losses > 0 else 0.0


def work_forms(simulation: Simulation, kind: str, bodies: Sequence[Body]) -> list[Form | None]:
    """Virtual work of each stage in the direction in which the state moves over it.

    In statics the load step is not followed inside, so its work is not known.
    """
    forms: list[Form | None] = []
    if not simulation.scheme.dynamic:
        return forms
    for body in bodies:
        levels = simulation.problem.levels[body.name]
        moved = simulation.scheme.moved(levels.q, levels.scaled, levels.unknown)
        for name, stage in simulation.problem.forms[body.name].items():
            for sample in stage.samples:
                form = (
                    sample.of_loads(moved[name])
                    if kind == "loads"
                    else sample.of_terms(body, moved[name])
                )
                forms.append(form)
            if kind == "terms":
                forms.append(stage.damping)
    return forms


def _natural(body: Body, levels: Levels) -> Form | None:
    """Energy that the natural strain of a body adds; None without one."""
    own = getattr(body, "natural", None)
    if own is None:
        return None
    if levels.reference is None:
        return own.energy(levels.q)
    form: Form = own.energy(levels.reference.q)
    linear = change(form, levels)
    return form if linear is None else form + linear


def _reaction_scales(simulation: Simulation) -> Floats:
    """Large motions of each fixed unknown, so that reactions times them are energies.

    In the order of the system's reactions; what is fixed in other stages counts nothing.
    """
    problem, numbering = simulation.problem, simulation.problem.system.numbering
    scales = np.zeros(numbering.owned)
    for body in simulation.model.bodies:
        numbers = numbering.by_field[problem.number(body.name, problem.last)] - numbering.start
        for part in body.parts:
            if part.name in body.kinematic:
                here = numbers[body.mixed.dofs[part.name].ravel()]
                here = here[(here >= 0) & (here < numbering.owned)]
                scales[here] = np.maximum(scales[here], part.scale)
    return scales[problem.system.fixed]


class _VelocityJump:
    """Jump of a body's velocity at the start of a step, from the velocities at both ends.

    Eq. (31) with `a = v_f - v_i`: `b = 2 (q_f - q_i)/dt - v_i - v_f`.

    Args:
        levels: The body's functions.

    Attributes:
        function: The jump; zero before the first step.
    """

    def __init__(self, levels: Levels) -> None:
        self.function = fem.Function(levels.q.function_space)
        self._jump = self.function.x.array
        self._q, self._v = levels.q.x.array, levels.rates["v"].x.array
        self._start, self._both = self._q.copy(), self._v.copy()

    def begin(self) -> None:
        """Remember the start of a step."""
        np.copyto(self._start, self._q)
        np.copyto(self._both, self._v)

    def end(self, dt: float) -> None:
        """Take the jump of a step.

        Args:
            dt: Its length, s.
        """
        jump, both = self._jump, self._both
        np.subtract(self._q, self._start, out=jump)
        jump *= 2 / dt
        both += self._v
        jump -= both
