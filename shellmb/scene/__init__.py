"""The scene: plain descriptions of bodies, supports, loads and settings, checked when made."""

from shellmb.scene.beam_sections import BeamSection, GeneralSection
from shellmb.scene.beam_shapes import CircularSection, RectangularSection, TubularSection
from shellmb.scene.beams import Beam, Glue
from shellmb.scene.bodies import Join, Shell
from shellmb.scene.body_loads import (
    FollowerForce,
    FollowerLineForce,
    FollowerMoment,
    LineForce,
    LineMoment,
    PointMoment,
)
from shellmb.scene.curves import (
    AlongEdge,
    AlongLine,
    Arc,
    CircularArc,
    Curve,
    Line,
    ParametricCurve,
)
from shellmb.scene.elements import (
    Damper,
    Driver,
    Element,
    JointDamper,
    JointSpring,
    Lock,
    Motor,
    Spring,
)
from shellmb.scene.gmsh_surfaces import GmshFile, GmshModel, MeshFile
from shellmb.scene.initial import InitialVelocity
from shellmb.scene.joints import (
    GROUND,
    Cylindrical,
    Distance,
    InPlane,
    Joint,
    Planar,
    Prismatic,
    Revolute,
    Screw,
    ShellRevolute,
    Spherical,
    Universal,
    Weld,
)
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
from shellmb.scene.lookup import Body
from shellmb.scene.offsets import Offset
from shellmb.scene.paths import PathFollowing
from shellmb.scene.probes import Probe
from shellmb.scene.rigid import RigidBody
from shellmb.scene.rolling import KnifeEdge, Rolling
from shellmb.scene.round_surfaces import Cylinder, Disc, Sphere
from shellmb.scene.scene import Scene
from shellmb.scene.sections import Hyperelastic, Isotropic, LinearSection, Orthotropic, Section
from shellmb.scene.settings import Output, Solver, StepControl
from shellmb.scene.supports import (
    Clamped,
    Diaphragm,
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
    "GROUND",
    "AlongEdge",
    "AlongLine",
    "Arc",
    "Beam",
    "BeamSection",
    "Body",
    "CircularArc",
    "CircularSection",
    "Clamped",
    "Curve",
    "Cylinder",
    "Cylindrical",
    "Damper",
    "Diaphragm",
    "Disc",
    "Distance",
    "Driven",
    "Driver",
    "EdgeForce",
    "EdgeMoment",
    "Element",
    "Fixed",
    "FollowerEdgeForce",
    "FollowerForce",
    "FollowerLineForce",
    "FollowerMoment",
    "FollowerSurfaceForce",
    "GeneralSection",
    "Glue",
    "GmshFile",
    "GmshModel",
    "Gravity",
    "HardSupport",
    "Hinged",
    "Hyperelastic",
    "InPlane",
    "InitialVelocity",
    "Isotropic",
    "Join",
    "Joint",
    "JointDamper",
    "JointSpring",
    "KnifeEdge",
    "Laminate",
    "Line",
    "LineForce",
    "LineMoment",
    "LinearSection",
    "Load",
    "Lock",
    "MeshFile",
    "Motor",
    "Offset",
    "Orthotropic",
    "Output",
    "Parametric",
    "ParametricCurve",
    "PathFollowing",
    "Planar",
    "Ply",
    "PlyMaterial",
    "PointForce",
    "PointMoment",
    "Pressure",
    "Prismatic",
    "Probe",
    "Ramp",
    "Rectangle",
    "RectangularSection",
    "Revolute",
    "RigidBody",
    "Rolling",
    "Scene",
    "Screw",
    "Section",
    "Shell",
    "ShellRevolute",
    "Sine",
    "SoftSupport",
    "Solver",
    "Sphere",
    "Spherical",
    "Spring",
    "Step",
    "StepControl",
    "Support",
    "Surface",
    "SurfaceForce",
    "SymmetryPlane",
    "Table",
    "TimeFunction",
    "TubularSection",
    "Universal",
    "Weld",
    "stacking_angles",
]
