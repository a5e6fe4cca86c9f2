"""Deployment of a space antenna: four laminated panels that unfold on eight sprung hinges (ED).

Section 6.3 of O. A. Bauchau, J.-Y. Choi, C. L. Bottasso, On the modeling of shells in multibody
dynamics, Multibody System Dynamics 8 (2002) 459-489. The panels are stowed as a folded stack; panel
1 turns by 90 degrees on the ground, the others by 180 degrees on the panel before. Every panel has
beams glued to two opposite edges, `A B` and `C D`; connector beams run from the hinges at `C`, `D`
of a panel to `A`, `B` of the next. The springs act at full strength from the beginning, so that the
panels bend, and the lay-up couples bending with twist: the edges rock about the axis `i_1` of
deployment. In the beam model, panels are beams along their middle and the motion stays plane.

The axes: `i_1` = x, along which the antenna is deployed; y along the hinges; z along the stowed
panels. Nothing but springs, dampers and inertia acts. What the text leaves open are parameters.
"""

# KIND: examples of the paper
# CI: shellmb run antenna --set model=beam --dt 0.5 --t-end 100 --check --no-pictures
# CI: shellmb run antenna --set nx=2 --dt 0.4 --t-end 20 --check
# CI: shellmb run antenna --set nx=2 --set coupling=False --dt 0.4 --t-end 20 --check

import math
from typing import Any, Literal

import numpy as np

from shellmb.scene import (
    GROUND,
    AlongEdge,
    Beam,
    GeneralSection,
    Glue,
    Joint,
    JointDamper,
    JointSpring,
    Laminate,
    Line,
    Output,
    Ply,
    PlyMaterial,
    Probe,
    Rectangle,
    RectangularSection,
    Revolute,
    Scene,
    Shell,
    Weld,
    stacking_angles,
)

PANELS = 4
# spring and damper of both hinges of a line: M_0 [N m], theta_0 [rad], n, mu [N m s/rad]; table 1
LAWS = {
    "A1": (1.0, np.pi / 2, 6, 20.0),
    "C1": (0.8, np.pi, 12, 9.0),
    "C2": (0.7, np.pi, 12, 7.0),
    "C3": (0.5, np.pi, 12, 5.0),
}
TWIN = {"A": "B", "C": "D"}
LAYUP = "[0/90/45/-45/45/-45]s"
PLY = 125e-6  # [m]
FIBRE = {"E1": 138e9, "E2": 8.96e9, "nu12": 0.3, "G12": 7.1e9}
E, RHO = 140e9, 7000.0  # of the beams
REINFORCING, CONNECTOR = 0.01, 0.02  # sides of their sections [m]
JOINT_MASS = 8.0  # [kg]
HINGES = tuple(letter + line[1] for line in LAWS for letter in (line[0], TWIN[line[0]]))


def laminate(coupling: bool, density: float, G13: float, G23: float) -> Laminate:
    """The panels' lay-up.

    Args:
        coupling: False: every ply at 45 degrees is half +45 and half -45 instead, as in a fabric.
            All stiffnesses stay what they are but for D16 = D26 = 0.
        density: Density [kg/m^3].
        G13: Transverse shear modulus along the fibres [Pa].
        G23: The same across [Pa].
    """
    ply = PlyMaterial(**FIBRE, G13=G13, G23=G23, density=density)
    angles = stacking_angles(LAYUP)
    if coupling:
        return Laminate(tuple(Ply(ply, PLY, angle) for angle in angles))
    Q = Laminate((Ply(ply, 1.0, 45.0),)).A
    shear = (G13 + G23) / 2
    fabric = PlyMaterial(
        E1=Q[0, 0] - Q[0, 1] ** 2 / Q[1, 1],
        E2=Q[1, 1] - Q[0, 1] ** 2 / Q[0, 0],
        nu12=Q[0, 1] / Q[1, 1],
        G12=Q[2, 2],
        G13=shear,
        G23=shear,
        density=density,
    )
    turned = (Ply(fabric if abs(a) == 45 else ply, PLY, 0.0 if abs(a) == 45 else a) for a in angles)
    return Laminate(tuple(turned))


def panel_beam(skin: Laminate, width: float) -> GeneralSection:
    """A panel as a beam: free to contract and to curve across, without D16 and D26.

    Args:
        skin: Its lay-up.
        width: Its width [m].
    """
    b = width
    membrane = skin.A[0, 0] - skin.A[0, 1] ** 2 / skin.A[1, 1]
    bending = skin.D[0, 0] - skin.D[0, 1] ** 2 / skin.D[1, 1]
    m, _, turning = skin.mass
    return GeneralSection(
        stiffness=(
            b * membrane,
            5 / 6 * b * skin.A[2, 2],
            b * skin.G[0, 0],
            4 * b * skin.D[2, 2],
            b * bending,
            b**3 / 12 * membrane,
        ),
        mass_per_length=b * m,
        second_moments=(m * b**3 / 12, 0.0, b * turning),
        size=skin.thickness,
    )


def potential(M_0: float, theta_0: float, n: int) -> Any:
    """Energy [J] whose slope is `-M_0 [1 - (theta/theta_0)^n]`; the spring opens the joint."""
    return lambda theta: -M_0 * (theta - theta * (theta / theta_0) ** n / (n + 1))


def scene(
    model: Literal["shell", "beam"] = "shell",
    length: float = 5.0,
    width: float = 2.0,
    connector: float = 0.2,
    connector_direction: Literal["across", "panel"] = "across",
    coupling: bool = True,
    ply_density: float = 1600.0,
    G13: float = 7.1e9,
    G23: float = 3.2e9,
    beam_nu: float = 0.3,
    joint_mass: float = JOINT_MASS,
    glue: Literal["revolute", "director"] = "director",
    nx: int = 5,
    ny: int = 2,
    dt: float = 0.2,
    t_end: float = 120.0,
) -> Scene:
    """The antenna, stowed and at rest.

    Args:
        model: Panels as shells, or as beams along their middle, the paper's simplified model.
        length: Side of a panel across the hinges [m]. The text has square panels of 5 m with beams
            of 2 m along their edges, which cannot be; panels of 5 m x 2 m keep both lengths.
        width: Side of a panel along the hinges, the length of the reinforcing beams [m].
        connector: Length of the connector beams [m], not given: the gap between the stowed panels.
        connector_direction: Not given: `"across"` the panels, so that the stowed ones lie side by
            side, or in the plane of the `"panel"`, so that stowed panels share one plane.
        coupling: Whether the lay-up has D16 and D26.
        ply_density: Not given; typical of carbon fibres in epoxy [kg/m^3].
        G13: Not given; that in the plane, as in any ply that is isotropic across its fibres [Pa].
        G23: Not given; E_T / (2 (1 + 0.4)) [Pa].
        beam_nu: Poisson's ratio of the beams, not given.
        joint_mass: Mass of a hinge [kg].
        glue: How reinforcing beams are connected with panels; both kinds are one model, and
            `"director"` has fewer unknowns than the shell revolute joints of eq. 35.
        nx: Elements of a panel across the hinges; the mesh is not given.
        ny: Elements along them.
        dt: Time step [s], not given: a 15th of the period of a panel's first vibration.
        t_end: End [s], not given: the hinges are 90 % open at 76 s, then their springs hit.
    """
    skin = laminate(coupling, ply_density, G13, G23)
    edge = RectangularSection(E, beam_nu, width=REINFORCING, height=REINFORCING, density=RHO)
    bar = RectangularSection(E, beam_nu, width=CONNECTOR, height=CONNECTOR, density=RHO)
    beams: list[Beam] = []
    shells: list[Shell] = []
    glues: list[Glue] = []
    joints: list[Joint] = []
    probes: list[Probe] = []
    across = np.array([0.0, width, 0.0])
    A = np.zeros(3)
    for i in range(1, PANELS + 1):
        # panels 1 and 3 are stowed upwards and turn about +y, the others downwards and about -y
        sign = 1.0 if i % 2 else -1.0
        along = np.array([0.0, 0.0, sign])
        C, axis = A + length * along, (0.0, sign, 0.0)
        panel, middle = f"panel{i}", _point(A + (length * along + across) / 2)
        if model == "shell":
            surface = Rectangle(length, width, _point(A), _point(along), (0.0, 1.0, 0.0))
            shells.append(Shell(panel, surface, skin, mesh=(nx, ny), direction=_point(along)))
            probes += [
                Probe(f"{panel}_M{ab}", middle, "bending", k, panel)
                for k, ab in enumerate(("11", "22", "12"))
            ]
        else:
            ends = (_point(A + across / 2), _point(C + across / 2))
            normal = _point(np.cross(along, across))
            section = panel_beam(skin, width)
            beams.append(Beam(panel, Line(*ends), section, elements=nx, up=normal))
            # the moment about d2 = y of the whole width
            probes.append(Probe(f"{panel}_M11", middle, "moment", 1, panel))
        for line, side, corner in ((f"AB{i}", "left", A), (f"CD{i}", "right", C)):
            ends = (_point(corner), _point(corner + across))
            if model == "shell":
                beams.append(Beam(line, AlongEdge(panel, side), edge))
                glues.append(Glue(line, panel, glue))
            else:
                beams.append(Beam(line, Line(*ends), edge, elements=ny, up=normal))
                centre = _point(corner + across / 2)
                joints.append(Weld(f"{line}-{panel}", line, panel, at=centre))
            probes += [
                Probe(f"{letter}{i}_{xyz}", point, "position", k, line)
                for letter, point in zip(line[:2], ends, strict=True)
                for k, xyz in enumerate("xyz")
            ]
        if i == 1:
            for hinge, point in (("A1", A), ("B1", A + across)):
                place = _point(point)
                joints.append(Revolute(hinge, GROUND, "AB1", at=place, mass=joint_mass, axis=axis))
        if i == PANELS:
            break
        gap = (connector, 0.0, 0.0) if connector_direction == "across" else -connector * along
        A = C + gap
        for hinge, to, shift in (("C", "A", 0 * across), ("D", "B", across)):
            name, first, last = f"{hinge}{i}{to}{i + 1}", _point(C + shift), _point(A + shift)
            beams.append(Beam(name, Line(first, last), bar, elements=2, up=(0.0, 1.0, 0.0)))
            joints += [
                Revolute(
                    f"{hinge}{i}", f"CD{i}", name, at=first, mass=joint_mass, axis=(0, -sign, 0)
                ),
                Weld(f"{to}{i + 1}", f"AB{i + 1}", name, at=last),
            ]
            centre = _point((C + A) / 2 + shift)
            probes += [Probe(f"{name}_F{k + 1}", centre, "force", k, name) for k in range(3)]
    elements: list[JointSpring | JointDamper] = []
    for line, (M_0, theta_0, n, mu) in LAWS.items():
        # one law for both hinges of a line, so that they share a form
        law = potential(M_0, theta_0, n)
        for hinge in (line, TWIN[line[0]] + line[1]):
            elements.append(JointSpring(f"spring-{hinge}", hinge, potential=law))
            elements.append(JointDamper(f"damper-{hinge}", hinge, damping=mu))
    return Scene(
        "antenna",
        shells=shells,
        beams=beams,
        glues=glues,
        joints=joints,
        force_elements=elements,
        probes=probes,
        scheme="ed",
        alpha=1.0,
        dt=dt,
        t_end=t_end,
        output=Output(frames=101),
        units="m, kg, s",
    )


def _point(x: Any) -> tuple[float, float, float]:
    # adding zero rids of the sign of a zero
    a, b, c = (float(v) + 0.0 for v in x)
    return a, b, c


def rocking(history: Any, line: str) -> Any:
    """Rotation of a reinforcing beam about `i_1`, the angle of its ends seen along x [degrees].

    Args:
        history: The history of a run.
        line: Name of the beam: "AB1" ... "CD4".
    """
    y, z = (
        history[f"{line[1]}{line[2]}_{xyz}"] - history[f"{line[0]}{line[2]}_{xyz}"] for xyz in "yz"
    )
    return np.degrees(np.arctan2(z.to_numpy(), y.to_numpy()))


def opening(history: Any, hinge: str) -> Any:
    """Rotation of a hinge, as a part of its `theta_0` [-]."""
    law = LAWS[("A" if hinge[0] in "AB" else "C") + hinge[1]]
    return history[f"{hinge}.rotation"].to_numpy() / law[1]


def moments(run: Any, panel: int) -> dict[str, Any]:
    """Bending moments at the centre of a panel per length, by "11", "22", "12" [N].

    Args:
        run: The run; one of the beam model has M11 only, the mean over its width.
        panel: Number of the panel.
    """
    names = {ab: f"panel{panel}_M{ab}" for ab in ("11", "22", "12")}
    if run.scene.shells:
        return {ab: run.history[name].to_numpy() for ab, name in names.items()}
    return {"11": run.history[names["11"]].to_numpy() / run.scene.body("AB1").curve.length}


def results(run: Any) -> dict[str, float]:
    """Measure how far and when the hinges open, and the largest rocking, moments and shear forces.

    Times are those of the last hinge to pass 90 %; of a short run that no hinge passes there is
    none.
    """
    history, summary = run.history, run.summary
    t = history["t"].to_numpy()
    open_ = {hinge: opening(history, hinge) for hinge in HINGES}
    found = {
        "energy_balance_error": summary["energy_balance_error"],
        "constraint_max": summary["constraint_max"],
        "rejected_steps": summary["rejected_steps"],
        "t_end": float(t[-1]),
        "least_opening": min(float(x[-1]) for x in open_.values()),
        "largest_opening": max(float(x.max()) for x in open_.values()),
        "twins_apart": max(
            float(np.abs(open_[line] - open_[TWIN[line[0]] + line[1]]).max()) for line in LAWS
        ),
    }
    for line in LAWS:
        past = np.flatnonzero(open_[line] >= 0.9)
        if len(past):
            found[f"time_90_{line}"] = float(t[past[0]])
    for i in range(1, PANELS + 1):
        rocks = [np.abs(rocking(history, f"{line}{i}")).max() for line in ("AB", "CD")]
        found[f"rocking_{i}"] = float(max(rocks))
        for ab, values in moments(run, i).items():
            found[f"M{ab}_{i}"] = float(np.nanmax(np.abs(values)))
    for name in ("C1A2", "D1B2"):
        for k in (2, 3):
            found[f"{name}_F{k}"] = float(history[f"{name}_F{k}"].abs().max())
    if run.scene.shells:
        D = run.scene.shells[0].section.D
        found["D16"] = float(D[0, 2])
        found["D16_by_sqrt_D11_D66"] = float(D[0, 2] / np.sqrt(D[0, 0] * D[2, 2]))
    return found


def check(results: dict[str, float]) -> None:
    """The energy law, deployment, and that the motion is three-dimensional by the coupling only."""
    assert results["energy_balance_error"] < 1e-9
    assert results["constraint_max"] < 1e-10
    if results["t_end"] >= 100:
        late = [results.get(f"time_90_{line}", math.inf) for line in LAWS]
        assert max(late) < 100, late
    rocking = max(results[f"rocking_{i}"] for i in range(1, PANELS + 1))
    if results.get("D16"):
        assert results["D16_by_sqrt_D11_D66"] > 0.1
        # the springs act against inertia only before the hinges close: small, and no round-off
        assert rocking > 0.02, rocking
        assert results["M12_4"] > 0.02 * results["M11_4"]
    else:
        # what round-off grows to
        assert rocking < 1e-6, rocking
        assert results["twins_apart"] < 1e-9
        assert results.get("M12_4", 0.0) < 1e-6
    if "M22_4" in results:
        assert results["M22_4"] > 0.1 * results["M11_4"]
