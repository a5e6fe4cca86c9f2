"""Schemes that are objects, wherever a scheme's name may stand; they begin with accelerations.

The kind: a user's scheme, also one of few members that has no hash, in runs by name, studies,
errors and derivatives, stored and resumed.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import shellmb as sm
from shellmb.demos.own_forms import Newmark
from shellmb.demos.sudden_load import scene
from shellmb.errors import SceneError
from shellmb.schemes.base import Scheme


class Plain:
    """Newmark's rule with no more than what a scheme must have, and without a hash."""

    name, title, order, dynamic = "plain", "plain", 2, True
    stages, rates = ("f",), ("v", "a")
    conserves: ClassVar[frozenset[str]] = frozenset()
    __hash__ = None  # type: ignore[assignment]
    expand, advance, load_weight = Newmark.expand, Newmark.advance, Newmark.load_weight

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Plain)


class Derived(Plain, Scheme):
    """The same with the defaults of the class that describes schemes."""

    __hash__ = None  # type: ignore[assignment]


def tip(scheme: Any, dt: float, **more: Any) -> np.ndarray:
    run = sm.run("sudden_load", scheme=scheme, dt=dt, t_end=0.04, pictures=False, **more)
    return run.history["tip_z"].to_numpy()[:: round(4e-3 / dt)]


KINDS = ["newmark", "plain", "derived"]


@pytest.mark.parametrize("scheme", [Newmark(), Plain(), Derived()], ids=KINDS)
def test_it_runs_by_the_name_of_a_scene(scheme: Any) -> None:
    """The load is there at once, and so is the acceleration: it is as good as `ep`."""
    right = tip("ep4", 5e-4)
    error, usual = (np.linalg.norm(tip(s, 2e-3) - right) for s in (scheme, "ep"))
    assert error < 2 * usual


def test_studies_take_them_beside_names(tmp_path: Path) -> None:
    short = replace(scene(), t_end=0.012)
    schemes = ["ep", Newmark(), Plain()]
    table = sm.study(short, scheme=schemes, dt=[4e-3], out=tmp_path / "study").table
    assert set(table["scheme"]) == {"ep", "newmark", "plain"}
    assert set(sm.study(short, scheme=Newmark(), dt=[4e-3]).table["scheme"]) == {"newmark"}
    assert set(sm.study(short, scheme="ep", dt=[4e-3], reference=Plain()).table["scheme"]) == {"ep"}
    with pytest.raises(SceneError, match="two schemes are called 'ep'"):
        sm.study(short, scheme=["ep", replace(Newmark(), name="ep")], dt=[4e-3])


def test_stored_and_derived(tmp_path: Path) -> None:
    options: Any = {"scheme": Newmark(), "t_end": 0.01, "pictures": False}
    sm.run("sudden_load", tmp_path / "run", **options)
    # a directory has no words for it
    with pytest.raises(SceneError, match="scheme was Newmark, is ep"):
        sm.resume(tmp_path / "run", pictures=False)
    again = replace(scene(), scheme=Newmark(), t_end=0.01)
    assert sm.resume(tmp_path / "run", scene=again, pictures=False).summary["scheme"] == "newmark"
    assert sm.run("sudden_load", errors=True, **options).errors["error"].notna().all()
    del options["pictures"]
    slope = sm.sensitivities("sudden_load", ["force"], **options).results["force"][
        "peak_tip_deflection"
    ]
    # linear in the load so far: the deflection over the load factor
    peak = sm.run("sudden_load", pictures=False, **options).results["peak_tip_deflection"]
    assert slope == pytest.approx(peak / 2.0, rel=1e-3)
