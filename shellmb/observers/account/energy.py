"""The energy balance: energies, work of loads, terms and prescribed motions, dissipation.

It closes as "energy change = work - alpha c^2" (eq. 33) to the tolerance of Newton's method,
whatever the step, the mesh and the scene; how well it closes is the first thing to look at in any
run.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx import fem
from ufl import Form

from shellmb.arrays import Floats
from shellmb.model.body import Body, kinetic_energy
from shellmb.model.body import strain_energy as stored_energy
from shellmb.model.sections.branches import MaxwellBranches
from shellmb.observers.deferred import Booked, DeferredObserver, Row, SharedTable, StepValues
from shellmb.schemes.base import Levels
from shellmb.schemes.linearised import change, strain_energy
from shellmb.simulate.couplings.faces import FacesCoupling
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.functionals import functionals

# work from outside that has columns of its own; work and what is lost; and all columns
WORKS = ("loads", "terms")
PORTS = ("work_loads", "work_terms", "work_supports", "dissipation")
COLUMNS = ("kinetic_energy", "strain_energy", "total_energy", *PORTS, "energy_balance")

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
    """Keeps the energy balance of a dynamic run.

    Attributes:
        values: The balance at the current time, J: kinetic, strain, total energy, and since the
            start work of loads, of added terms (with dampers and the damping of sections), of
            prescribed motions, and dissipation.
        error: Largest violation of the energy law so far, J.
        largest: Largest energy seen so far, J.
        exchanged: Largest energy, work of one kind, or dissipation so far, J.
        floor: Energy below which there is round-off only, J.
        fastest: Largest kinetic energy so far, J.
        dissipated: Energy that the scheme has dissipated so far in each body of the system, J.
            Beside it, `dissipation` counts what impacts take at which something begins to act, and
            friction and damping of contacts.
    """

    remembered = (*_SUMS, *_SIZES)
    values, dissipated = Booked[Row](), Booked[Row]()
    error, largest, exchanged = Booked[float](), Booked[float](), Booked[float]()
    floor, fastest = Booked[float](), Booked[float]()

    def __init__(self) -> None:
        super().__init__()
        self._values = dict.fromkeys(COLUMNS, 0.0)
        self._error = self._largest = self._exchanged = self._fastest = self._floor = 0.0
        self._dissipated: Row = {}
        self._there = self._lowest = 0.0
        self._initial: float | None = None
        # what of the energy is by natural strains
        self._shift = 0.0

    def start(self, simulation: Simulation) -> None:
        """Make the functionals and take the initial energy."""
        problem, comm = simulation.problem, simulation.model.comm
        bodies, scheme = simulation.model.bodies, simulation.scheme
        levels, moving = problem.levels, bodies if "v" in scheme.rates else ()
        kinetic = [kinetic_energy(b, levels[b.name].rates["v"]) for b in moving]
        self._potentials = simulation.model.stores
        # contacts with faces, and branches that relax: what no form knows
        self._faces: list[FacesCoupling | MaxwellBranches] = [*problem.couplings]
        self._faces += problem.branches.values()
        others = [b for b in bodies if b not in self._potentials]
        strain = [strain_energy(b, levels[b.name]) for b in others]
        stored = [present([stored_energy(b, levels[b.name].q)]) for b in self._potentials]
        elastic, inert = self._dissipation(simulation)
        natural = present([_natural(b, levels[b.name]) for b in others])
        self._natural = bool(natural)
        ends = [present(kinetic), present(strain), *stored, *inert.values()]
        ends += [natural] if natural else []
        self._ends = StepValues(functionals(ends, comm))
        loads, terms = (present(work_forms(simulation, kind, others)) for kind in WORKS)
        self._resisting = [b for b in self._potentials if b.resists]
        losses = [present(work_forms(simulation, "terms", [b])) for b in self._resisting]
        steps = [loads, terms, *losses, *elastic.values()]
        touching = [faces.name for faces in self._faces]
        losing = [b.item.name for b in self._resisting] + touching
        self._stores = [b.item.name for b in self._potentials] + touching
        self._loss_columns = [f"{name}.loss" for name in losing]
        if self._stores:
            names = ("potential_energy", *self._loss_columns)
            self._values = self._values | dict.fromkeys(names, 0.0) | self._values
        self._dissipated = dict.fromkeys(inert, 0.0) | self._dissipated
        self._names = tuple(inert)
        # of each step: the work of all kinds and what is lost, work of supports, and energies
        self._works, self._dynamic = StepValues(functionals(steps, comm)), scheme.dynamic
        driven = any(fixed.moving for b in bodies for fixed in b.fixed)
        self._supports = StepValues(problem.support_work if driven else float)
        self._scales = _reaction_scales(simulation)
        sized = [(b.stretching[0], b.domain) for b in simulation.model.meshed.values()]
        # to an order of magnitude
        at_rest = sum(k * on.length**on.mesh.topology.dim for k, on in sized)
        self._floor = max(self._floor, ROUND_OFF_STRAIN**2 * at_rest)
        # of contacts with faces of shells, which no form knows: what is lost in the scheme, and by
        # friction and damping, and energies
        faces, none = self._faces, np.zeros((0, 2))
        self._losses = StepValues(lambda: [f.loss() for f in faces] or none)
        self._touch = StepValues(lambda: [f.energy() for f in faces] or none[:, 0])
        # reactions, of which the largest tell what round-off works
        system = problem.system
        self._reactions = StepValues(lambda: system.reactions)
        self._reach = SharedTable(comm, (), MPI.MAX)
        now = self._now_there()
        if self._initial is None:
            self._values |= now
            self._initial = self._values["total_energy"]
            self._sizes(self._values)
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

    def _energies(self, ends: Floats, touching: Floats) -> dict[str, Floats]:
        """Columns of the energies of some steps, shape (n,)."""
        kinetic, strain, *rest = ends.T
        if self._natural:
            strain = strain + rest[-1]
        stored = [*rest[: len(self._potentials)], *touching.T]
        found = {"kinetic_energy": kinetic, "strain_energy": strain}
        found["total_energy"] = kinetic + strain + sum(stored)
        found |= {f"{name}.energy": each for name, each in zip(self._stores, stored, strict=True)}
        return found | ({"potential_energy": sum(stored, np.zeros_like(kinetic))} if stored else {})

    def switched(self, simulation: Simulation) -> None:
        """The impact at which something begins to act dissipates kinetic energy."""
        super().switched(simulation)
        before = self._values["kinetic_energy"]
        self._values |= self._now_there()
        self._values["dissipation"] += before - self._values["kinetic_energy"]
        self.begin(dict(self._values))

    def _now_there(self) -> Row:
        """Energies of the state, all steps being booked; collective."""
        self._take_ends(0)
        ends = self._ends.of(slice(0, 1))
        self._shift = float(ends[0, -1]) if self._natural else 0.0
        columns = self._energies(ends, self._touch.of(slice(0, 1)))
        return {name: float(x[0]) for name, x in columns.items()}

    def _take_ends(self, row: int) -> None:
        self._ends.take(row)
        self._touch.take(row)

    def _find_reach(self, rows: slice, reach: Floats) -> None:
        """Largest work of reactions on large motions for their unknowns, J."""
        works = np.abs(self._reactions.of(rows)) * self._scales
        np.maximum.reduce(works, -1, initial=0.0, out=reach)

    def take_solved(self, simulation: Simulation, row: int) -> None:
        """Take the work and the dissipation of the step."""
        if not self._dynamic:
            return
        for each in (self._works, self._losses, self._supports, self._reactions):
            each.take(row)
        self._reach.take(row, self._find_reach)
        for jump in self._jumps:
            jump.begin()

    def take_accepted(self, simulation: Simulation, row: int) -> None:
        """Take the energies."""
        if simulation.last is not None:
            for jump in self._jumps:
                jump.end(simulation.last.dt)
        self._take_ends(row)

    def book_rows(self, rows: slice) -> list[Row]:
        """Add steps up, and see whether the balance closes."""
        ends = self._ends.of(rows)
        columns = self._energies(ends, self._touch.of(rows))
        if self._dynamic:
            self.raise_floor(ROUND_OFF_MOTION * float(self._reach.of(rows, self._find_reach).max()))
            columns |= self._balance(rows, ends.T, columns["total_energy"])
            self._error = max(self._error, float(np.abs(columns["energy_balance"]).max()))
            self._sizes(columns)
        every = zip(*(column.tolist() for column in columns.values()), strict=True)
        found = [self._values | dict(zip(columns, row, strict=True)) for row in every]
        self._values = dict(found[-1])
        return found

    def _balance(self, rows: slice, ends: Floats, total: Floats) -> dict[str, Floats]:
        """Columns of work and dissipation since the start, and what is left of the balance."""
        loads, terms, *rest = self._works.of(rows).T
        faces = np.moveaxis(self._losses.of(rows), 0, -1)
        # friction, and damping in contact
        spent = [-work for work in rest[: len(self._resisting)]]
        elastic, inert = rest[len(self._resisting) :], ends[2 + len(self._potentials) :]
        scheme = {
            name: [self._alpha * part for part in parts]
            for name, *parts in zip(self._names, elastic, inert, strict=False)
        }
        by_faces = {f.name: [part] for f, (part, _) in zip(self._faces, faces, strict=True)}
        for name, parts in (scheme | (by_faces if self._alpha else {})).items():
            self._dissipated[name] = float(_added(self._dissipated.get(name, 0.0), *parts)[-1])
        works = {"work_loads": [loads], "work_terms": [terms]}
        works["work_supports"] = [self._supports.of(rows)]
        if self._natural:
            # the stress of natural strains works, and what it stores is no work from outside
            works["work_loads"].append(np.diff(ends[-1], prepend=self._shift))
            self._shift = float(ends[-1, -1])
        losses = [*spent, *(part for _, part in faces)]
        works |= {name: [loss] for name, loss in zip(self._loss_columns, losses, strict=True)}
        by_states, by_velocities = ([parts[k] for parts in scheme.values()] for k in (0, 1))
        dissipated = [*spent, *by_states, *faces.sum(axis=1), *by_velocities]
        works["dissipation"] = [np.zeros_like(total), *dissipated]
        found = {name: _added(self._values[name], *parts) for name, parts in works.items()}
        outside = (found[name] for name in PORTS[:3])
        assert self._initial is not None
        left = sum((-work for work in outside), total - self._initial) + found["dissipation"]
        return found | {"energy_balance": left}

    def _sizes(self, columns: Mapping[str, Any]) -> None:
        """Largest and smallest values so far, by columns of some steps."""
        total, kinetic = columns["total_energy"], columns["kinetic_energy"]
        self._largest = max(self._largest, float(np.max(np.abs(total))))
        self._fastest = max(self._fastest, float(np.max(kinetic)))
        # what potentials below zero give to bodies is energy that was seen, though the sum is not
        exchanged = [float(np.max(np.abs(columns[name]))) for name in PORTS]
        self._exchanged = max(self._exchanged, self._largest, self._fastest, *exchanged)
        self._there = max(self._there, float(np.max(total + columns["dissipation"])))
        self._lowest = min(self._lowest, float(np.min(total)))

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


def _added(start: float, *parts: Floats) -> Floats:
    """A sum that goes on by the parts of steps, one by one, after each of the steps."""
    flat = np.append(start, np.stack(parts, axis=1))
    return np.asarray(np.add.accumulate(flat)[len(parts) :: len(parts)])


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
            if kind == "loads":
                forms += [sample.of_loads(moved[name]) for sample in stage.samples]
            else:
                terms = (sample.of_terms(body, moved[name]) for sample in stage.samples)
                forms += [*terms, stage.damping]
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
        last = problem.number(body.name, problem.last)
        for part in body.parts:
            if part.name in body.kinematic:
                here = numbering.own(last, body.mixed.dofs[part.name].ravel())
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
        both = self._both + self._v
        self.function.x.array[:] = (self._q - self._start) * (2 / dt) - both
