"""Outputs of linear systems: probes, and forces of joints, as rows over all unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import scipy.sparse as sp
import ufl
from dolfinx import fem
from ufl.algorithms.ad import expand_derivatives

from shellmb.arrays import Floats, Ints
from shellmb.errors import warn
from shellmb.model.joints.joints import JointGroup
from shellmb.model.locations.nodes import local_nodes
from shellmb.model.sections.branches import branches_of
from shellmb.observers.fields.modal import modal_members
from shellmb.observers.fields.resultants import RESULTANTS, Resultants, has_resultants
from shellmb.observers.forces.joints import Span, column_names, joints_of, parts_of
from shellmb.observers.probes import places_of, plain_spot
from shellmb.running.rotating.linearised import Linearised
from shellmb.scene import Probe, Scene

# rows of a number that follows from small motions, shape (unknowns,): 0 by the unknowns, 1 by their
# rates, from 3 on by what each branch sees of the unknowns
type Output = dict[int, Floats]


def outputs(
    state: Linearised, scene: Scene, K: sp.csr_array, joints: bool, times: Sequence[float]
) -> dict[str, Output]:
    """Outputs of a scene: its probes, and forces of joints as histories have them.

    Args:
        state: The state.
        scene: The scene.
        K: Stiffness with the columns of fixed unknowns.
        joints: Whether forces of joints are among them: where joints carry forces at the state,
            these turn along, too.
        times: Times of branches that relax [s].

    Raises:
        SceneError: If there is no node at a probe's point.
    """
    found: dict[str, Output] = {}
    for probe in scene.probes:
        if why := _unfit(state, probe):
            warn(f"linearise: probe '{probe.name}' is left out, as {why}")
        else:
            found[probe.name] = _probe(state, probe, times)
    return found | _joints(state, K) if joints else found


def _unfit(state: Linearised, probe: Probe) -> str:
    """Say why a probe is no linear output; empty where it is one."""
    if probe.component == "norm":
        return "a norm is not linear in small motions; give component 0, 1 or 2"
    if probe.frame is not None:
        return "it is seen from a frame; leave the frame out"
    (given,) = state.model.scene.bodies_of(probe)
    if given.name in modal_members(state.model):
        return f"'{given.name}' is reduced to modes; take model='exact' or 'floating-frame'"
    return ""


def _probe(state: Linearised, probe: Probe, times: Sequence[float]) -> Output:
    who = f"linearise: probe '{probe.name}'"
    (given,) = state.model.scene.bodies_of(probe)
    # of a simulation, these look at the model alone
    simulation: Any = state
    body: Any = state.model.meshed.get(given.name)
    names, weights = places_of(simulation, given.name, probe)
    axis = np.eye(3)[int(probe.component)]
    every = np.zeros((3 + len(times), state.system.size))
    row = every[int(probe.quantity in ("velocity", "angular_velocity"))]
    for place, weight in zip(names, weights, strict=True):
        if body is not None and has_resultants(body, probe.quantity):
            at = local_nodes(body, cast(Any, place), who)
            every += weight * _resultant(state, body, at, probe, times)
            continue
        name, nodes, arms = plain_spot(simulation, given.name, place, who)
        u, w = (_numbers(state, name)[dofs] for dofs in nodes.dofs)
        share = weight / len(u)
        D = nodes.values(_function(state, name).x.array).directors
        for k in range(len(u)):
            match probe.quantity:
                case "displacement" | "position" | "velocity":
                    row[u[k]] += share * axis
                    if arms is not None:
                        np.add.at(row, w[k], share * np.outer(arms[k], axis))
                case "director":
                    row[w[k, 0]] += share * axis
                case "rotation" | "angular_velocity":
                    # `theta = sum d x w / 2`, of which `axis . (d x w) = (axis x d) . w`
                    np.add.at(row, w[k], share * np.cross(axis, D[k]) / 2)
    return dict(enumerate(every))


class _Changes(Resultants):
    """Changes of resultants with a state, and of those of branches by their times."""

    def __init__(self, body: Any, q: fem.Function, change: fem.Function) -> None:
        found = [expand_derivatives(ufl.derivative(body.resultants(q), q, change))]
        own = branches_of(body)
        relaxing = [] if own is None else list(own.stresses(q, change))
        self.times = [time for time, _ in relaxing]
        self._prepare(body, found + [body.of_stress(stress, q) for _, stress in relaxing])

    def only(self, cells: Ints) -> None:
        """Read these elements alone."""
        self._cells = cells.astype(np.int32)

    def every(self) -> list[Floats]:
        """Values of each element that is read at its nodes."""
        return [self.at_nodes(expression) for expression in self._expressions]


def _resultant(
    state: Linearised, body: Any, nodes: Any, probe: Probe, times: Sequence[float]
) -> Floats:
    """Rows of a resultant at a node, by one unknown of the elements there after the other."""
    change = fem.Function(body.mixed.space)
    reading = _Changes(body, _function(state, body.name), change)
    at = body.mixed.subspaces["u"].dofmap.list
    cells = np.flatnonzero(np.isin(at, nodes).any(axis=1))
    reading.only(cells)
    places = np.isin(at[cells], nodes)
    dofs = np.unique(np.concatenate([body.mixed.space.dofmap.cell_dofs(c) for c in cells]))
    numbers, rows = _numbers(state, body.name), np.zeros((3 + len(times), state.system.size))
    component = RESULTANTS[probe.quantity][int(probe.component)]
    orders = [0, *(3 + times.index(time) for time in reading.times)]
    for dof in dofs:
        change.x.array[dof] = 1.0
        for order, values in zip(orders, reading.every(), strict=True):
            rows[order, numbers[dof]] += values[places][:, component].mean()
        change.x.array[dof] = 0.0
    return rows


def _joints(state: Linearised, K: sp.csr_array) -> dict[str, Output]:
    """Forces and moments of joints by their multipliers."""
    mechanism = state.model.mechanism
    number = {name: k for k, name in enumerate(mechanism.joints)}
    rows = np.zeros((len(number), 2, 3, state.system.size))
    for group in mechanism.groups:
        if not isinstance(group, JointGroup):
            continue
        numbers = _numbers(state, group.name)
        mu = group.mixed.dofs["mu"].reshape(-1, group.count)
        # what a multiplier does is what its constraint is a function of
        work = K[numbers[mu.ravel()]][:, numbers].toarray()
        q = np.tile(_function(state, group.name).x.array, (len(work), 1))
        for part in parts_of(group, joints_of(group), number):
            # (multipliers, items, force and moment, components)
            values = part.values(Span(q, q, q), work)[:, :, :2]
            for item, (cell, joint) in enumerate(zip(part.cells, part.numbers, strict=True)):
                own = slice(cell * group.count, (cell + 1) * group.count)
                shares = np.moveaxis(values[own, item], 0, -1)
                rows[joint][..., numbers[mu[cell]]] += shares
    flat = rows.reshape(-1, state.system.size)
    return {name: {0: row} for name, row in zip(column_names(mechanism), flat, strict=True)}


def _numbers(state: Linearised, name: str) -> Ints:
    """Unknowns of a body's local dofs."""
    names = [body.name for body in state.model.bodies]
    return np.asarray(state.system.numbering.by_field[names.index(name)])


def _function(state: Linearised, name: str) -> fem.Function:
    return state.relaxation.functions[name]
