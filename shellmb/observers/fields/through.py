"""Stresses and strains of plies through the thickness, from resultants and their derivatives.

Stresses in the surface follow from lamination theory. Those across it follow from equilibrium: the
derivatives of the resultants along the surface give those of the stresses of each ply, whose
integral from the lower face is `tau_13, tau_23`. What is left of the shear forces Q (errors of the
derivatives, loads in the surface, curvature, inertia) has the shape of cylindrical bending, so
that the integral of the stresses is Q, and both faces are free of them (Rolfes & Rohwer, Int. J.
Numer. Meth. Engng 40 (1997) 51-60, take this shape for all of Q).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import ufl

from shellmb.arrays import Floats
from shellmb.meshes.shared import sums_at_nodes
from shellmb.model.shells.shell import ShellModel
from shellmb.native.expressions import values_in_cells
from shellmb.observers.fields.by_section import held_plies, held_strain, shell_compliance, stress_at
from shellmb.observers.fields.resultants import Resultants
from shellmb.scene import Shell
from shellmb.scene.shells.lamination import Layup, shear_step, strain_turn, vector_turn

SIDES = ("bottom", "middle", "top")


class PlyRows(NamedTuple):
    """Matrices that give what a ply has at its bottom, middle and top; zero where it is dropped.

    Args:
        angle: From the shell's 1-direction to the fibres, shape (...) [degrees].
        heights: Above the reference surface, shape (..., 3) [m].
        stress: Stresses 11, 22, 12 in the ply's axes from N and M, shape (..., 3, 3, m): m is 6,
            and more where branches act (`Layup.among`) or plies have natural strains (`stress_at`).
        strain: Strains 11, 22, 2*12 likewise, those that stresses follow from.
        shear: Stresses 13, 23 in the ply's axes from Q and the derivatives of these N and M along 1
            and along 2, shape (..., 3, 2, 2 + 2 m).
        slip: Shear strains from the stresses 13, 23, shape (..., 2, 2); NaN in a ply whose branches
            act, where they follow from the stresses of all times before.
        held: Whether the last column is that of natural strains.
    """

    angle: Any
    heights: Floats
    stress: Floats
    strain: Floats
    shear: Floats
    slip: Floats
    held: bool


def ply_rows(shell: Shell, at: Layup) -> tuple[PlyRows, ...]:
    """Rows of each ply from the lower to the upper face; of one where there are no plies.

    Args:
        shell: The shell, with a linear section.
        at: Its section at points (...).
    """
    free, held = shell_compliance(shell, at, held=False), shell_compliance(shell, at)
    found = []
    shears = _shears(free[..., :6, :6], at, held_plies(shell))
    for k, (layer, shear) in enumerate(zip(at.layers, shears, strict=True)):
        low, high = (np.asarray(z, dtype=float) for z in at.heights[k : k + 2])
        heights = np.stack([low, (low + high) / 2, high], axis=-1)
        there = np.asarray(layer.thickness)[..., None, None, None] > 0
        into = strain_turn(layer.angle)[..., None, :, :]
        stress_into = strain_turn(-layer.angle).mT[..., None, :, :]
        across = vector_turn(layer.angle)
        turned = across @ layer.transverse @ across.mT
        stress = np.stack(
            [stress_at(shell, at, k, z) for z in np.moveaxis(heights, -1, 0)], axis=-3
        )
        found.append(
            PlyRows(
                layer.angle,
                heights,
                there * (stress_into @ stress),
                there * (into @ _strain(shell, at, k, held, heights, stress.shape[-1])),
                there * (across[..., None, :, :] @ shear),
                np.linalg.inv(turned) * (1.0 if layer.relaxation is None else np.nan),
                held_plies(shell),
            )
        )
    return tuple(found)


def _strain(
    shell: Shell, at: Layup, k: int, compliance: Floats, heights: Floats, columns: int
) -> Floats:
    """Strains of a layer at three heights from what its stresses follow from, (..., 3, 3, m)."""
    z, every = heights[..., None, None], compliance[..., None, :, :6]
    of_resultants = every[..., :3, :] + z * every[..., 3:6, :]
    found = np.zeros((*of_resultants.shape[:-1], columns))
    found[..., :6] = of_resultants
    if held_plies(shell):
        found[..., -1:] = [held_strain(shell, at, k, height) for height in heights]
    return found


def _shears(compliance: Floats, at: Layup, held: bool) -> list[Floats]:
    """Stresses 13, 23 of each layer at three heights in the shell's axes, (..., 3, 2, 2 + 2 m)."""
    # the factor of natural strains is the same all over the shell
    m = 6 * (1 + len(at.branches)) + held
    face, sides = np.zeros((2, 2 * m)), []

    def step(k: int, to: Any) -> Floats:
        both = shear_step(at.layers[k], compliance, at.heights[k], to)
        alone = np.zeros((*both.shape[:-1], int(held)))
        parts = at.among(both[..., :6], k), alone, at.among(both[..., 6:], k), alone
        return np.concatenate(parts, axis=-1)

    for k, (low, high) in enumerate(zip(at.heights, at.heights[1:], strict=False)):
        inner, upper = face + step(k, (low + high) / 2), face + step(k, high)
        sides.append(np.stack([np.broadcast_to(face, upper.shape), inner, upper], axis=-3))
        face = upper
    # what is left at the upper face acts in the surface: loads and inertia, even over the thickness
    whole = np.asarray(at.thickness)[..., None, None]
    integral, below, balanced = np.zeros((2, 2 * m)), np.zeros((1, 1)), []
    for layer, side in zip(at.layers, sides, strict=True):
        h = np.asarray(layer.thickness)[..., None, None]
        shares = np.stack([(below + part * h) / whole for part in (0.0, 0.5, 1.0)], axis=-3)
        balanced.append(side - shares * face[..., None, :, :])
        bottom, middle, top = np.moveaxis(balanced[-1], -3, 0)
        integral, below = integral + h * (bottom + 4 * middle + top) / 6, below + h
    found = []
    # M_11,1 and M_22,2 of the section's strain
    pure = [3, m + 4]
    for side in balanced:
        shape = side[..., pure]
        found.append(np.concatenate([shape, side - shape @ integral[..., None, :, :]], axis=-1))
    return found


class Slopes:
    """Derivatives of what is known at the nodes of a shell, along its material axes.

    Args:
        body: The shell; making it is collective.
    """

    def __init__(self, body: ShellModel) -> None:
        space = body.mixed.subspaces["u"]
        at = np.asarray(space.element.interpolation_points)
        element: Any = space.element.basix_element
        # by the coordinates of the reference element, of each function at each node
        table = np.asarray(element.tabulate(1, at))[1:, :, :, 0]
        axes = ufl.as_vector([*body.surface.e1, *body.surface.e2])
        found = values_in_cells(axes, at, space.mesh)()
        self._nodes = space.dofmap.list[: len(found)]
        tangents = np.einsum("dpf,cfi->cpid", table, body.mixed.nodes("u")[self._nodes])
        along, inverse = found.reshape(*found.shape[:2], 2, 3), np.linalg.pinv(tangents)
        self._weights: Floats = np.einsum("cpdi,cpai,dpf->cpaf", inverse, along, table)

    def elements(self, values: Floats) -> Floats:
        """Derivatives along 1 and 2 in each element at its nodes, shape (cells, nodes, 2 k).

        Args:
            values: At the nodes of this rank, owned and ghost, shape (n, k).
        """
        found = np.einsum("cpaf,cfk->cpak", self._weights, values[self._nodes])
        return np.asarray(found.reshape(*found.shape[:2], -1))

    def back(self, slopes: Floats) -> Floats:
        """Derivatives of a number by values at nodes of elements, shape (cells, nodes, k).

        Args:
            slopes: Its derivatives by what `elements` has, shape (cells, nodes, 2 k).
        """
        by = slopes.reshape(*slopes.shape[:2], 2, -1)
        return np.asarray(np.einsum("cpaf,cpak->cfk", self._weights, by))


class NodalResultants:
    """Resultants of a shell or beam at its nodes: means of what the elements there have.

    Args:
        body: The shell or beam; making it is collective.
        resultants: Resultants of its elements.
        slopes: Whether the derivatives of N and M of a shell, along 1 and along 2, stand behind.

    Attributes:
        solved: Keeps what means over the step need of its start.
        size: Number of the resultants.
        vectors: Resultants, of a state and perhaps as a mean over a step.
    """

    def __init__(self, body: Any, resultants: Resultants, slopes: bool = False) -> None:
        self._resultants, self.solved = resultants, resultants.solved
        self.size, self.vectors = resultants.size, resultants.vectors
        self._space = body.mixed.subspaces["u"]
        topology = self._space.mesh.topology
        self._around = self._space.dofmap.list[: topology.index_map(topology.dim).size_local]
        # elements at each node
        ones = np.ones((len(self._around), 1, 1))
        self._count = np.maximum(sums_at_nodes(self._space, ones), 1.0)
        self._slopes = Slopes(body) if slopes else None

    def _mean(self, values: Floats) -> Floats:
        """Means at the nodes of this rank, shape (n, k), of what elements have, (c, nodes, k)."""
        return sums_at_nodes(self._space, values) / self._count

    def _back(self, slopes: Floats) -> Floats:
        """Derivatives by what elements have, (c, nodes, k), from those by means, ghosts too."""
        return np.asarray((slopes / self._count)[self._around])

    def now(self) -> Floats:
        """Resultants, shape (n, k), of a shell (n, 8), or with the derivatives (n, 20).

        Of a shell whose branches act (n, m + 8), or (n, 3 m + 8), with N and M of `Layup.among`
        before its resultants; and with the factor of natural strains of plies behind these.
        """
        R = self._mean(self._resultants.elements())
        if self._slopes is None:
            return R
        apart = R[:, : max(6, R.shape[1] - 8)]
        return np.concatenate([R, self._mean(self._slopes.elements(apart))], axis=1)

    def back(self, slopes: Floats) -> Floats:
        """Derivatives of a number by resultants at points of elements, (cells, points, size).

        Args:
            slopes: Its derivatives by `now`, shape (n, columns), ghosts included; collective.
        """
        by_node = slopes[:, : self.size].copy()
        if self._slopes is not None:
            by = self._slopes.back(self._back(slopes[:, self.size :]))
            by_node[:, : by.shape[-1]] += sums_at_nodes(self._space, by)
        return self._resultants.back(self._back(by_node))

    def shares(self, values: Floats) -> Floats:
        """Sums in each element of its shares in means at its nodes, shape (cells,).

        Args:
            values: Values at the nodes, shape (n,).
        """
        return np.asarray(self._back(values[:, None]).sum(axis=(1, 2)))


def interlaminar(rows: PlyRows, both: Floats) -> Floats:
    """Stresses 13, 23 of a ply at its bottom, middle and top, shape (n, 6).

    Args:
        rows: Rows of the ply, of all points or of each.
        both: Resultants and their derivatives, shape (n, 20), or more (`NodalResultants.now`).
    """
    found = np.einsum("...sij,...j->...si", rows.shear, both[:, -rows.shear.shape[-1] :])
    return np.asarray(found.reshape(len(both), -1))


class PlyState(NamedTuple):
    """Stresses and strains of all plies at their sides, shape (2, n, plies, 3, 5).

    Components are 11, 22, 12, 13, 23.

    Args:
        total: Them.
        held: What of them is without resultants, where plies have natural strains.
    """

    total: Floats
    held: Floats | None


def ply_state(rows: Sequence[PlyRows], both: Floats) -> PlyState:
    """Stresses and strains of all plies.

    Args:
        rows: Rows of the plies.
        both: Resultants and their derivatives, shape (n, 20), or resultants alone, (n, 8): without
            derivatives stresses and strains 13 and 23 are zero. Or more (`NodalResultants.now`).
    """
    stress, strain, columns = list[Floats](), list[Floats](), rows[0].stress.shape[-1]
    for ply in rows:
        across = slip = np.zeros((len(both), 3, 2))
        if both.shape[1] > columns + 8:
            across = interlaminar(ply, both).reshape(-1, 3, 2)
            slip = np.einsum("...ij,...sj->...si", ply.slip, across)
        for kept, plane, shear in ((stress, ply.stress, across), (strain, ply.strain, slip)):
            inner = np.einsum("...sij,...j->...si", plane, both[:, :columns])
            kept.append(np.concatenate([inner, shear], axis=-1))
    total = np.stack([np.stack(stress, axis=1), np.stack(strain, axis=1)])
    if not rows[0].held:
        return PlyState(total, None)
    # their factor is behind all resultants
    parts = [[plane[..., -1] for plane in (ply.stress, ply.strain)] for ply in rows]
    held = np.zeros_like(total)
    held[..., :3] = np.einsum("kpsi,n->pnksi", parts, both[:, columns - 1])
    return PlyState(total, held)
