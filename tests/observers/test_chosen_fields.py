"""Fields that a scene asks for: in the files as computed, and what equilibrium says of them."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import shellmb as sm
from shellmb.observers.fields import by_section as section
from shellmb.running.execute import execute
from shellmb.show.fields import Fields

LENGTH, WIDTH, THICKNESS, YOUNG, FORCE = 1.0, 0.08, 2e-3, 210e9, 1.0


def strip(fields, **changes):
    """A strip of two-dimensional bending, for nu = 0."""
    steel = sm.Isotropic(E=YOUNG, nu=0.0, thickness=THICKNESS)
    scene = sm.Scene(
        "strip",
        sm.Shell("plate", sm.Rectangle(LENGTH, WIDTH), steel, mesh=(6, 2)),
        supports=sm.Clamped("left"),
        loads=sm.EdgeForce("right", (0, 0, FORCE / WIDTH)),
        probes=sm.Probe("tip", "right-top"),
        scheme="linear-statics",
        units="m, kg, s",
    )
    return replace(scene, output=sm.Output(fields=fields), **changes)


def last(folder: Path, body: str):
    described = sm.load(folder).described
    return Fields(folder / "fields", described.bodies, described.labels)[body].isel(t=-1)


def test_resultants_in_files_are_in_equilibrium(tmp_path) -> None:
    execute(strip("all"), tmp_path / "run", pictures=False)
    assert blocks_of_paraview(tmp_path / "run" / "fields") == {"plate": 2}
    plate = last(tmp_path / "run", "plate")
    x, y = plate["reference"].values[:, 0], plate["reference"].values[:, 1]
    # M11 is linear within elements and means of equal values between them; 2e-3 of the largest
    # that an element adds: by its share of shear its displacements resist some of it
    M = plate["M"].sel(plane="11").values
    np.testing.assert_allclose(np.abs(M), FORCE / WIDTH * (LENGTH - x), atol=2e-3 * FORCE / WIDTH)
    # round-off of a stiffness 1e6 times as large as the forces
    np.testing.assert_allclose(plate["Q"].sel(across="13"), FORCE / WIDTH, rtol=1e-8)
    assert plate["N"].attrs["units"] == "N/m" and plate["M"].attrs["units"] == "N"
    # W/t = 6 M/t^2 at both faces, of opposite signs, and strains by Hooke's law
    stress = plate["surface_stress"]
    for face in ("lower", "upper"):
        sign = -1 if face == "lower" else 1
        found = stress.sel(face=f"{face} 11")
        np.testing.assert_allclose(found, sign * 6 * M / THICKNESS**2, rtol=1e-9, atol=1e-3)
    kappa = plate["strains"].sel(strain="kap 11")
    np.testing.assert_allclose(kappa, 12 * M / (YOUNG * THICKNESS**3), rtol=1e-9, atol=1e-12)
    # Simpson's rule over the strip, whose energy density is quadratic in x: F^2 L^3/6EI of a beam
    middle = np.isclose(y, WIDTH / 2)
    order = np.argsort(x[middle])
    density = plate["energy_density"].values[middle][order]
    weights = np.tile([2.0, 4.0], len(density) // 2 + 1)[: len(density)]
    weights[[0, -1]] = 1.0
    energy = WIDTH * LENGTH / (len(density) - 1) / 3 * float(weights @ density)
    bending = YOUNG * WIDTH * THICKNESS**3 / 12
    assert energy == pytest.approx(FORCE**2 * LENGTH**3 / (6 * bending), rel=1e-3)


def test_faces_have_principal_and_von_mises_stresses(tmp_path) -> None:
    """A plate that is pulled and sheared: Mohr's circle, and Hooke's law for the strains."""
    pulled = sm.EdgeForce("right", (3e4, 2e4, 0.0))
    asked = ("surface_stress", "von_mises", "principal_stress", "principal_strain")
    scene = strip(asked, loads=(pulled, sm.EdgeForce("right", (0, 0, FORCE / WIDTH))))
    execute(scene, tmp_path / "run", pictures=False)
    plate = last(tmp_path / "run", "plate")
    for face in ("lower", "upper"):
        a, b, c = (
            plate["surface_stress"].sel(face=f"{face} {k}").values for k in ("11", "22", "12")
        )
        tensors = np.moveaxis(np.array([[a, c], [c, b]]), -1, 0)
        second, first = np.linalg.eigvalsh(tensors).T
        size = np.max(np.abs(first))
        for which, exact in (("first", first), ("second", second)):
            found = plate["principal_stress"].sel(extreme=f"{face} {which}")
            np.testing.assert_allclose(found, exact, atol=1e-10 * size)
            # without lateral contraction
            strain = plate["principal_strain"].sel(extreme=f"{face} {which}")
            np.testing.assert_allclose(strain, exact / YOUNG, atol=1e-10 * size / YOUNG)
        mises = np.sqrt(first**2 + second**2 - first * second)
        np.testing.assert_allclose(plate["von_mises"].sel(surface=face), mises, atol=1e-10 * size)


def bending_and_shear(strains, p):
    """Energy per area of the strip above, written out."""
    C = p["E"] * p["h"]
    eps, kap, gam = strains.eps, strains.kap, strains.gam
    membrane = eps[0] ** 2 + eps[1] ** 2 + eps[2] ** 2 / 2
    bending = kap[0] ** 2 + kap[1] ** 2 + kap[2] ** 2 / 2
    return C / 2 * (membrane + p["h"] ** 2 / 12 * bending + 5 / 12 * (gam[0] ** 2 + gam[1] ** 2))


def test_a_nonlinear_section_has_strains_and_energy_of_its_own(tmp_path) -> None:
    rubber = sm.Hyperelastic(
        bending_and_shear,
        {"E": YOUNG, "h": THICKNESS},
        thickness=THICKNESS,
        density=0.0,
        stiffness=YOUNG * THICKNESS,
    )
    asked = ("M", "strains", "energy_density")
    # small, as strains are those of large displacements
    tiny = sm.EdgeForce("right", (0, 0, 1e-4 * FORCE / WIDTH))
    scene = strip(asked, loads=tiny)
    scene = replace(scene, shells=replace(scene.shells[0], section=rubber))
    execute(scene, tmp_path / "run", pictures=False)
    plate = last(tmp_path / "run", "plate")
    M, kappa = plate["M"].sel(plane="11"), plate["strains"].sel(strain="kap 11")
    # where it is zero, the round-off of the largest one
    most = 1e-12 * float(np.abs(M).max())
    np.testing.assert_allclose(M, YOUNG * THICKNESS**3 / 12 * kappa, rtol=1e-9, atol=most)
    energy = plate["energy_density"].values
    # 1 %: of shear strains of the displacement, which differ from those of the shear forces
    np.testing.assert_allclose(energy, M * kappa / 2, atol=0.01 * energy.max())


def test_what_is_not_asked_for_is_not_there(tmp_path) -> None:
    execute(strip("displacement"), tmp_path / "few", pictures=False)
    few = last(tmp_path / "few", "plate")
    assert set(few.data_vars) == {"position", "displacement", "thickness"}
    execute(strip(("director", "Q")), tmp_path / "some", pictures=False)
    some = last(tmp_path / "some", "plate")
    assert set(some.data_vars) == {"position", "displacement", "director", "Q", "thickness"}


def test_all_bodies_are_opened_at_once(tmp_path) -> None:
    import pyvista

    execute(pendulum(), tmp_path / "run", pictures=False)
    reader = pyvista.PVDReader(str(tmp_path / "run" / "fields" / "all.pvd"))
    assert reader.time_values == pytest.approx([0.0, 2e-3, 4e-3])
    reader.set_active_time_value(reader.time_values[-1])
    blocks = reader.read()
    assert [block.n_points for block in blocks] == [2, 2]
    assert all(block.active_scalars_name == "displacement" for block in blocks)
    assert list(blocks[0].point_data["name"]) == ["arm", "arm"]
    assert list(blocks[1].point_data["name"]) == ["pin", "pin"]
    assert blocks_of_paraview(tmp_path / "run" / "fields") == {"rigid bodies": 3, "joints": 3}


def blocks_of_paraview(folder):
    """Blocks of `all.pvd` by the names that ParaView gives them, with the number of their states.

    Its reader (`vtkXMLCollectionReader::ReadXMLDataImpl`) takes the attribute `name` of each
    `DataSet`, one block for each `part`; pyvista's ignores it.
    """
    import vtk

    found, parts = {}, {}
    for item in ET.parse(folder / "all.pvd").getroot().iter("DataSet"):
        reader = vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(folder / item.get("file")))
        reader.Update()
        assert reader.GetOutput().GetNumberOfCells() > 0
        found.setdefault(item.get("name"), set()).add(float(item.get("timestep")))
        assert parts.setdefault(item.get("part"), item.get("name")) == item.get("name")
    assert len(parts) == len(found)
    return {name: len(times) for name, times in found.items()}


def pendulum():
    """A body that hangs at rest."""
    arm = sm.RigidBody("arm", 2.0, (0.01, 0.2, 0.2), com=(0, 0, -0.5))
    return sm.Scene(
        "pendulum",
        rigid_bodies=arm,
        joints=sm.Revolute("pin", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0)),
        loads=sm.Gravity((0, 0, -9.81)),
        scheme="ep",
        dt=1e-3,
        t_end=4e-3,
        output=sm.Output(frames=3, fields=("displacement", "force", "moment")),
    )


def test_forces_of_joints_are_vectors_at_both_ends(tmp_path) -> None:
    execute(pendulum(), tmp_path / "run", pictures=False)
    joints = last(tmp_path / "run", "joints")
    weight = 2.0 * 9.81
    # on the ground and on the arm; 1e-9: Newton's tolerance
    expected = [[0, 0, -weight], [0, 0, weight]]
    np.testing.assert_allclose(joints["force"], expected, atol=1e-9 * weight)
    np.testing.assert_allclose(joints["moment"], 0, atol=1e-9 * weight)
    assert joints["name"].values.tolist() == ["pin", "pin"]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ("n", "fields is 'n'; 'n' is no field; there are 'displacement', 'director'"),
        (3, "fields is 3; it must be names of fields"),
        ("ply_stress", "fields has 'ply_stress'; it must be left out, as there is no shell with"),
        (("N", "force"), "fields has 'force'; it must be left out, as there is no beam"),
    ],
)
def test_bad_names(fields, message) -> None:
    with pytest.raises(sm.SceneError, match=message):
        strip(fields)


CARBON = sm.PlyMaterial(E1=140e9, E2=9e9, nu12=0.3, G12=5e9, G13=5e9, G23=3e9)


def laminate(**changes):
    plies = [sm.Ply(CARBON, t, angle) for t, angle in ((1e-3, 0), (2e-3, 30), (5e-4, -60))]
    made = sm.Laminate(tuple(plies), offset=3e-4)
    return sm.Shell("wing", sm.Rectangle(1, 1), made, **changes)


def test_stresses_of_plies_add_up_to_the_resultants() -> None:
    """Through the thickness: stresses are linear in a ply, so Gauss' two points are exact."""
    shell, R = laminate(), np.random.default_rng(0).normal(size=(4, 8))
    at = shell.section.generic
    N, M = np.zeros((4, 3)), np.zeros((4, 3))
    z = -sum(ply.thickness for ply in shell.section.plies) / 2 + shell.section.offset
    for number, ply in enumerate(shell.section.plies):
        along = section.ply_stress(shell, at, number)(R)
        c, s = np.cos(np.radians(ply.angle)), np.sin(np.radians(ply.angle))
        # from the fibres' axes to those of the shell: the turn back
        back = np.array(
            [[c * c, s * s, -2 * c * s], [s * s, c * c, 2 * c * s], [c * s, -c * s, c * c - s * s]]
        )
        lower, upper = along[:, :3] @ back.T, along[:, 3:] @ back.T
        for share in (1 / 2 - 1 / np.sqrt(12), 1 / 2 + 1 / np.sqrt(12)):
            stress = (1 - share) * lower + share * upper
            N += ply.thickness / 2 * stress
            M += ply.thickness / 2 * (z + share * ply.thickness) * stress
        z += ply.thickness
    # round-off of the inverse of a matrix of condition 1e7
    np.testing.assert_allclose(N, R[:, :3], atol=1e-8)
    np.testing.assert_allclose(M, R[:, 3:6], atol=1e-8)
    outer = section.surface_stress(shell, at)(R)
    # the lowest ply's fibres are along the shell's axes
    np.testing.assert_allclose(outer[:, :3], section.ply_stress(shell, at, 0)(R)[:, :3])


def test_strains_that_are_held_are_zero() -> None:
    R, at = np.ones((1, 8)), laminate().section.generic
    held = section.strains_by(section.shell_compliance(laminate(stretching=False), at))(R)
    assert not held[0, :3].any() and held[0, 3:].all()
    thin = section.strains_by(section.shell_compliance(laminate(transverse_shear=False), at))(R)
    assert not thin[0, 6:].any() and thin[0, :6].all()


def test_strains_of_beams_are_those_of_their_stiffness() -> None:
    rng = np.random.default_rng(1)
    half = rng.normal(size=(6, 6))
    stiffness = half @ half.T + np.eye(6)
    profile = sm.GeneralSection(stiffness=stiffness, mass_per_length=1.0, size=0.1)
    beam = sm.Beam("arm", sm.Line((0, 0, 0), (1, 0, 0)), profile)
    np.testing.assert_allclose(section.beam_compliance(beam) @ stiffness, np.eye(6), atol=1e-9)
    slender = section.beam_compliance(replace(beam, transverse_shear=False))
    assert not slender[1:3].any() and slender[0].any()


def test_principal_forces() -> None:
    R = np.array([[3.0, 1.0, 0, 0, 0, 0, 0, 0], [0, 0, 2.0, 0, 0, 0, 0, 0]])
    np.testing.assert_allclose(section.principal(R), [[3, 1], [2, -2]])
