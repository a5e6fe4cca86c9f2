"""Rigid motions of a body in words."""

from dataclasses import dataclass

import numpy as np

from shellmb.arrays import Floats

# parts of a motion below this are round-off
SMALL = 1e-6


@dataclass(frozen=True)
class Frame:
    """Frame to which motions of a body are relative.

    Args:
        middle: The point that translations are of, shape (3,), m.
        size: Length of the body, m.
    """

    middle: Floats
    size: float


def describe(frame: Frame, motions: Floats) -> str:
    """Possible motions of a body, as "translate along y and turn about x"; empty if none.

    Args:
        frame: Middle and size of the body.
        motions: Displacements of the middle in lengths of the body over rotations, shape (6, n).
    """
    U, s, _ = np.linalg.svd(motions, full_matrices=False)
    basis = U[:, s > SMALL]
    if basis.shape[1] in (0, 6):
        return "move freely" if basis.shape[1] else ""
    shifts, turns = basis[:3] * frame.size, basis[3:]
    _, s, V = np.linalg.svd(turns)
    rank = int(np.sum(s > SMALL))
    pure = _orthonormal(shifts @ V[rank:].T)
    said = []
    if pure.shape[1]:
        said.append(f"translate along {_listed([_name(a) for a in _axes(pure)])}")
    # of a motion that turns nothing round-off has directions, too
    axes = _axes(_orthonormal(turns)) if rank else []
    moves = [shifts @ np.linalg.lstsq(turns, axis, rcond=SMALL)[0] for axis in axes]
    moves = [move - pure @ (pure.T @ move) for move in moves]
    words = [_name(axis) for axis in axes]
    common = None if pure.shape[1] or not axes else _common_point(frame, axes, moves)
    for k, (axis, move) in enumerate(zip(axes, moves, strict=True)):
        if not pure.shape[1] and common is None:
            words[k] += f" through {_point(frame.middle + np.cross(axis, move), frame.size)}"
        if abs(move @ axis) > SMALL * frame.size:
            words[k] += f" while it moves by {move @ axis:.3g} m per radian along it"
    if axes:
        where = "" if common is None else f" through {_point(common, frame.size)}"
        said.append(f"turn about {_listed(words)}{where}")
    return " and ".join(said)


def _common_point(frame: Frame, axes: list[Floats], moves: list[Floats]) -> Floats | None:
    """The point that all rotations leave where it is, the nearest one to the middle."""
    crosses = np.vstack([np.cross(axis, np.eye(3)).T for axis in axes])
    wanted = -np.concatenate(moves)
    to = np.linalg.lstsq(crosses, wanted, rcond=SMALL)[0]
    left = crosses @ to - wanted
    return None if np.max(np.abs(left)) > SMALL * frame.size else frame.middle + to


def _orthonormal(vectors: Floats) -> Floats:
    """Basis of what vectors span, shape (3, n)."""
    U, s, _ = np.linalg.svd(vectors, full_matrices=False)
    return np.asarray(U[:, s > SMALL * max(np.max(s, initial=0.0), 1e-300)])


def _axes(basis: Floats) -> list[Floats]:
    """Directions that span a space, x, y and z before others."""
    found = [e for e in np.eye(3) if np.linalg.norm(e - basis @ (basis.T @ e)) < SMALL]
    if len(found) == basis.shape[1]:
        return found
    held = np.array(found).reshape(-1, 3).T
    rest = _orthonormal(basis - held @ (held.T @ basis)).T
    # the first component that is not zero is positive
    return found + [a * np.sign(a[np.argmax(np.abs(a) > SMALL)]) for a in rest]


def _name(axis: Floats) -> str:
    for name, e in zip("xyz", np.eye(3), strict=True):
        if np.linalg.norm(axis - e) < SMALL:
            return name
    return _point(axis, 1.0)


def _point(x: Floats, size: float) -> str:
    rounded = np.where(np.abs(x) < SMALL * size, 0.0, x)
    return f"({', '.join(f'{c:.4g}' for c in rounded)})"


def _listed(words: list[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]]) if len(words) > 1 else words[0]
