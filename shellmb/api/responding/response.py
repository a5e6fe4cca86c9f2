"""Responses of linear systems: harmonic, random, and the largest ones to spectra of shocks."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from shellmb.api.responding.curves import at_frequencies, curve_of
from shellmb.api.responding.system import GROUND, LinearSystem
from shellmb.arrays import Complex, Floats
from shellmb.errors import SceneError, warn
from shellmb.options.described import checks
from shellmb.options.linear import ResponseOptions

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
# inputs that move supports
SUPPORT = re.compile(r"support\d+\.")
# densities are integrated over steps in which responses change by less than this share (sizes) and
# angle (phases), or which have less than a share of the mean square; frequencies at first, and at
# most so many more
CHANGE, SHARE, FEW, MOST = 0.08, 1e-6, 150, 20000
# a frequency in place of zero, Hz
STILL = 1e-6
# modes beyond so many times the largest frequency follow as in statics
BESIDE = 2.0


@checks
@dataclass(frozen=True)
class Response:
    """Response of a linear system at frequencies.

    Args:
        frequencies: Frequencies, shape (n,), Hz.
        inputs: Names of the inputs.
        outputs: Names of the outputs.
        frf: Frequency responses, outputs by inputs, complex, shape (outputs, inputs, n).
        psd: One-sided densities of the outputs, shape (outputs, n) [unit^2/Hz]; None: none.
        rms: Root mean squares in the range of the frequencies, shape (outputs,).
        largest: Largest outputs by spectra of shocks, shape (outputs,).
        about: What the state is.
        errors: Errors of `numbers` by the mesh, by their names, where they are asked for.
    """

    frequencies: Floats
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    frf: Complex
    psd: Floats | None = None
    rms: Floats | None = None
    largest: Floats | None = None
    about: str = ""
    errors: Mapping[str, float] = MappingProxyType({})

    @property
    def numbers(self) -> dict[str, float]:
        """Peaks of frequency responses, root mean squares and largest outputs by name."""
        found = {f"peak {k}": float(np.nanmax(np.abs(v))) for k, v in self._pairs.items()}
        for what, own in (("rms", self.rms), ("largest", self.largest)):
            if own is not None:
                found |= {f"{what} {o}": float(v) for o, v in zip(self.outputs, own, strict=True)}
        return found

    @property
    def table(self) -> pd.DataFrame:
        """Complex responses "OUTPUT / INPUT", and densities "psd OUTPUT", by frequency [Hz]."""
        return self._indexed(self._pairs)

    @property
    def _pairs(self) -> dict[str, Complex]:
        pairs = [f"{output} / {name}" for output in self.outputs for name in self.inputs]
        return dict(zip(pairs, self.frf.reshape(len(pairs), -1), strict=True))

    def _indexed(self, columns: Mapping[str, Any]) -> pd.DataFrame:
        import pandas as pd

        psd = () if self.psd is None else self.psd
        densities = {f"psd {o}": v for o, v in zip(self.outputs, psd, strict=False)}
        index = pd.Index(self.frequencies, name="frequency_hz")
        return pd.DataFrame({**columns, **densities}, index=index)

    def plot(self) -> Figure:
        """Bode plot of all responses, with densities below where there are some."""
        import matplotlib as mpl

        from shellmb.observers.drawing import STYLE, figure

        f, labels = self.frequencies, ["amplitude\n[output/input]", "phase [deg]"]
        labels += [] if self.psd is None else ["density\n[output²/Hz]"]
        with mpl.rc_context(STYLE):
            made = figure(7.0, 2.2 * len(labels))
            plots = made.subplots(len(labels), 1, sharex=True)
            for name, frf in self._pairs.items():
                if frf.any():
                    plots[0].semilogy(f, np.abs(frf), label=name)
                    plots[1].plot(f, _broken(np.degrees(np.angle(frf))))
            plots[1].set(ylim=(-190, 190), yticks=range(-180, 181, 90))
            if self.psd is not None:
                plots[2].semilogy(f, self.psd.T, label=self.outputs)
            for axes, name in zip(plots, labels, strict=True):
                axes.set_ylabel(name)
                if axes.get_legend_handles_labels()[1]:
                    axes.legend()
            plots[-1].set_xlabel("frequency [Hz]")
        return made

    def save(self, directory: Path | str, pictures: bool = True) -> Path:
        """Write `response.csv`, `summary.json`, and `bode.png`, to a new or empty directory.

        Args:
            directory: The directory.
            pictures: Whether the plot is drawn.
        """
        from mpi4py import MPI

        from shellmb.observers.drawing import drawn
        from shellmb.observers.summary import versions, write_json
        from shellmb.running.directory import claimed, written

        where = Path(directory)
        with claimed(where, MPI.COMM_SELF, new=True), written(where, MPI.COMM_SELF):
            parts = (("Re", np.real), ("Im", np.imag))
            columns = {f"{p} {k}": of(v) for k, v in self._pairs.items() for p, of in parts}
            self._indexed(columns).to_csv(where / "response.csv")
            content = {"about": self.about, "results": self.numbers, "errors": dict(self.errors)}
            write_json(where / "summary.json", content | {"versions": versions()})
            if pictures:
                drawn(self.plot, where / "bode.png")
        return where


def find(system: LinearSystem, chosen: ResponseOptions) -> Response:
    """Response of a system.

    Args:
        system: The system.
        chosen: What is wanted.

    Raises:
        SceneError: If there are no such inputs, outputs or modes.
    """
    densities, spectra = chosen.psd or {}, chosen.spectrum or {}
    names = chosen.inputs
    if names is None:
        acting = [n for n in system.inputs if n not in GROUND and not SUPPORT.match(n)]
        names = list(dict.fromkeys([*densities, *spectra])) or acting
    names = [names] if isinstance(names, str) else names
    if not names:
        raise SceneError(
            f"response: {system.about.split(' about ')[0]} has no load and no motor; give inputs, "
            f"of {', '.join(system.inputs)}"
        )
    for name in densities:
        if name not in names:
            raise SceneError(f"response: psd is given for {name!r}, which is none of the inputs")
    every = system.select(list(dict.fromkeys([*names, *spectra])), chosen.outputs)
    if not every.outputs:
        raise SceneError("response: the scene has no probes and no joints; add probes")
    order, f = ORDERS[chosen.quantity], np.asarray(chosen.frequencies, dtype=float)
    if chosen.modes is not None:
        # estimates by spectra have all modes
        within = math.inf if spectra else BESIDE * float(f.max())
        every = damped(every.modal(chosen.modes, True, within), chosen.damping)
    part = every.select(names)
    if chosen.absolute:
        part = part.absolute()

    def at(f: Floats) -> Complex:
        if not chosen.absolute:
            return response_at(part, f, order)
        # ground that accelerates evenly moves without end
        near = np.where(f > 0, f, STILL)
        base = np.array([name in GROUND for name in part.inputs])
        return response_at(part, near, order) / np.where(base[:, None], (2j * np.pi * near) ** 2, 1)

    frf = at(f)
    found = Response(f, part.inputs, part.outputs, frf, about=system.about)
    if densities:
        rms = _root_mean_squares(at, f, part, densities, chosen.modes is not None)
        found = replace(found, psd=_densities(frf, f, part.inputs, densities), rms=rms)
    if spectra:
        found = replace(found, largest=_largest(every, chosen))
    return found


def response_at(system: LinearSystem, f: Floats, order: int = 0) -> Complex:
    """Frequency responses, outputs by inputs, shape (outputs, inputs, frequencies).

    Args:
        system: The system.
        f: Frequencies, Hz.
        order: Number of derivatives of the outputs.
    """
    found = np.empty((len(system.outputs), len(system.inputs), len(f)), dtype=np.complex128)
    of: list[Any] = [A.tocsc() for A in (system.K, system.C, system.M, *system.branches)]
    diagonal = all(A.nnz == np.count_nonzero(A.diagonal()) for A in of)
    if diagonal:
        of = [A.diagonal()[:, None] for A in of]
    for n, frequency in enumerate(f):
        s = 2j * np.pi * frequency
        powers = system.powers(s)
        force, row, direct, inner = (
            sum(power * part for power, part in zip(powers, parts, strict=True))
            for parts in (system.F, system.Y, system.D, of)
        )
        try:
            if diagonal:
                with np.errstate(divide="raise", invalid="raise"):
                    x = force / inner
            else:
                factor = spla.splu(sp.csc_array(inner, dtype=np.complex128))
                x = factor.solve(np.asarray(force, dtype=np.complex128))
        except (RuntimeError, FloatingPointError):
            raise SceneError(
                f"response: at {frequency:g} Hz nothing resists the motion; hold or damp the "
                "scene, or leave this frequency out"
            ) from None
        found[..., n] = s**order * (row @ x + direct)
    return found


def damped(system: LinearSystem, ratios: Sequence[float] | float | None) -> LinearSystem:
    """A system of modes with given damping ratios, in place of its own.

    Args:
        system: The system, as `modal` gives it.
        ratios: One, or one for each mode; None: its own.
    """
    if ratios is None:
        return system
    if system.times:
        raise SceneError("response: damping is given, and what relaxes has its own; leave it out")
    omega = np.sqrt(np.maximum(system.K.diagonal(), 0.0))
    return replace(system, C=sp.csr_array(np.diag(2 * omega * np.asarray(ratios, dtype=float))))


def _densities(frf: Complex, f: Floats, names: Sequence[str], given: Mapping[str, Any]) -> Floats:
    """Densities of outputs, whose inputs do not depend on one another, shape (outputs, n)."""
    of = [at_frequencies(given[n], f, f"psd of '{n}'") if n in given else 0 * f for n in names]
    return np.asarray(np.einsum("oif,if->of", np.abs(frf) ** 2, np.array(of)))


def _root_mean_squares(
    at: Callable[[Floats], Complex],
    f: Floats,
    system: LinearSystem,
    given: Mapping[str, Any],
    modal: bool,
) -> Floats:
    """Root mean squares of the outputs between the first and the last frequency.

    Frequencies are added until all resonances between those given are resolved.

    Args:
        at: Responses at frequencies.
        f: Frequencies, Hz.
        system: The system.
        given: Densities by input.
        modal: Whether the system is one of modes.
    """
    curves = [curve_of(c, name)[0] for name, c in given.items() if np.iterable(c)]
    # both sides of where curves begin and end; few could miss what lies between them
    ends = (np.nextafter(c[[0, -1]], [-np.inf, np.inf]) for c in curves)
    every = [f, np.linspace(f[0], f[-1], FEW), *curves, *ends]
    if modal:
        omega, ratio = oscillators(system)
        every.append(omega[ratio > 0] / (2 * np.pi))
    known = np.unique(np.concatenate(every))
    f = known[(known >= f[0]) & (known <= f[-1])]
    frf, most = at(f), len(f) + MOST
    while True:
        psd = _densities(frf, f, system.inputs, given)
        total, width = np.asarray(np.trapezoid(psd, f, axis=1)), np.diff(f)
        # of complex numbers and of densities, both as of logarithms
        change = np.abs(np.diff(np.log(psd + np.finfo(float).tiny), axis=1)) / 2
        turn = np.abs(np.angle(frf[..., 1:] * np.conj(frf[..., :-1]))).max(axis=1)
        small = np.maximum(psd[:, 1:], psd[:, :-1]) * width <= SHARE * total[:, None]
        coarse = (np.maximum(change, turn) > CHANGE) & ~small
        split = coarse.any(axis=0)
        if not split.any():
            return np.sqrt(total)
        endless = split & (width < 1e-9 * f[1:])
        if endless.any() or len(f) > most:
            where = f[1:][endless if endless.any() else split][0]
            said = f"near {where:.4g} Hz a resonance has next to no damping; damp the scene"
            warn(f"response: rms is unreliable: {said}, or give modes and damping")
            return np.sqrt(np.where(coarse[:, endless].any(axis=1), np.inf, total))
        middle = (f[:-1] + f[1:])[split] / 2
        order = np.argsort(f := np.concatenate([f, middle]))
        f, frf = f[order], np.concatenate([frf, at(middle)], axis=2)[..., order]


def _largest(system: LinearSystem, chosen: ResponseOptions) -> Floats:
    """Largest outputs by spectra: of modes combined, of axes as squares add up."""
    omega, ratio = oscillators(system)
    modes = slice(len(omega))
    spectra, total = chosen.spectrum or {}, 0.0
    for name, curve in spectra.items():
        part = system.select(name)
        # all modes move relative to ground by what it accelerates
        size = at_frequencies(curve, omega / (2 * np.pi), f"spectrum of '{name}'")
        moved = size * part.F[0][modes, 0] / np.maximum(omega**2, 1e-300)
        each = part.Y[0][:, modes] * moved * omega ** ORDERS[chosen.quantity]
        total = total + np.einsum("om,mn,on->o", each, _alike(omega, ratio), each)
    return np.sqrt(np.asarray(total))


def oscillators(system: LinearSystem) -> tuple[Floats, Floats]:
    """Angular frequencies and damping ratios of modes, each by itself.

    Args:
        system: The system, as `modal` gives it.
    """
    modes = system.M.diagonal() > 0
    k, c, *own = (A.diagonal()[modes] for A in (system.K, system.C, *system.branches))
    omega = np.sqrt(np.maximum(k, 0.0))
    ratio = c / np.maximum(2 * omega, 1e-300)
    if not own:
        return omega, ratio
    from shellmb.running.rotating.quadratic import poles_of_one

    for n in range(len(k)):
        branches = dict(zip(system.times, (b[n] for b in own), strict=True))
        # what only creeps follows without ringing
        s = next(iter(poles_of_one((1.0, c[n], k[n]), branches)), -omega[n] - 0j)
        omega[n], ratio[n] = abs(s), -s.real / max(abs(s), 1e-300)
    return omega, ratio


def _alike(omega: Floats, ratio: Floats) -> Floats:
    """Correlation of modes (Der Kiureghian 1981), shape (modes, modes)."""
    a, b = ratio[:, None], ratio[None]
    r = omega[None] / np.maximum(omega[:, None], 1e-300)
    above = 8 * np.sqrt(a * b) * (a + r * b) * r**1.5
    below = (1 - r**2) ** 2 + 4 * a * b * r * (1 + r**2) + 4 * (a**2 + b**2) * r**2
    found = np.divide(above, below, out=np.zeros_like(below), where=below > 0)
    np.fill_diagonal(found, 1.0)
    return np.asarray(found)


def _broken(phase: Floats) -> Floats:
    """A phase without a line where it begins again at the other end."""
    jumps = np.abs(np.diff(phase, prepend=phase[0])) > 180
    return np.where(jumps, np.nan, phase)
