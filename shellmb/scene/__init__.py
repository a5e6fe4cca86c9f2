"""The scene: plain descriptions of bodies, supports, loads and settings, checked when made."""

from shellmb.scene.beams.beam import Beam, Glue
from shellmb.scene.beams.curves import (
    AlongEdge,
    AlongLine,
    Arc,
    CircularArc,
    Curve,
    Line,
    ParametricCurve,
)
from shellmb.scene.beams.sections import BeamSection, GeneralSection
from shellmb.scene.beams.shapes import CircularSection, RectangularSection, TubularSection
from shellmb.scene.control.controllers import PID, Controller
from shellmb.scene.control.events import Event
from shellmb.scene.control.inputs import Input
from shellmb.scene.control.sensors import Condition, Formula, Sensor
from shellmb.scene.control.signals import Acceleration, Command, Off, On
from shellmb.scene.description import Body
from shellmb.scene.initial import FromMode, FromRun, FromShape, InitialVelocity
from shellmb.scene.loads.body_loads import (
    FollowerForce,
    FollowerLineForce,
    FollowerMoment,
    LineForce,
    LineMoment,
    PointMoment,
)
from shellmb.scene.loads.contacts import Ball, Box, Contact, Faces, Obstacle, Plane, Rod
from shellmb.scene.loads.loads import (
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
from shellmb.scene.loads.potentials import Potential
from shellmb.scene.loads.supports import (
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
from shellmb.scene.loads.volumes import EnclosedVolume, Gas
from shellmb.scene.multibody.couplings import Belt, Coupling, Differential, Gear
from shellmb.scene.multibody.drivers import Driver, Lock
from shellmb.scene.multibody.edge_hinges import EdgeHinge
from shellmb.scene.multibody.elements import (
    Damper,
    Element,
    JointDamper,
    JointSpring,
    JointStop,
    Motor,
    Spring,
)
from shellmb.scene.multibody.joints import (
    GROUND,
    Cylindrical,
    Distance,
    InPlane,
    Joint,
    OwnJoint,
    Planar,
    Prismatic,
    Revolute,
    Screw,
    ShellRevolute,
    Spherical,
    Universal,
    Weld,
)
from shellmb.scene.multibody.offsets import Offset
from shellmb.scene.multibody.rigid import RigidBody
from shellmb.scene.multibody.rolling import KnifeEdge, Rolling
from shellmb.scene.paths import PathFollowing
from shellmb.scene.probes import Probe, Reserve
from shellmb.scene.scene import Scene
from shellmb.scene.settings import Output, Solver, StepControl
from shellmb.scene.shells.gmsh_surfaces import GmshFile, GmshModel, MeshFile
from shellmb.scene.shells.laminate import Laminate, Ply, PlyMaterial, stacking_angles
from shellmb.scene.shells.round_surfaces import Cylinder, Disc, Sphere
from shellmb.scene.shells.sections import (
    Hyperelastic,
    Isotropic,
    LinearSection,
    Orthotropic,
    Section,
    Wrinkling,
)
from shellmb.scene.shells.shell import Join, Shell
from shellmb.scene.shells.strength import Strength
from shellmb.scene.shells.surfaces import Parametric, Rectangle, Surface
from shellmb.scene.shells.thermal import thermal_strain
from shellmb.scene.values.damping import BeamDamping, ShellDamping
from shellmb.scene.values.models import Modal
from shellmb.scene.values.natural import BeamNaturalStrain, NaturalStrain
from shellmb.scene.values.relaxation import WLF, Prony
from shellmb.scene.values.times import Ramp, Sine, Step, Table, TimeFunction

__all__ = [
    "GROUND",
    "PID",
    "WLF",
    "Acceleration",
    "AlongEdge",
    "AlongLine",
    "Arc",
    "Ball",
    "Beam",
    "BeamDamping",
    "BeamNaturalStrain",
    "BeamSection",
    "Belt",
    "Body",
    "Box",
    "CircularArc",
    "CircularSection",
    "Clamped",
    "Command",
    "Condition",
    "Contact",
    "Controller",
    "Coupling",
    "Curve",
    "Cylinder",
    "Cylindrical",
    "Damper",
    "Diaphragm",
    "Differential",
    "Disc",
    "Distance",
    "Driven",
    "Driver",
    "EdgeForce",
    "EdgeHinge",
    "EdgeMoment",
    "Element",
    "EnclosedVolume",
    "Event",
    "Faces",
    "Fixed",
    "FollowerEdgeForce",
    "FollowerForce",
    "FollowerLineForce",
    "FollowerMoment",
    "FollowerSurfaceForce",
    "Formula",
    "FromMode",
    "FromRun",
    "FromShape",
    "Gas",
    "Gear",
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
    "Input",
    "Isotropic",
    "Join",
    "Joint",
    "JointDamper",
    "JointSpring",
    "JointStop",
    "KnifeEdge",
    "Laminate",
    "Line",
    "LineForce",
    "LineMoment",
    "LinearSection",
    "Load",
    "Lock",
    "MeshFile",
    "Modal",
    "Motor",
    "NaturalStrain",
    "Obstacle",
    "Off",
    "Offset",
    "On",
    "Orthotropic",
    "Output",
    "OwnJoint",
    "Parametric",
    "ParametricCurve",
    "PathFollowing",
    "Planar",
    "Plane",
    "Ply",
    "PlyMaterial",
    "PointForce",
    "PointMoment",
    "Potential",
    "Pressure",
    "Prismatic",
    "Probe",
    "Prony",
    "Ramp",
    "Rectangle",
    "RectangularSection",
    "Reserve",
    "Revolute",
    "RigidBody",
    "Rod",
    "Rolling",
    "Scene",
    "Screw",
    "Section",
    "Sensor",
    "Shell",
    "ShellDamping",
    "ShellRevolute",
    "Sine",
    "SoftSupport",
    "Solver",
    "Sphere",
    "Spherical",
    "Spring",
    "Step",
    "StepControl",
    "Strength",
    "Support",
    "Surface",
    "SurfaceForce",
    "SymmetryPlane",
    "Table",
    "TimeFunction",
    "TubularSection",
    "Universal",
    "Weld",
    "Wrinkling",
    "stacking_angles",
    "thermal_strain",
]
