"""Labels say the unit of what they stand at: each beside a number whose dimension is known.

The kind: a label with another quantity's unit, such as bending moments M in N/m. The units here are
written by hand, of length, mass and time, and not put together as `Units` does.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from shellmb.errors import SceneError
from shellmb.observers.files.described import describe
from shellmb.scene import (
    GROUND,
    Clamped,
    Cylindrical,
    InitialVelocity,
    Motor,
    Probe,
    RigidBody,
    Scene,
    Spring,
)
from shellmb.scene.fields import FIELDS
from shellmb.scene.probes import Probe as AnyProbe
from shellmb.scene.units import Units, parse_units
from shellmb.show import plots
from shellmb.show.campbell import campbell_figure
from shellmb.show.plots import joint_plots
from tests.scenes import plate_scene

SYSTEMS = {"m, kg, s": 0, "mm, t, s": 1, "in, snail, s": 2, "mm, kg, ms": 3}
# by what is meant, in each of these systems
NAMES: dict[str, tuple[str, str, str, str]] = {
    "length": ("m", "mm", "in", "mm"),
    "time": ("s", "s", "s", "ms"),
    "velocity": ("m/s", "mm/s", "in/s", "mm/ms"),
    "number": ("-", "-", "-", "-"),
    "curvature": ("1/m", "1/mm", "1/in", "1/mm"),
    "strain or curvature": ("-, 1/m", "-, 1/mm", "-, 1/in", "-, 1/mm"),
    "angle": ("rad", "rad", "rad", "rad"),
    "angular velocity": ("rad/s", "rad/s", "rad/s", "rad/ms"),
    "force": ("N", "N", "in snail/s²", "kN"),
    "moment": ("N m", "N mm", "in² snail/s²", "kN mm"),
    "energy": ("J", "mJ", "in² snail/s²", "J"),
    "stress": ("Pa", "MPa", "snail/(in s²)", "GPa"),
    # a moment per length is a force
    "force per length": ("N/m", "N/mm", "snail/s²", "kN/mm"),
    "moment per length": ("N", "N", "in snail/s²", "kN"),
    "energy per length": ("N", "N", "in snail/s²", "kN"),
    "energy per area": ("N/m", "N/mm", "snail/s²", "kN/mm"),
}
# SI value of one unit: of a derived one the product of those of length, mass and time
SIZES = {"m": 1.0, "mm": 1e-3, "N": 1.0, "kN": 1e3, "Pa": 1.0, "MPa": 1e6, "GPa": 1e9, "J": 1.0}
SIZES |= {"mJ": 1e-3, "t": 1e3, "kg": 1.0, "s": 1.0, "ms": 1e-3}
DIMENSIONS = {
    "force": (1, 1, -2),
    "moment": (2, 1, -2),
    "energy": (2, 1, -2),
    "stress": (-1, 1, -2),
}


def test_quantities_have_their_units() -> None:
    found = {
        (quantity, system): unit
        for system, place in SYSTEMS.items()
        for quantity, names in NAMES.items()
        if (unit := parse_units(system).of(quantity)) != names[place]
    }
    assert not found


@pytest.mark.parametrize("system", ["m, kg, s", "mm, t, s", "mm, kg, ms"])
@pytest.mark.parametrize("quantity", DIMENSIONS)
def test_a_name_of_its_own_is_that_of_the_product(quantity: str, system: str) -> None:
    """1 MPa is 1 t/(mm s^2), and so on: by their values in SI."""
    sizes = [SIZES[name] for name in system.split(", ")]
    product = np.prod([s**p for s, p in zip(sizes, DIMENSIONS[quantity], strict=True)])
    named = np.prod([SIZES[name] for name in parse_units(system).of(quantity).split()])
    assert named == pytest.approx(product, rel=1e-12)


def test_without_units_only_what_has_none_is_said() -> None:
    assert {Units().of(quantity) for quantity in NAMES} == {"", "-", "rad"}


# in SI: of fields, and of what probes record
FIELD_UNITS = {
    "displacement": "m",
    "director": "-",
    "velocity": "m/s",
    "director_velocity": "rad/s",
    "N": "N/m",
    "M": "N",
    "Q": "N/m",
    "principal_N": "N/m",
    # strains and curvatures are in one field
    "strains": "-, 1/m",
    "branch_strains": "-, 1/m",
    "natural_factor": "-",
    "energy_density": "N/m",
    "surface_stress": "Pa",
    "von_mises": "Pa",
    "principal_stress": "Pa",
    "principal_strain": "-",
    "ply_stress": "Pa",
    "interlaminar": "Pa",
    "utilisation": "-",
    "reserve": "-",
    "critical_ply": "-",
    "force": "N",
    "moment": "N m",
}
PROBE_UNITS = {
    "displacement": "m",
    "position": "m",
    "velocity": "m/s",
    "director": "-",
    "rotation": "rad",
    "angular_velocity": "rad/s",
    "force": "N",
    "moment": "N m",
    "membrane": "N/m",
    "bending": "N",
    "shear": "N/m",
}


def test_fields_and_probes_have_the_units_of_what_they_are() -> None:
    units = parse_units("m, kg, s")
    assert {name: units.of(kind.quantity) for name, kind in FIELDS.items()} == FIELD_UNITS
    known = {name: units.of(quantity) for name, quantity in plots.QUANTITIES.items()}
    assert known == PROBE_UNITS


@pytest.mark.parametrize(
    ("component", "unit"),
    [("eps 11", "-"), ("2 kap 12", "1/m"), ("gam 13", "-"), ("shear 2", "-"), ("twist", "1/m")],
)
def test_strains_and_curvatures_have_units_of_their_own(component: str, unit: str) -> None:
    assert parse_units("m, kg, s").of(FIELDS["strains"].quantity_of(component)) == unit


@pytest.mark.parametrize("moves", [False, True])
def test_axes_of_probes(moves: bool) -> None:
    """Each axis has the unit of its curves; in motion resultants are means over steps."""
    kinds = [k for k in PROBE_UNITS if k not in ("force", "moment", "rotation", "angular_velocity")]
    probes = [Probe(k, (1.0, 0.5, 0.0), k, 0) for k in kinds]
    times = {"scheme": "ep", "dt": 1.0, "t_end": 1.0} if moves else {"scheme": "static"}
    scene = describe(
        plate_scene(mesh=(1, 1), supports=Clamped("left"), units="m, kg, s", probes=probes, **times)
    )
    history = pd.DataFrame(
        {"t": [0.0, 1.0], "load_factor": [0.0, 1.0], **{k: [0.0, 1.0] for k in kinds}}
    )
    labels = [axes.get_ylabel() for axes in plots.probes(history, scene).axes]
    mean = {"membrane", "bending", "shear"} if moves else set()
    assert labels == [f"{'mean ' if k in mean else ''}{k} [{PROBE_UNITS[k]}]" for k in kinds]
    below = plots.probes(history, scene).axes[-1].get_xlabel()
    assert below == ("time [s]" if moves else "load parameter [-]")
    path = plots.path(history, scene, [])
    assert [axes.get_xlabel() for axes in path.axes] == [f"{k} [{PROBE_UNITS[k]}]" for k in kinds]
    assert isinstance(probes[0], AnyProbe)


def test_axes_of_energies_steps_and_joints() -> None:
    bodies = [RigidBody(n, 1.0, (1.0, 1.0, 1.0)) for n in "ab"]
    scene = describe(
        Scene(
            "joint",
            rigid_bodies=bodies,
            joints=Cylindrical("rail", GROUND, "a", at=(0, 0, 0), axis=(1, 0, 0)),
            force_elements=[
                Motor("turns", "rail", lambda x, v, t: 1.0 + 0 * x, coordinate="rotation"),
                Spring("pulls", "a", "b", (0, 0, 0), (0, 0, 0), stiffness=1.0, length=1.0),
            ],
            initial=InitialVelocity(spin=(1.0, 0, 0), body="a"),
            units="mm, t, s",
            scheme="ep",
            dt=1.0,
            t_end=1.0,
        )
    )
    names = ["kinetic_energy", "total_energy", "energy_balance", "dt", "iterations"]
    names += [f"rail.{n}" for n in ("rotation", "translation", "F1", "F2", "F3", "M1", "M2", "M3")]
    names += ["turns.torque", "pulls.force", "pulls.length"]
    history = pd.DataFrame({"t": [0.0, 1.0, 2.0]} | {n: [1.0, 2.0, 3.0] for n in names})
    plotted = [(*p.curves, p.label) for p in joint_plots(history, scene, 1.0)]
    found = {name: label for name, label in plotted if name != "rail"}
    assert found == {
        "rail.rotation": "rotation [rad]",
        "rail.translation": "translation [mm]",
        "pulls.length": "length [mm]",
        "turns.torque": "torque [N mm]",
        "pulls.force": "force [N]",
    }
    carried = [p.label for p in joint_plots(history, scene, 1.0) if list(p.curves) == ["rail"]]
    assert carried == ["|mean force in joint| [N]", "|mean moment in joint| [N mm]"]
    above, below = plots.energies(history, scene).axes
    assert above.get_ylabel() == "energy, work [mJ]"
    assert below.get_ylabel().endswith("/ largest energy [-]")
    assert [a.get_ylabel() for a in plots.steps(history, scene).axes] == [
        "Newton iterations",
        "step [s]",
    ]


# a branch that grows with the rate, one that falls, and what is unstable [rad/s, Hz, -]
BRANCHES = {1: [4.0, 5.0, 7.0], 2: [9.0, 8.0, 6.5]}
RATES, RATIOS = [0.0, 10.0, 20.0], {1: [0.1, 0.05, 0.02], 2: [0.01, 0.0, -0.03]}


@pytest.mark.parametrize("damped", [True, False])
def test_a_campbell_diagram_has_its_data(damped: bool, tmp_path: Path) -> None:
    """Curves are the branches of the table, `kP` is k times a turn, crosses are what grows."""
    table = tmp_path / "campbell.csv"
    rows = [
        (rate, branch, f[k], RATIOS[branch][k] if damped else 0.0, int(RATIOS[branch][k] >= 0))
        for k, rate in enumerate(RATES)
        for branch, f in BRANCHES.items()
    ]
    lines = ["rate_rad_per_s,branch,frequency_hz,damping_ratio,stable"]
    table.write_text("\n".join([*lines, *(",".join(map(str, row)) for row in rows)]) + "\n")
    made = campbell_figure(table)
    assert len(made.axes) == (2 if damped else 1)
    above, below = made.axes[0], made.axes[-1]
    assert above.get_ylabel() == "frequency in the frame [Hz]"
    assert below.get_xlabel() == "rate of rotation [rad/s]"
    for axes, known in zip(made.axes, (BRANCHES, RATIOS), strict=False):
        curves = [line for line in axes.lines if line.get_linestyle() == "-"]
        for line, values in zip(curves, known.values(), strict=True):
            assert np.array_equal(line.get_xydata(), np.column_stack([RATES, values]))
        (crosses,) = [line for line in axes.lines if line.get_marker() == "x"]
        assert np.array_equal(crosses.get_xydata(), [[20.0, known[2][2]]])
    if damped:
        assert below.get_ylabel() == "damping ratio"
    orders = [line for line in above.lines if line.get_linestyle() == ":"]
    for k, line in enumerate(orders, start=1):
        (x0, y0), (x1, y1) = line.get_xydata()
        assert x0 == y0 == 0.0
        assert y1 / x1 == pytest.approx(k / (2 * np.pi), rel=1e-12)
    assert [t.get_text() for t in above.texts] == [f"{k}P" for k in range(1, len(orders) + 1)]
    # where a label stands its line is
    for k, text in enumerate(above.texts, start=1):
        x, y = text.xy
        assert y == pytest.approx(k * x / (2 * np.pi)) and x <= 20.0
    assert above.get_ylim() == pytest.approx((0.0, 1.05 * 9.0))


def test_bands_reach_by_an_error_to_both_sides() -> None:
    """Beside numbers that are given: what a curve is said to be known to."""
    table = pd.DataFrame({"t": [0.0, 1.0], "y": [3.0, 3.0]})
    scene = describe(plate_scene("ep", dt=1e-2, t_end=1e-2))
    (axes,) = plots.plot_history(table, scene, "y", errors={"y": 0.25}).axes
    (band,) = axes.collections
    (path,) = band.get_paths()
    assert path.vertices[:, 1].min() == 2.75 and path.vertices[:, 1].max() == 3.25
    assert band.get_label() == "y: error (rms)"


@pytest.mark.parametrize(
    ("units", "said"),
    [
        ("kg, m, s", "'kg' is a unit of mass, in the place of length"),
        ("m, s, kg", "'s' is a unit of time, in the place of mass"),
        ("mm, t", "must be the units of length, mass and time with commas"),
    ],
)
def test_units_come_in_their_order(units: str, said: str) -> None:
    """Axes of lengths were labelled [kg], without a word."""
    with pytest.raises(SceneError, match=said):
        plate_scene(mesh=(1, 1), supports=Clamped("left"), scheme="static", units=units)


def test_units_of_no_system_have_any_names() -> None:
    assert parse_units("L, M, T").of("velocity") == "L/T"
