"""Shapes of modes: displacements at nodes, of bodies with nodes, rigid ones and reduced ones."""

from collections.abc import Callable

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.model import Model
from shellmb.observers.fields.modal import ModalNodes, modal_members
from shellmb.system.assembly.blocks import BlockSystem

Shape = dict[str, Floats]


def parts_of(system: BlockSystem, vector: PETSc.Vec) -> Callable[[str], Floats]:
    """Local array of a vector by names of bodies; collective."""
    place = {f.name: system.numbering.slice(k) for k, f in enumerate(system.fields)}
    values = system.local_values(vector)
    return lambda name: values[place[name]]


def mode_shape(system: BlockSystem, model: Model, vector: PETSc.Vec) -> Shape:
    """The mode, its largest displacement one unit of length."""
    (shape,) = scaled(model, nodal_shape(system, model, vector))
    return shape


def nodal_shape(system: BlockSystem, model: Model, vector: PETSc.Vec) -> Shape:
    """Values of a mode at the nodes of this rank, as of `Modes`, of whatever size."""
    part_of = parts_of(system, vector)
    shapes, meshed = {}, {**model.meshed, **model.own}
    for field in system.fields:
        part = part_of(field.name)
        if field.name in meshed:
            shapes[field.name] = part[meshed[field.name].mixed.dofs["u"]].reshape(-1, 3)
        elif model.rigid is not None and field.name == model.rigid.name:
            dofs = model.rigid.mixed.dofs
            rows = [part[dofs["u"]].reshape(-1, 3), part[dofs["w"]].reshape(-1, 9)]
            shapes[field.name] = np.concatenate(rows, axis=1)
    for name in modal_members(model):
        state = ModalNodes(model, name)
        frame, eta = (part_of(n) for n in (state.state.rigid, state.state.modes.name))
        shapes[name] = state.shape(*state.state.read(frame, eta))
    return shapes


def scaled(model: Model, *shapes: Shape) -> tuple[Shape, ...]:
    """Shapes that belong together, the largest displacement in them one unit of length."""
    # of rigid bodies that turn about their centres, the directors times the length of the scene
    sizes = (_size(part, model.length) for shape in shapes for part in shape.values())
    largest = model.comm.allreduce(max(sizes, default=0.0), op=MPI.MAX)
    return tuple({name: part / largest for name, part in shape.items()} for shape in shapes)


def _size(shape: Floats, length: float) -> float:
    turned = float(np.max(np.abs(shape[:, 3:]), initial=0.0))
    return max(float(np.max(np.abs(shape[:, :3]), initial=0.0)), length * turned)
