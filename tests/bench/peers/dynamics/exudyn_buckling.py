"""Section 6.1 of the paper, without its reinforced edge, in Exudyn: plate, crank and link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shellmb.demos import lateral_buckling as demo
from shellmb.demos.references.inertia import MassProperties
from tests.bench.peers.dynamics.exudyn_motion import ExudynMotion
from tests.bench.peers.dynamics.history import TipHistory
from tests.bench.peers.dynamics.our_buckling import BOW, T_END
from tests.bench.peers.exudyn import Mesh, quiet, require

SECTION = (demo.E, demo.NU, demo.THICKNESS, demo.DENSITY)
# of the plate that stands on edge: its clamp leaves the slope along it free in its plane
CLAMPED = (0, 1, 2, 4, 6, 7, 8)
SIDEWAYS = 1


def place(r: complex, s: complex) -> tuple[complex, complex, complex]:
    """Position on the bowed plate, both arguments from 0 to 1, m."""
    return demo.LENGTH * r, BOW * (1 - np.cos(2 * np.pi * r)) / 2, demo.HEIGHT * s


@dataclass(frozen=True)
class ExudynBuckling(ExudynMotion):
    """Settings of Exudyn's solution; meshes have nodes at mid-span."""

    def run(self) -> TipHistory:
        """Solve; set-up is not timed.

        Raises:
            SceneError: If Exudyn is not installed.
        """
        exu = require()
        nx, ny = self.mesh
        with quiet():
            import exudyn.itemInterface as items

            mesh = Mesh(exu, self.mesh, SECTION, place)
            for j in range(ny + 1):
                mesh.hold(mesh.node(0, j), CLAMPED)
            corner = mesh.node(nx, 0)
            velocity = _mechanism(exu, mesh, corner)
            mesh.system.SetNodeParameter(corner, "initialVelocities", [*velocity, *6 * [0.0]])
            sensor = mesh.system.AddSensor(
                items.SensorNode(
                    nodeNumber=mesh.node(nx // 2, ny // 2),
                    storeInternal=True,
                    writeToFile=False,
                    outputVariableType=exu.OutputVariableType.Displacement,
                )
            )
            return self.solve(exu, mesh, sensor, SIDEWAYS, T_END)


def _mechanism(exu: Any, mesh: Mesh, corner: Any) -> list[float]:
    """Crank and link as in the demo; the velocity of the corner at first, m/s.

    The crank turns by a constraint of the velocity of its angle, which costs no Python function.
    """
    import exudyn.itemInterface as items
    import exudyn.utilities as utilities

    system = mesh.system
    ground, pin, crank, link = demo.mechanism()
    spin = np.array([0.0, demo.RATE, 0.0])
    velocity = np.cross(spin, np.subtract(pin, ground))

    def body(own: MassProperties, speed: Any, rate: Any, rotation: Any) -> tuple[Any, Any]:
        inertia = utilities.RigidBodyInertia(own.mass, np.array(own.inertia))
        made = system.CreateRigidBody(
            inertia=inertia,
            referencePosition=list(own.center),
            initialVelocity=list(speed),
            initialAngularVelocity=list(rate),
            nodeType=rotation,
            returnDict=True,
        )
        return made["bodyNumber"], made["nodeNumber"]

    def point(number: Any, own: MassProperties | None, at: Any) -> Any:
        local = np.subtract(at, own.center if own else 0.0).tolist()
        return system.AddMarker(items.MarkerBodyPosition(bodyNumber=number, localPosition=local))

    kinds = exu.NodeType
    turning, angles = body(crank, velocity / 2, spin, kinds.RotationRxyz)
    hanging, _ = body(link, velocity, np.zeros(3), kinds.RotationEulerParameters)
    fixed = system.AddObject(items.ObjectGround())
    bearing = [point(fixed, None, ground), point(turning, crank, ground)]
    system.AddObject(items.ObjectJointSpherical(markerNumbers=bearing))
    mesh.hold(angles, (3, 5))
    mesh.drive(angles, 4, demo.RATE)
    system.CreateRevoluteJoint(
        itemNumbers=[turning, hanging], position=list(pin), axis=list(demo.Y)
    )
    end = system.AddMarker(items.MarkerNodePosition(nodeNumber=corner))
    ends = [point(hanging, link, demo.C), end]
    system.AddObject(items.ObjectJointSpherical(markerNumbers=ends))
    return velocity.tolist()
