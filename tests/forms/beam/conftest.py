"""Small beams in random states, and scalar forms of them."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.model.frames.beam import BeamModel, build_beam
from shellmb.native.expressions import values_in_cells
from shellmb.scene import Beam, Curve, GeneralSection, Load, ParametricCurve, RectangularSection
from tests.forms.conftest import compiled

POINTS = np.array([[0.1], [0.5], [0.8]])


def coupled() -> GeneralSection:
    """A section in which every strain is coupled to every resultant, and eccentric mass."""
    rng = np.random.default_rng(7)
    root = rng.normal(size=(6, 6))
    return GeneralSection(
        root @ root.T + np.eye(6),
        mass_per_length=1.5,
        first_moments=(0.2, -0.1),
        second_moments=(0.4, 0.1, 0.3),
        size=0.3,
    )


SECTIONS = {
    "rectangle": RectangularSection(E=2.6, nu=0.3, width=0.3, height=0.2, density=1.5),
    "coupled": coupled(),
    "far": RectangularSection(E=2.6, nu=0.3, width=0.3, height=0.2, density=1.5, offset=(0.9, 0.5)),
}


def helix(xi: np.ndarray) -> np.ndarray:
    """Curved and twisted: no term of the strains vanishes in the reference state."""
    return np.stack([np.cos(2 * xi), np.sin(2 * xi), 0.7 * xi])


@dataclass
class BeamSample:
    """A beam of two elements with functions in its space."""

    body: BeamModel
    compiled: dict[str, fem.Form] = field(default_factory=dict)

    def __post_init__(self) -> None:
        space = self.body.mixed.space
        self.a, self.b, self.v, self.dq = (fem.Function(space) for _ in range(4))
        self.a.name, self.b.name = "a", "b"

    @property
    def X(self) -> np.ndarray:
        return self.body.mixed.nodes("u")

    @property
    def D(self) -> np.ndarray:
        return self.body.node_directors()

    def value(self, name: str, make: Callable[[], ufl.Form]) -> float:
        """Value of a scalar form, compiled once under its name."""
        if name not in self.compiled:
            self.compiled[name] = compiled(make())
        return float(fem.assemble_scalar(self.compiled[name]))

    def part(self, q: fem.Function, name: str) -> np.ndarray:
        size = self.body.mixed.parts[name][1]
        return q.x.array[self.body.mixed.dofs[name]].reshape(-1, size)

    def set_part(self, q: fem.Function, name: str, values: np.ndarray) -> None:
        q.x.array[self.body.mixed.dofs[name]] = values.ravel()

    def set_frames(self, q: fem.Function, d: np.ndarray) -> None:
        self.set_part(q, "w", d - self.D)

    def randomise(
        self, q: fem.Function, rng: np.random.Generator, size: float, turn: np.ndarray | None = None
    ) -> None:
        """Noise of a relative size on top of a rigid rotation; orthonormal frames."""
        Q = np.eye(3) if turn is None else turn
        self.noise(q, rng, size)
        u, w = self.part(q, "u").copy(), self.part(q, "w").reshape(-1, 3, 3)
        self.set_part(q, "u", self.X @ (Q - np.eye(3)).T + 0.1 * u)
        left, _, right = np.linalg.svd(self.D @ Q.T + w)
        self.set_frames(q, left @ right)
        if self.body.ties:
            self.turn_frames(q, Q)

    def turn_frames(self, q: fem.Function, Q: np.ndarray) -> None:
        """Turn the floating frame, which in these states is another one on each cell."""
        d = np.eye(3) + self.part(q, "frame").reshape(-1, 3, 3)
        self.set_part(q, "frame", d @ Q.T - np.eye(3))

    def move_rigidly(self, q: fem.Function, Q: np.ndarray, c: np.ndarray) -> None:
        """Superpose a rigid motion on a state; forces along the directors stay as they are."""
        u, w = self.part(q, "u"), self.part(q, "w").reshape(-1, 3, 3)
        self.set_part(q, "u", (self.X + u) @ Q.T + c - self.X)
        self.set_frames(q, (self.D + w) @ Q.T)
        if self.body.ties:
            self.turn_frames(q, Q)

    def noise(self, q: fem.Function, rng: np.random.Generator, size: float = 1.0) -> None:
        q.x.array[:] = size * rng.normal(size=len(q.x.array))

    def at_points(self, expression: Any, points: np.ndarray = POINTS) -> np.ndarray:
        """Values of an expression at points of each element."""
        domain = self.body.domain.mesh
        found = values_in_cells(expression, points, domain)()
        return found.reshape(len(found), -1)


_SAMPLES: dict[tuple[Any, ...], BeamSample] = {}


def make_sample(
    degree: int,
    section: str,
    loads: tuple[Load, ...] = (),
    elements: int = 2,
    curve: Curve | None = None,
    model: str = "exact",
) -> BeamSample:
    """A beam along the helix, or along another curve with z as its third direction."""
    key = (degree, section, loads, elements, curve, model)
    if key not in _SAMPLES:
        line = ParametricCurve(helix) if curve is None else curve
        up = (0.1, 0.2, 1.0) if curve is None else (0.0, 0.0, 1.0)
        beam = Beam("b", line, SECTIONS[section], elements, degree, up, model=model)  # type: ignore[arg-type]
        _SAMPLES[key] = BeamSample(build_beam(beam, MPI.COMM_WORLD, list(loads), True))
    return _SAMPLES[key]


@pytest.fixture
def sample() -> Callable[..., BeamSample]:
    return make_sample


CASES = [(2, "rectangle"), (2, "coupled"), (3, "coupled"), (2, "coupled", "floating-frame")]


@pytest.fixture(params=CASES, ids=lambda case: "-".join(map(str, case)))
def beam(request: pytest.FixtureRequest) -> BeamSample:
    """Some combinations of degree and section."""
    degree, section, *model = request.param
    return make_sample(degree, section, model=model[0] if model else "exact")
