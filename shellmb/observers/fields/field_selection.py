"""Fields of each part beside its displacement that the scene's output requests."""

from __future__ import annotations

import numpy as np

from shellmb.arrays import Floats
from shellmb.observers.fields.chosen import chosen_fields, wants
from shellmb.observers.files.output_parts import Drawn, DrawnJoints, DrawnMesh
from shellmb.observers.forces.joints import JointForces
from shellmb.simulate.simulation import Simulation

DIRECTORS = ("director", "d1", "d2", "d3")
DIRECTOR_VELOCITIES = tuple(f"{name}_velocity" for name in DIRECTORS)
XYZ = ("x", "y", "z")


class RequestedFields:
    """Fields of all parts.

    Args:
        simulation: The simulation.
        forces: Forces of joints, if they are known.
    """

    def __init__(self, simulation: Simulation, forces: JointForces | None) -> None:
        scene = simulation.scene
        self._chosen = chosen_fields(simulation)
        # those of clamped edges of reduced bodies and of joins of rigid ones, too
        self._joints = list(simulation.model.mechanism.joints)
        self._forces = forces
        self._wanted = [name for name in ("force", "moment") if wants(scene, name)]
        self._left_out = set() if wants(scene, "director") else set(DIRECTORS)
        self._left_out |= set() if wants(scene, "velocity") else {"velocity"}
        self._left_out |= set() if wants(scene, "director_velocity") else set(DIRECTOR_VELOCITIES)

    def components(self, name: str) -> dict[str, tuple[str, ...]]:
        """Names of components of a part's fields."""
        vectors = ["displacement", "velocity", *DIRECTORS, *DIRECTOR_VELOCITIES]
        if name in self._chosen:
            return {**dict.fromkeys(vectors, XYZ), **self._chosen[name].components}
        return dict.fromkeys([*vectors, "force", "moment"], XYZ)

    def solved(self) -> None:
        """Keep what means over the step need of its start."""
        for chosen in self._chosen.values():
            chosen.solved()

    def of(self, name: str, part: Drawn, fields: dict[str, Floats]) -> dict[str, Floats]:
        """Fields of a body on rank 0, nothing elsewhere; collective.

        Args:
            name: Name of the part.
            part: The part.
            fields: Those of its state.
        """
        kept = {key: values for key, values in fields.items() if key not in self._left_out}
        if name in self._chosen:
            assert isinstance(part, DrawnMesh)
            for key, values in self._chosen[name].values().items():
                gathered = part.shape(values)
                if gathered is not None:
                    kept[key] = gathered
        if isinstance(part, DrawnJoints) and self._forces is not None and kept:
            for row, key in enumerate(("force", "moment")):
                if key in self._wanted:
                    acting = np.array([self._forces.acting[j][row] for j in self._joints])
                    # what acts on the second body, and its opposite on the first one
                    kept[key] = np.stack([-acting, acting], axis=1).reshape(-1, 3)
        return kept
