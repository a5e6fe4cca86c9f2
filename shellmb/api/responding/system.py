"""Linear systems with named inputs and outputs: matrices, state spaces, poles, and files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
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

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.files.writing import drafted
from shellmb.scene.lookup import listed

type Complex = npt.NDArray[np.complex128]
# of a quantity, of its first and of its second derivative
type Orders = tuple[Floats, ...]

# of the state space without sparse matrices
DENSE = 3000
FORMATS = (".npz", ".mat")
# inputs that accelerate ground
GROUND = ("base.x", "base.y", "base.z")
ORDERED, MATRICES = ("F", "Y", "D"), ("M", "C", "K")
# more poles than wanted, of which both of a pair are found; and those that are infinite
SPARE, INFINITE = 6, 1e-12
# of the square of the shift: what moves freely has this stiffness where others follow in statics
SLOW = 1e-6
# matrices are symmetric to round-off
EVEN = 1e-13


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


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """Small motions about a state, ``M x'' + C x' + K x = F u``, with named inputs and outputs.

    Inputs and outputs act with derivatives, too: ``F u`` is short for ``F[0] u + F[1] u' + F[2]
    u''``, and outputs are ``Y x + D u`` likewise. A prescribed motion acts by all three.

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

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.K.shape[0])

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
        i, o = _places("input", inputs, self.inputs), _places("output", outputs, self.outputs)
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

    def modal(self, count: int, static: bool = False) -> LinearSystem:
        """The system reduced to its lowest undamped modes, normalised to a mass of one.

        Prescribed motions move the modes by the shapes that they give the system slowly.

        Args:
            count: Number of modes.
            static: Whether the other modes follow forces as in statics, in `D`.

        Raises:
            SceneError: If constraints are kept, or there are not so many modes.
        """
        if self.kept:
            raise SceneError("linearise: modes have no constraints; leave out constraints='kept'")
        values, V = lowest_modes(self.K, self.M, count)
        F, D = [f.copy() for f in self.F], [d.copy() for d in self.D]
        slow = SLOW * self.shift**2
        follows = spla.splu((self.K + slow * self.M).tocsc()).solve(F[0])
        motions = F[2].any(axis=0)
        X = np.where(motions, follows, 0.0)
        F[0] = np.where(motions, slow * (self.M @ X), F[0])
        F[1], F[2] = F[1] - self.C @ X, F[2] - self.M @ X
        if static:
            rest = follows - V @ ((V.T @ self.F[0]) / (values + slow)[:, None])
            X = X + np.where(motions, 0.0, rest)
        D = [d + y @ X for d, y in zip(D, self.Y, strict=True)]
        skew = V.T @ (0.5 * (self.K - self.K.T) @ V)
        reduced = (np.eye(count), V.T @ (self.C @ V), np.diag(values) + skew)
        M, C, K = (sp.csr_array(A) for A in reduced)
        F, Y = [V.T @ f for f in F], [y @ V for y in self.Y]
        return replace(self, M=M, C=C, K=K, F=tuple(F), Y=tuple(Y), D=tuple(D))

    def descriptor(self) -> Descriptor:
        """The first-order form with sparse matrices, of coordinates and their rates.

        Inputs and outputs are those of `state_space`.
        """
        B, direct = self._forced()
        one, n = sp.eye_array(self.size, format="csr"), self.size
        E = sp.block_array([[one, None], [None, self.M]], format="csr")
        A = sp.block_array([[None, one], [-self.K, -self.C]], format="csr")
        if self.Y[2].any():
            raise SceneError(
                "linearise: forces of joints depend on accelerations where constraints are "
                "eliminated; use constraints='kept', state_space(), or other outputs"
            )
        forced = np.vstack([np.zeros((n, B.shape[1])), B])
        return Descriptor(E, A, forced, np.hstack(self.Y[:2]), direct)

    def state_space(self, modes: int | None = None) -> StateSpace:
        """The state space with coordinates and their rates as states, in dense matrices.

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
        if self.size > DENSE:
            raise SceneError(
                f"linearise: a dense state space of {self.size} coordinates is too large; give "
                f"modes, or use descriptor() (at most {DENSE})"
            )
        solve = spla.splu(self.M.tocsc()).solve
        force, direct = self._forced()
        stiff, damped, forces = (solve(a) for a in (self.K.toarray(), self.C.toarray(), force))
        n, (y0, y1, y2) = self.size, self.Y
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-stiff, -damped]])
        B = np.vstack([np.zeros_like(forces), forces])
        return StateSpace(
            A, B, np.hstack([y0 - y2 @ stiff, y1 - y2 @ damped]), direct + y2 @ forces
        )

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
        found[0] |= ~(found[1] | found[2])
        return found

    def _forced(self) -> tuple[Floats, Floats]:
        """Forces and direct outputs by the inputs of state spaces."""
        places = self._acting
        return tuple(  # type: ignore[return-value]
            np.hstack([a[:, own] for a, own in zip(of, places, strict=True)])
            for of in (self.F, self.D)
        )

    def poles(self, count: int = 6) -> Complex:
        """Eigenvalues ``s`` of motions ``exp(s t)``, the smallest ones, of pairs one [1/s].

        Args:
            count: How many.
        """
        n, shift = self.size, self.shift
        if n == 0:
            # everything is driven
            return np.zeros(0, dtype=np.complex128)
        M, C, K = (a.tocsc() for a in (self.M, self.C, self.K))
        factor = spla.splu((K + shift * C + shift**2 * M).tocsc())

        def inverse(b: Any) -> Any:
            """Of `A - shift E`, times `E`."""
            first, second = b[:n], M @ b[n:]
            x = factor.solve(-second - C @ first - shift * (M @ first))
            return np.concatenate([x, first + shift * x])

        if 2 * count + SPARE < 2 * n - 1:
            whole = spla.LinearOperator((2 * n, 2 * n), matvec=inverse, dtype=float)
            start = np.random.default_rng(0).standard_normal(2 * n)
            found, vectors = spla.eigs(whole, 2 * count + SPARE, v0=start)
        else:
            found, vectors = la.eig(inverse(np.eye(2 * n)))
        # those of constraints are infinite
        good = np.abs(found) > INFINITE * np.abs(found).max()
        values, vectors = shift + 1 / found[good], vectors[:n, good]
        upper = np.flatnonzero(values.imag >= 0)
        upper = upper[np.lexsort((values.imag[upper], np.abs(values[upper])))][:count]
        even = all(abs(A - A.T).max() <= EVEN * abs(A).max() for A in (C, K))
        return np.array([_quotient(values[k], vectors[:, k], (M, C, K), even) for k in upper])

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
            SceneError: If it has another ending.
        """
        where, matlab = _of_format(path)
        content = {f"{n}{k}": part for n in ORDERED for k, part in enumerate(getattr(self, n))}
        for name in MATRICES:
            A = getattr(self, name).tocoo()
            content[name] = A.tocsc() if matlab else np.array([A.row, A.col, A.data])
        words = ("\t".join(self.inputs), "\t".join(self.outputs), self.about)
        content |= {"carried": self.carried, "names": np.array("\n".join(words))}
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
            found: dict[str, Any] = {
                name: tuple(content[f"{name}{k}"] for k in range(3)) for name in ORDERED
            }
            size = len(found["F"][0])
            for name in MATRICES:
                A = content[name]
                entries = A if matlab else (A[2], A[:2].astype(int))
                found[name] = sp.csr_array(entries, shape=(size, size))
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


def _quotient(value: complex, v: Complex, matrices: Sequence[sp.csc_array], even: bool) -> complex:
    """The eigenvalue to the square of the error of its vectors, from the right and the left one."""
    left = v
    if not even:
        M, C, K = matrices
        try:
            inner = spla.splu(sp.csc_array(K + value * C + value**2 * M, dtype=np.complex128))
            left, v = inner.solve(v.astype(np.complex128), "T"), inner.solve(v.astype(complex))
        except RuntimeError:
            # it is an eigenvalue to the last digit
            return value
    roots = np.roots([left @ (A @ v) for A in matrices])
    return complex(min([*roots, np.inf], key=lambda root: abs(root - value)))


def _of_format(path: Path | str) -> tuple[Path, bool]:
    """A file, and whether it is MATLAB's."""
    where = Path(path)
    if where.suffix not in FORMATS:
        raise SceneError(
            f"linearise: file is {str(path)!r}; its name must end in {' or '.join(FORMATS)}"
        )
    return where, where.suffix == ".mat"


def _places(what: str, given: Sequence[str] | str | None, known: tuple[str, ...]) -> list[int]:
    """Places of names among those that are known."""
    if given is None:
        return list(range(len(known)))
    names = [given] if isinstance(given, str) else list(given)
    for name in names:
        if name not in known:
            raise SceneError(f"{what} is {name!r}; it must be one of {listed(known) or 'none'}")
    return [known.index(name) for name in names]


def lowest_modes(K: sp.csr_array, M: sp.csr_array, count: int) -> tuple[Floats, Floats]:
    """The lowest undamped modes, normalised to a mass of one.

    Args:
        K: Stiffness, of which the symmetric part counts.
        M: Mass.
        count: How many, fewer than coordinates.

    Returns:
        Squares of the angular frequencies, shape (count,) [rad^2/s^2], and the modes as
        columns, shape (n, count).

    Raises:
        SceneError: If there are not so many.
    """
    size = K.shape[0]
    if not 0 < count < size:
        raise SceneError(
            f"matrices: modes is {count}; it must be from 1 to {size - 1}, the number of "
            "coordinates less one"
        )
    scale = abs(K.diagonal()).max() / abs(M.diagonal()).max()
    shift = -1e-9 * float(scale)
    even = (0.5 * (K + K.T)).tocsc()
    values, vectors = spla.eigsh(even, count, M.tocsc(), sigma=shift)
    order = np.argsort(values)
    return values[order], vectors[:, order]
