"""Linear systems with named inputs and outputs: matrices, state spaces, poles, and files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt
import scipy.io
import scipy.linalg as la
import scipy.signal
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from scipy.io.matlab import MatReadError

from shellmb.api.responding.reduction import Matrices, Orders, lowest_modes, refined
from shellmb.arrays import Complex, Floats
from shellmb.errors import SceneError
from shellmb.files.writing import drafted
from shellmb.options.described import checks, takes
from shellmb.scene.lookup import listed

# of the state space without sparse matrices
DENSE = 3000
FORMATS = (".npz", ".mat")
# inputs that accelerate ground
GROUND = ("base.x", "base.y", "base.z")
ORDERED, MATRICES = ("F", "Y", "D"), ("M", "C", "K")
# of the square of the shift: what moves freely has this stiffness where others follow in statics
SLOW = 1e-6


class StateSpace(NamedTuple):
    """Matrices of ``x' = A x + B u, y = C x + D u``, as `scipy.signal.StateSpace` takes them.

    Args:
        A: Shape (2 n, 2 n).
        B: Shape (2 n, inputs).
        C: Shape (outputs, 2 n).
        D: Shape (outputs, inputs).
    """

    A: Floats
    B: Floats
    C: Floats
    D: Floats


class Descriptor(NamedTuple):
    """Matrices of ``E x' = A x + B u, y = C x + D u``; `E` and `A` are sparse.

    Args:
        E: Shape (2 n, 2 n); singular where constraints are kept.
        A: Shape (2 n, 2 n).
        B: Shape (2 n, inputs).
        C: Shape (outputs, 2 n).
        D: Shape (outputs, inputs).
    """

    E: sp.csr_array
    A: sp.csr_array
    B: Floats
    C: Floats
    D: Floats


@checks
@dataclass(frozen=True, eq=False)
class LinearSystem:
    """Small motions about a state, ``M x'' + C x' + K x = F u``, with named inputs and outputs.

    Inputs and outputs act with derivatives, too: ``F u`` is short for ``F[0] u + F[1] u' + F[2]
    u''``, and outputs are ``Y x + D u`` likewise. A prescribed motion acts by all three. What
    relaxes adds ``branches[k] (x - z)`` with ``times[k] z' = x - z``; `F`, `Y` and `D` have parts
    of each branch, behind those of derivatives, that act by ``u - z`` and ``x - z`` likewise.

    Args:
        M: Mass matrix, sparse, shape (n, n).
        C: Damping matrix, with gyroscopic terms.
        K: Stiffness matrix, with that of stresses, and of the rotation.
        F: By inputs and their derivatives, each of shape (n, inputs).
        Y: By coordinates and their derivatives, each of shape (outputs, n).
        D: By inputs and their derivatives, each of shape (outputs, inputs).
        carried: Outputs by the displacement and the velocity of ground that an input accelerates,
            shape (2, outputs, inputs).
        inputs: Names of the inputs.
        outputs: Names of the outputs.
        about: What the state is.
        kept: Whether constraints and their multipliers are among the coordinates.
        shift: A number of the size of the lowest poles, next to which they are looked for [1/s].
        times: Relaxation times of Maxwell branches [s].
        branches: Their stiffness, each of shape (n, n).
        no_outputs: Probes of the scene that are none, by name, with the reason.
    """

    M: sp.csr_array
    C: sp.csr_array
    K: sp.csr_array
    F: Orders
    Y: Orders
    D: Orders
    carried: Floats
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    about: str = ""
    kept: bool = False
    shift: float = 1.0
    times: tuple[float, ...] = ()
    branches: Matrices = ()
    no_outputs: Mapping[str, str] = MappingProxyType({})

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.K.shape[0])

    def powers(self, s: complex) -> tuple[complex, ...]:
        """Factors of `K`, `C`, `M` and `branches`, and of the parts of `F`, `Y` and `D`.

        Args:
            s: The motion is `exp(s t)`, 1/s.
        """
        return 1.0, s, s * s, *(s * time / (1 + s * time) for time in self.times)

    def select(
        self, inputs: Sequence[str] | str | None = None, outputs: Sequence[str] | str | None = None
    ) -> LinearSystem:
        """The system with some of its inputs and outputs, in the order given.

        Args:
            inputs: Names; None: all.
            outputs: Names; None: all.

        Raises:
            SceneError: If there is no such name.
        """
        i = _places("input", inputs, self.inputs)
        o = _places("output", outputs, self.outputs, self.no_outputs)
        return replace(
            self,
            F=tuple(f[:, i] for f in self.F),
            Y=tuple(y[o] for y in self.Y),
            D=tuple(d[np.ix_(o, i)] for d in self.D),
            carried=self.carried[:, o][:, :, i],
            inputs=tuple(self.inputs[k] for k in i),
            outputs=tuple(self.outputs[k] for k in o),
        )

    def absolute(self) -> LinearSystem:
        """The system whose displacements are those in space, not relative to accelerated ground.

        Inputs `base.x` etc. are displacements of ground then.
        """
        base = np.array([name in GROUND for name in self.inputs], dtype=bool)
        F, D = (tuple(np.where(base, 0.0, a) for a in own) for own in (self.F, self.D))
        F[2][:, base], D[2][:, base] = self.F[0][:, base], self.D[0][:, base]
        for order, own in enumerate(self.carried):
            D[order][:, base] += own[:, base]
        return replace(self, F=F, D=D)

    def modal(self, count: int, static: bool = False, within: float = 0.0) -> LinearSystem:
        """The system reduced to its lowest undamped modes, normalised to a mass of one.

        Prescribed motions move the modes by the shapes that they give the system slowly.

        Args:
            count: Number of modes.
            static: Whether the other modes follow forces as in statics, in `D`; of what relaxes
                by coordinates without mass, whose stiffness depends on the frequency, too.
            within: As of `lowest_modes`.

        Raises:
            SceneError: If constraints are kept, or there are not so many modes.
        """
        if self.kept:
            raise SceneError("linearise: modes have no constraints; leave out constraints='kept'")
        values, V = lowest_modes(self.K, self.M, count, within)
        F, D = [f.copy() for f in self.F], [d.copy() for d in self.D]
        slow = SLOW * self.shift**2
        follows = spla.splu((self.K + slow * self.M).tocsc()).solve(F[0])
        motions = F[2].any(axis=0)
        X = np.where(motions, follows, 0.0)
        F[0] = np.where(motions, slow * (self.M @ X), F[0])
        for order, A in enumerate((self.C, self.M, *self.branches), start=1):
            F[order] = F[order] - A @ X
        skew = V.T @ (0.5 * (self.K - self.K.T) @ V)
        M, K = np.eye(count), np.diag(values) + skew
        if static:
            rest = follows - V @ ((V.T @ self.F[0]) / (values + slow)[:, None])
            rest = np.where(motions, 0.0, rest)
            if self.times:
                # it has no part in the modes
                rest = la.orth(rest)
                M, K = (
                    la.block_diag(*of)
                    for of in ((M, 0 * rest.T @ rest), (K, rest.T @ self.K @ rest))
                )
                V = np.hstack([V, rest])
            else:
                X = X + rest
        D = [d + y @ X for d, y in zip(D, self.Y, strict=True)]
        others = (V.T @ (A @ V) for A in (self.C, *self.branches))
        M, K, C, *branches = (sp.csr_array(A) for A in (M, K, *others))
        found: dict[str, Any] = {"M": M, "C": C, "K": K, "branches": tuple(branches)}
        F, Y = [V.T @ f for f in F], [y @ V for y in self.Y]
        return replace(self, F=tuple(F), Y=tuple(Y), D=tuple(D), **found)

    def descriptor(self) -> Descriptor:
        """The first-order form with sparse matrices, of coordinates and their rates.

        For each branch there follow the dashpots' parts of the coordinates, and of inputs that
        strain it. Inputs and outputs are those of `state_space`.
        """
        if self.Y[2].any():
            raise SceneError(
                "linearise: forces of joints depend on accelerations where constraints are "
                "eliminated; use constraints='kept', state_space(), or other outputs"
            )
        return self._first_order()

    def _first_order(self) -> Descriptor:
        """The first-order form, without what outputs have of accelerations."""
        n, (force, direct) = self.size, self._forced()
        some, plain = self._straining, self._acting[0]
        acting = np.eye(len(self.inputs))[some]
        one, own = sp.eye_array(n), sp.eye_array(n + len(acting))
        # what dashpots follow: tau z' = (x, u) - z
        to = sp.vstack([one, sp.csr_array((len(acting), n))])
        given = np.zeros((n + len(acting), force.shape[1]))
        given[n:, : int(plain.sum())] = acting[:, plain]
        seen = [np.hstack([y, d[:, some]]) for y, d in zip(self.Y[3:], self.D[3:], strict=True)]
        springs = [
            sp.hstack([A, -f[:, some]]) for A, f in zip(self.branches, self.F[3:], strict=True)
        ]
        count = range(len(self.times))
        rows: list[list[Any]] = [
            [None, one, *(None for _ in count)],
            [-sum(self.branches, self.K), -self.C, *springs],
            *([to, None, *(-own if j == k else None for j in count)] for k in count),
        ]
        E = sp.block_diag([one, self.M, *(t * own for t in self.times)], format="csr")
        B = np.vstack([np.zeros_like(force), force, *(given for _ in count)])
        C = np.hstack([sum(self.Y[3:], self.Y[0]), self.Y[1], *(-y for y in seen)])
        return Descriptor(E, sp.block_array(rows, format="csr"), B, C, direct)

    def state_space(self, modes: int | None = None) -> StateSpace:
        """The state space with the states of `descriptor`, in dense matrices.

        Its inputs are `input_names`, with modes those of `modal(modes)`: those that act by their
        derivatives have more than one.

        Args:
            modes: Number of undamped modes that coordinates are reduced to; None: none.

        Raises:
            SceneError: If constraints are kept, or there are too many coordinates.
        """
        if self.kept:
            raise SceneError(
                "linearise: a state space has no constraints; leave out constraints='kept', or "
                "use descriptor()"
            )
        if modes is not None:
            return self.modal(modes).state_space()
        if self.size * (2 + len(self.times)) > 2 * DENSE:
            raise SceneError(
                f"linearise: a dense state space of {self.size} coordinates is too large; give "
                f"modes, or use descriptor() (at most {2 * DENSE // (2 + len(self.times))})"
            )
        first, n = self._first_order(), self.size
        solve = spla.splu(first.E.tocsc()).solve
        A, B = solve(first.A.toarray()), solve(first.B)
        rates, y = slice(n, 2 * n), self.Y[2]
        return StateSpace(A, B, first.C + y @ A[rates], first.D + y @ B[rates])

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs of state spaces: `NAME'` and `NAME''` are derivatives."""
        return tuple(
            name + order * "'"
            for order, places in enumerate(self._acting)
            for name, acts in zip(self.inputs, places, strict=True)
            if acts
        )

    @property
    def _acting(self) -> list[npt.NDArray[np.bool_]]:
        found = [
            (f != 0).any(axis=0) | (d != 0).any(axis=0) for f, d in zip(self.F, self.D, strict=True)
        ]
        found[0] |= ~(found[1] | found[2]) | self._straining
        return found[:3]

    @property
    def _straining(self) -> npt.NDArray[np.bool_]:
        """Inputs that strain branches by themselves."""
        parts = [np.vstack(pair) for pair in zip(self.F[3:], self.D[3:], strict=True)]
        return np.any(np.vstack([np.zeros((1, len(self.inputs))), *parts]), axis=0)

    def _forced(self) -> tuple[Floats, Floats]:
        """Forces and direct outputs by the inputs of state spaces."""
        places = self._acting
        # forces and outputs at once: of all of the branches
        parts = ([sum(of[3:], of[0]), *of[1:3]] for of in (self.F, self.D))
        return tuple(  # type: ignore[return-value]
            np.hstack([a[:, own] for a, own in zip(of, places, strict=True)]) for of in parts
        )

    def poles(self, count: int = 6) -> Complex:
        """Eigenvalues ``s`` of motions ``exp(s t)``, the smallest ones, of pairs one [1/s].

        Of what relaxes, poles that creep and decay are left out, as of `modes`.

        Args:
            count: How many.

        Raises:
            SceneError: If it is none.
        """
        if count < 1:
            raise SceneError(f"linearise: count is {count}; it must be at least 1")
        if self.size == 0:
            # everything is driven
            return np.zeros(0, dtype=np.complex128)
        from mpi4py import MPI
        from petsc4py import PETSc

        from shellmb.running.rotating.quadratic import motions
        from shellmb.system.direct.symmetry import is_symmetric

        def petsc(A: sp.csr_array) -> Any:
            csr = A.indptr.astype(PETSc.IntType), A.indices.astype(PETSc.IntType), A.data
            return PETSc.Mat().createAIJ(A.shape, csr=csr, comm=MPI.COMM_SELF)

        matrices = self.M, self.C, self.K
        m, c, k = map(petsc, matrices)
        springs = dict(zip(self.times, map(petsc, self.branches), strict=True))
        zero, above = motions((k, c, m), springs, count, self.shift)
        values = [pair.value for pair in above]
        if not (springs or (is_symmetric(k) and is_symmetric(c))):
            values = [refined(pair, matrices) for pair in above[:count]]
        return np.array([*[0.0] * len(zero), *values], dtype=np.complex128)[:count]

    def to_scipy(self, modes: int | None = None) -> Any:
        """The state space as a `scipy.signal.StateSpace`.

        Args:
            modes: As of `state_space`.
        """
        return scipy.signal.StateSpace(*self.state_space(modes))

    def to_control(self, modes: int | None = None) -> Any:
        """The state space as one of python-control, with names (`_` for `.`).

        Args:
            modes: As of `state_space`.

        Raises:
            SceneError: If python-control is not installed.
        """
        try:
            import control  # type: ignore[import-not-found, unused-ignore]
        except ImportError:
            raise SceneError(
                "linearise: python-control is not installed; install it (pip install control), or "
                "use to_scipy()"
            ) from None
        whole = self if modes is None else self.modal(modes)
        every = {"inputs": whole.input_names, "outputs": whole.outputs}
        # it takes no names with points
        names = {k: [name.replace(".", "_") for name in of] for k, of in every.items()}
        return control.ss(*whole.state_space(), **names)

    def save(self, path: Path | str) -> Path:
        """Write the system to a file, which `load` reads.

        Args:
            path: Name that ends in `.npz` (NumPy) or `.mat` (MATLAB, Octave).

        Raises:
            SceneError: If it has another ending, or cannot be written.
        """
        where, matlab = _of_format(path)
        content = {f"{n}{k}": part for n in ORDERED for k, part in enumerate(getattr(self, n))}
        matrices = {name: getattr(self, name) for name in MATRICES}
        matrices |= {f"K{k}": own for k, own in enumerate(self.branches)}
        for name, matrix in matrices.items():
            A = matrix.tocoo()
            content[name] = A.tocsc() if matlab else np.array([A.row, A.col, A.data])
        words = ("\t".join(self.inputs), "\t".join(self.outputs), self.about)
        content |= {"carried": self.carried, "names": np.array("\n".join(words))}
        content["times"] = np.array(self.times)
        content["numbers"] = np.array([self.kept, self.shift], dtype=float)
        try:
            with drafted(where) as draft, draft.open("wb") as file:
                if matlab:
                    scipy.io.savemat(file, content)
                else:
                    np.savez_compressed(file, allow_pickle=False, **content)
        except OSError as error:
            raise SceneError(
                f"linearise: {where} cannot be written ({error.strerror}); its folder must exist"
            ) from None
        return where

    @classmethod
    @takes()
    def load(cls, path: Path | str) -> LinearSystem:
        """Read a system that `save` wrote.

        Args:
            path: The file.

        Raises:
            SceneError: If it is no such file.
        """
        where, matlab = _of_format(path)
        try:
            if matlab:
                content = scipy.io.loadmat(where, spmatrix=False)
            else:
                with where.open("rb") as file, np.load(file, allow_pickle=False) as read:
                    content = dict(read)
            times = tuple(np.ravel(content.get("times", ())).tolist())
            found: dict[str, Any] = {
                name: tuple(content[f"{name}{k}"] for k in range(3 + len(times)))
                for name in ORDERED
            }
            size = len(found["F"][0])

            def matrix(name: str) -> sp.csr_array:
                A = content[name]
                entries = A if matlab else (A[2], A[:2].astype(int))
                return sp.csr_array(entries, shape=(size, size))

            found |= {name: matrix(name) for name in MATRICES}
            found |= {"times": times, "branches": tuple(matrix(f"K{t}") for t in range(len(times)))}
            inputs, outputs, about = str(np.ravel(content["names"])[0]).split("\n")
            names = [tuple(of.split("\t")) if of else () for of in (inputs, outputs)]
            kept, shift = np.ravel(content["numbers"]).tolist()
            carried = content["carried"]
        except (OSError, EOFError, LookupError, ValueError, BadZipFile, MatReadError) as error:
            raise SceneError(
                f"linearise: {where} holds no linear system ({error}); it must be a file that "
                "LinearSystem.save wrote"
            ) from None
        found |= {"carried": carried, "inputs": names[0], "outputs": names[1], "about": about}
        return cls(**found, kept=bool(kept), shift=shift)


def _of_format(path: Path | str) -> tuple[Path, bool]:
    """A file, and whether it is MATLAB's."""
    where = Path(path)
    if where.suffix not in FORMATS:
        raise SceneError(
            f"linearise: file is {str(path)!r}; its name must end in {' or '.join(FORMATS)}"
        )
    return where, where.suffix == ".mat"


def _places(
    what: str,
    given: Sequence[str] | str | None,
    known: tuple[str, ...],
    none: Mapping[str, str] = MappingProxyType({}),
) -> list[int]:
    """Places of names among those that are known."""
    if given is None:
        return list(range(len(known)))
    names = [given] if isinstance(given, str) else list(given)
    for name in names:
        if name not in known:
            why = f", which is none ({none[name]})" if name in none else ""
            right = f"it must be one of {listed(known) or 'none'}"
            raise SceneError(f"{what} is {name!r}{why}; {right}")
    return [known.index(name) for name in names]
