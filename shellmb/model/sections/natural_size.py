"""Sizes of natural strains: what no length can have is refused, what is large is doubted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.barrier import first_found
from shellmb.errors import SceneError, warn
from shellmb.scene.lookup import said
from shellmb.scene.values.user_functions import given_at, on_trial, values_at

if TYPE_CHECKING:
    from shellmb.model.frames.beam import BeamModel
    from shellmb.model.shells.shell import ShellModel

# Green's strain of a length that vanishes, and of one that grows by 1.73; beyond 5 % sections
# whose stress is linear are doubtful, and most strains are slips of units
LEAST, MOST, LARGE = -0.5, 1.0, 0.05
RATIO = "a strain is a ratio (1 % is 0.01), so check the units"
# instants at which factors over time are taken
INSTANTS = np.linspace(0.0, 1.0, 65)


def doubt_natural(
    comm: MPI.Comm, t_end: float, bodies: Mapping[str, ShellModel | BeamModel]
) -> None:
    """Refuse natural strains below -0.5 or above 1, warn of those beyond 5 %; collective.

    Args:
        comm: Communicator.
        t_end: End of the run, s.
        bodies: Shells and beams by name.

    Raises:
        SceneError: Names the body and the strain.
    """
    for model in bodies.values():
        body = getattr(model, "shell", None) or model.beam  # type: ignore[union-attr]
        if body.natural is None:
            continue
        try:
            extremes, failed = list(_strains(model)), None
        except SceneError as error:
            extremes, failed = [], error
        failed = first_found(comm, failed)
        if failed is not None:
            raise failed
        found = np.concatenate([np.concatenate(each) for each in comm.allgather(extremes)])
        factors = _factors(body.natural.time, t_end, f"natural strain of {said(body)}: time")
        low, high = (f(np.outer(factors, found), initial=0.0) for f in (np.min, np.max))
        who = f"{said(body)}: its natural strain{_where(body)} reaches"
        if low < LEAST or high > MOST:
            wrong = low if low < LEAST else high
            raise SceneError(
                f"{who} {wrong:.4g}; it must be between {LEAST:g}, where no length is left, and "
                f"{MOST:g}: {RATIO}"
            )
        largest = max(low, high, key=abs)
        if abs(largest) > LARGE:
            advice = "smaller natural strains, or smaller load steps"
            model.parts = tuple(replace(p, advice=advice) for p in model.parts)
            if comm.rank == 0:
                warn(
                    f"{who} {largest:.4g}, more than {LARGE:g}: stresses that are linear in such "
                    f"strains are unreliable; {RATIO}"
                )


def _where(body: object) -> str:
    curved = np.any(body.natural.curvature) or callable(body.natural.curvature)  # type: ignore[attr-defined]
    return " at the faces" if curved else ""


def _strains(model: ShellModel | BeamModel) -> Iterator[Floats]:
    """Principal natural strains at both faces, for a factor of one.

    Args:
        model: A shell or a beam that has such.
    """
    body = getattr(model, "shell", None)
    if body is None:
        beam: Any = model.beam  # type: ignore[union-attr]
        twist, *bent = beam.natural.curvature
        half, axial = beam.section.size / 2, beam.natural.extension
        for side in (-1.0, 1.0):
            yield _principal(axial + side * half * np.hypot(*bent), 0.0, half * twist)
        return
    X, half = model.mixed.nodes("u").T, model.section.sizes.thickness / 2  # type: ignore[union-attr]
    parts = []
    for name in ("membrane", "curvature"):
        given, who = getattr(body.natural, name), f"natural strain of shell '{body.name}': {name}"
        parts.append(values_at(given, X, 3, who) if callable(given) else np.reshape(given, (3, 1)))
    for side in (-1.0, 1.0):
        yield _principal(*(parts[0] + side * half * parts[1]))


def _principal(a: Floats | float, b: Floats | float, c: Floats | float) -> Floats:
    """Both principal strains of 11, 22 and 2*12."""
    middle, radius = (np.add(a, b)) / 2, np.hypot(np.subtract(a, b), c) / 2
    return np.ravel([middle - radius, middle + radius])


def _factors(time: object, t_end: float, who: str) -> Floats:
    """Factors over time at many instants, those of corners among them."""
    if not callable(time):
        return np.ones(1)
    corners = [t for t in getattr(time, "corners", ()) if 0 <= t <= t_end]
    time = on_trial(time)
    return np.array([given_at(time, float(t), who, 1) for t in (*(t_end * INSTANTS), *corners)])
