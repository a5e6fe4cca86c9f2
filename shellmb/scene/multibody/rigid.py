"""Rigid bodies."""

import os
from dataclasses import field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.scene.types import NONE, Listed, Matrix3, Name, NonNegative, Positive, Vec3, explained
from shellmb.scene.values.bodies import SceneBody
from shellmb.scene.values.validate import described, error_of, listed, refused, show

RESERVED = ("origin", "center")


def rotation_matrix(vector: Any) -> Floats:
    """Rotation about ``vector`` by its length, shape (3, 3).

    Args:
        vector: Rotation vector, shape (3,) [rad].
    """
    v = np.asarray(vector, dtype=float)
    angle = float(np.linalg.norm(v))
    if angle == 0:
        return np.eye(3)
    x, y, z = v / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k)


VectorOrMatrix = Annotated[
    Vec3 | Matrix3, explained("it must be three finite numbers or three rows of three")
]

# shapes that mass and inertia determine, and files of surfaces
EQUIVALENT, SURFACES = ("box", "rod"), (".stl", ".obj", ".ply")


def _file(value: Any) -> Path:
    if not isinstance(value, str | Path) or Path(value).suffix.lower() not in SURFACES:
        raise ValueError(value)
    return Path(value)


def _there(value: Any) -> Any:
    if isinstance(value, Path) and not os.path.isfile(value):
        raise ValueError("there is no such file")
    return value


# a shape in pictures
DrawnShape = Annotated[
    Literal["box", "rod"]
    | tuple[Positive, Positive, Positive]
    | Annotated[Path, BeforeValidator(_file)]
    | None,
    explained(
        "it must be 'box' or 'rod' (of the body's mass and inertia), the three sides of a box [m], "
        f"or a surface in a file ({', '.join(SURFACES)})"
    ),
    AfterValidator(_there),
]


@described("rigid body")
class RigidBody(SceneBody):
    """A rigid body: a reference point, three axes, mass and inertia.

    Besides ``points`` it has the points ``"origin"``, its reference point, and ``"center"``, its
    centre of mass.

    Args:
        name: What joints, loads and results call it.
        mass: Mass [kg]; in motion 0 only of a massless frame that is carried along: welded to a
            body with mass (another rigid body, a beam, or an edge or area of a shell), or driven
            in all coordinates of its joint to such a body, the ground, or a frame that is carried.
        inertia: Inertia tensor about the centre of mass in the body's axes, ``J_11 = int rho (y^2 +
            z^2)``, ``J_12 = -int rho x y``: three principal values or three rows [kg m^2].
        position: The reference point in the scene [m].
        rotation: From the scene's axes to the body's: a rotation vector [rad], or a matrix whose
            columns are the body's axes.
        com: Centre of mass from the reference point, in the body's axes [m].
        points: Named points from the reference point, in the body's axes [m].
        shape: What pictures and field files show of it beside lines to its points: ``"box"`` (a
            plate, where one side is thin) or ``"rod"``, the homogeneous one of its mass and
            inertia; the three sides of a box about the centre of mass along the body's axes [m];
            or a file of a surface from the reference point in the body's axes [m].
    """

    name: Name
    mass: NonNegative
    inertia: VectorOrMatrix
    position: Vec3 = (0.0, 0.0, 0.0)
    rotation: VectorOrMatrix = (0.0, 0.0, 0.0)
    com: Vec3 = (0.0, 0.0, 0.0)
    points: dict[str, Vec3] = field(default_factory=dict)
    shape: DrawnShape = None

    model = "rigid"
    directors = 3
    single = True
    # of the frame of a reduced body
    mass_damping = 0.0

    def __post_init__(self) -> None:
        """Check inertia, rotation and names.

        Raises:
            SceneError: If no body has such an inertia, the matrix is no rotation, or a point has
                one of the names that every body has.
        """
        _ = self.axes
        self._check_inertia()
        if self.shape in EQUIVALENT and not (self.mass > 0 and self.inertia_tensor.any()):
            raise SceneError(
                f"rigid body '{self.name}': shape is '{self.shape}', which mass and inertia "
                "determine, and one of them is 0; give the three sides of a box [m]"
            )
        for name in self.points:
            if name in RESERVED or not name:
                raise SceneError(
                    f"rigid body '{self.name}': a point is named {show(name)}; it must have "
                    "another name than 'origin' and 'center', which every body has"
                )

    def _check_inertia(self) -> None:
        J = self.inertia_tensor
        size = np.abs(J).max()
        if np.abs(J - J.T).max() > 1e-9 * size:
            raise refused(self, "inertia", "it must be symmetric")
        principal = np.linalg.eigvalsh(J)
        said = ", ".join(f"{p:.6g}" for p in principal)
        if principal[0] < -1e-9 * size:
            raise error_of(
                self, f"inertia has the principal moments {said}; none of them must be negative"
            )
        if principal[2] - principal[0] - principal[1] > 1e-9 * size:
            raise SceneError(
                f"rigid body '{self.name}': inertia has the principal moments {said}; each must "
                "be at most the sum of the other two"
            )

    @cached_property
    def inertia_tensor(self) -> Floats:
        """About the centre of mass in the body's axes, shape (3, 3) [kg m^2]."""
        J = np.asarray(self.inertia)
        return np.diag(J) if J.ndim == 1 else J

    @cached_property
    def euler_tensor(self) -> Floats:
        """``int rho y y^T = tr(J)/2 I - J`` about the centre of mass in body axes, (3, 3) [kg m^2].

        Positive semidefinite: what round-off makes negative is cut off.
        """
        J = (self.inertia_tensor + self.inertia_tensor.T) / 2
        E = np.trace(J) / 2 * np.eye(3) - J
        values, vectors = np.linalg.eigh(E)
        if values[0] >= 0:
            return np.asarray(E)
        return np.asarray(vectors @ np.diag(np.maximum(values, 0)) @ vectors.T)

    @cached_property
    def axes(self) -> Floats:
        """The body's axes d1, d2, d3 in the scene, the columns of a matrix (3, 3).

        Raises:
            SceneError: If the given matrix is no rotation.
        """
        R = np.asarray(self.rotation)
        if R.ndim == 1:
            R = rotation_matrix(R)
        elif np.abs(R.T @ R - np.eye(3)).max() > 1e-6 or np.linalg.det(R) < 0:
            raise refused(self, "rotation", "its columns must be orthonormal and right-handed")
        # orthonormal to round-off, also where few digits were given
        u, _, v = np.linalg.svd(R)
        return np.asarray(u @ v)

    @property
    def mass_given(self) -> float:
        """Mass [kg]."""
        return self.mass

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of all its points."""
        return (*RESERVED, *self.points)

    @property
    def center(self) -> Floats:
        """The centre of mass in the scene, shape (3,) [m]."""
        return self.place("center")

    def place(self, point: str | tuple[float, ...] | None = None) -> Floats:
        """Position of a point in the scene's reference configuration, shape (3,) [m].

        Args:
            point: Name of a point; coordinates in the scene, which are given back; None: the
                reference point.

        Raises:
            SceneError: If there is no point of that name.
        """
        if point is not None and not isinstance(point, str):
            return np.asarray(point, dtype=float)
        local = {"origin": (0.0, 0.0, 0.0), "center": self.com, **self.points}
        if (point or "origin") not in local:
            known = f"its points are {listed(local)}, or give coordinates"
            raise error_of(self, f"there is no point '{point}'; {known}")
        return np.asarray(self.position) + self.axes @ np.asarray(local[point or "origin"])


@described("rigid body")
class FloatingFrame(RigidBody):
    """The frame of a body in modes, with its mass; scenes make them themselves.

    Args:
        mass_damping: Damping in proportion to the mass, a rate [1/s].
        terms: Terms that act on the body.
    """

    mass_damping: NonNegative = 0.0
    terms: Listed[Any] = NONE


@described("interface")
class Interface(RigidBody):
    """A massless frame that moves with the modes of a reduced body; scenes make them themselves.

    Args:
        of: Name of the reduced body's floating frame.
    """

    of: str = ""
