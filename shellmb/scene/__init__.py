"""The scene: plain descriptions of bodies, supports, loads and settings, checked when made."""

from shellmb.scene.bodies import Join, Shell
from shellmb.scene.gmsh_surfaces import GmshFile, GmshModel
from shellmb.scene.initial import InitialVelocity
from shellmb.scene.laminate import Laminate, Ply, PlyMaterial, stacking_angles
from shellmb.scene.loads import (
    EdgeForce,
    EdgeMoment,
    FollowerEdgeForce,
    FollowerSurfaceForce,
    Gravity,
    Load,
    PointForce,
    Pressure,
    SurfaceForce,
)
from shellmb.scene.probes import Probe
from shellmb.scene.round_surfaces import Cylinder, Disc, Sphere
from shellmb.scene.scene import Scene
from shellmb.scene.sections import Hyperelastic, Isotropic, LinearSection, Orthotropic, Section
from shellmb.scene.settings import Output, Solver, StepControl
from shellmb.scene.supports import (
    Clamped,
    Driven,
    Fixed,
    HardSupport,
    Hinged,
    SoftSupport,
    Support,
    SymmetryPlane,
)
from shellmb.scene.surfaces import Parametric, Rectangle, Surface
from shellmb.scene.times import Ramp, Sine, Step, Table, TimeFunction

__all__ = [
    "Clamped",
    "Cylinder",
    "Disc",
    "Driven",
    "EdgeForce",
    "EdgeMoment",
    "Fixed",
    "FollowerEdgeForce",
    "FollowerSurfaceForce",
    "GmshFile",
    "GmshModel",
    "Gravity",
    "HardSupport",
    "Hinged",
    "Hyperelastic",
    "InitialVelocity",
    "Isotropic",
    "Join",
    "Laminate",
    "LinearSection",
    "Load",
    "Orthotropic",
    "Output",
    "Parametric",
    "Ply",
    "PlyMaterial",
    "PointForce",
    "Pressure",
    "Probe",
    "Ramp",
    "Rectangle",
    "Scene",
    "Section",
    "Shell",
    "Sine",
    "SoftSupport",
    "Solver",
    "Sphere",
    "Step",
    "StepControl",
    "Support",
    "Surface",
    "SurfaceForce",
    "SymmetryPlane",
    "Table",
    "TimeFunction",
    "stacking_angles",
]
