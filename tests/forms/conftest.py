"""Small shells in random states, and scalar forms of them (which compile quickly)."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.forms import materials
from shellmb.forms.steps.mixed_nonlinear import ties as ties_of
from shellmb.meshes.mesh import build_surface
from shellmb.model.shells.shell import ShellModel, build_shell
from shellmb.native.kernels import compiled
from shellmb.scene import Cylinder, Hyperelastic, Isotropic, Laminate, Load, PlyMaterial, Shell

# moduli of order one: nothing is scaled away in the comparisons
RUBBER = {"mu": 1.0, "thickness": 0.1, "shear_correction": 5 / 6}
ELASTIC = {"E": 2.6, "nu": 0.3, "thickness": 0.1, "shear_correction": 5 / 6}
PLY = PlyMaterial(E1=10.0, E2=1.0, nu12=0.25, G12=0.5, G13=0.5, G23=0.3, density=1.5)
SECTIONS = {
    "isotropic": Isotropic(E=2.6, nu=0.3, thickness=0.1, density=1.5, offset=0.0),
    # unsymmetric, so that B is not zero, and eccentric, so that s* is not zero
    "coupled": Laminate.from_stacking(PLY, 0.05, (0, 60), offset=0.02),
    "neo-hookean": Hyperelastic(
        materials.neo_hookean, RUBBER, thickness=0.1, density=1.5, stiffness=0.3
    ),
    "quadratic": Hyperelastic(
        materials.isotropic_quadratic, ELASTIC, thickness=0.1, density=1.5, stiffness=0.3
    ),
}
CASES = [
    ("quad", "isotropic"),
    ("quad", "coupled"),
    ("quad", "neo-hookean"),
    ("quad", "quadratic"),
    ("tri", "isotropic"),
    pytest.param(("tri", "neo-hookean"), marks=pytest.mark.slow),
    ("quad", "coupled", "floating-frame"),
    pytest.param(("tri", "isotropic", "floating-frame"), marks=pytest.mark.slow),
]


def rotation(rng: np.random.Generator) -> np.ndarray:
    """A random rotation."""
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q if np.linalg.det(Q) > 0 else -Q


@dataclass
class Sample:
    """A shell on a curved mesh of four to eight cells, with functions in its space."""

    body: ShellModel
    compiled: dict[str, fem.Form] = field(default_factory=dict)

    def __post_init__(self) -> None:
        space = self.body.mixed.space
        self.a, self.b, self.v, self.dq = (fem.Function(space) for _ in range(4))

    @property
    def X(self) -> np.ndarray:
        return self.body.mixed.nodes("u")

    @property
    def D(self) -> np.ndarray:
        return self.body.director.x.array.reshape(-1, 3)

    def value(self, name: str, make: Callable[[], ufl.Form]) -> float:
        """Value of a scalar form, compiled once under its name."""
        if name not in self.compiled:
            self.compiled[name] = compiled(make())
        return float(fem.assemble_scalar(self.compiled[name]))

    def part(self, q: fem.Function, name: str) -> np.ndarray:
        """Values of a part, one row per node."""
        size = self.body.mixed.parts[name][1]
        return q.x.array[self.body.mixed.dofs[name]].reshape(-1, size)

    def set_part(self, q: fem.Function, name: str, values: np.ndarray) -> None:
        q.x.array[self.body.mixed.dofs[name]] = values.ravel()

    def randomise(
        self, q: fem.Function, rng: np.random.Generator, size: float, turn: np.ndarray | None = None
    ) -> None:
        """Noise of a relative size on top of a rigid rotation; directors of unit length."""
        Q = np.eye(3) if turn is None else turn
        q.x.array[:] = size * rng.normal(size=len(q.x.array))
        u = self.part(q, "u")
        self.set_part(q, "u", self.X @ (Q - np.eye(3)).T + 0.1 * u)
        d = self.D @ Q.T + self.part(q, "w")
        self.set_part(q, "w", d / np.linalg.norm(d, axis=1, keepdims=True) - self.D)
        if self.body.ties:
            self.turn_frames(q, Q)

    def turn_frames(self, q: fem.Function, Q: np.ndarray) -> None:
        """Turn the floating frame, which in these states is another one on each cell."""
        d = np.eye(3) + self.part(q, "frame").reshape(-1, 3, 3)
        self.set_part(q, "frame", d @ Q.T - np.eye(3))

    def move_rigidly(self, q: fem.Function, Q: np.ndarray, c: np.ndarray) -> None:
        """Superpose a rigid motion on a state; resultants in the material axes stay as they are."""
        u, w = self.part(q, "u"), self.part(q, "w")
        self.set_part(q, "u", (self.X + u) @ Q.T + c - self.X)
        self.set_part(q, "w", (self.D + w) @ Q.T - self.D)
        if self.body.ties:
            self.turn_frames(q, Q)

    def noise(self, q: fem.Function, rng: np.random.Generator) -> None:
        """A random direction of order one."""
        q.x.array[:] = rng.normal(size=len(q.x.array))


def tie_of_strains(body: ShellModel, q: fem.Function) -> ufl.Form:
    """Work of the forces on what own strains of elements and those of displacements differ by."""
    N = body.section.formulation.N0 * body.layout.forces(q)
    ties = ties_of(body.strain, body.layout)
    return body.integrate([ufl.dot(tie.act(N), tie.measure.value(q)) for tie in ties])


_SAMPLES: dict[tuple[str, str, str, tuple[Load, ...]], Sample] = {}


def make_sample(
    cell: str, section: str, loads: tuple[Load, ...] = (), model: str = "exact"
) -> Sample:
    key = (cell, section, model, loads)
    if key not in _SAMPLES:
        # a curved panel: D varies, and no term of the strains vanishes in the reference state
        surface = Cylinder(radius=1.0, length=0.8, angles=(10, 60))
        shell = Shell("panel", surface, SECTIONS[section], mesh=(2, 2), cell=cell)  # type: ignore[arg-type]
        shell = replace(shell, direction=(0.3, 1.0, 0.2), model=model)
        body = build_shell(shell, build_surface(shell, MPI.COMM_WORLD), list(loads), True)
        _SAMPLES[key] = Sample(body)
    return _SAMPLES[key]


@pytest.fixture
def sample() -> Callable[..., Sample]:
    return make_sample


@pytest.fixture
def turn() -> Callable[[np.random.Generator], np.ndarray]:
    return rotation


@pytest.fixture(params=CASES, ids=lambda case: "-".join(case))
def panel(request: pytest.FixtureRequest) -> Sample:
    """Each combination of cell and section."""
    cell, section, *model = request.param
    return make_sample(cell, section, model=model[0] if model else "exact")


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20021)
