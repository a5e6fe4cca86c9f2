"""What the attacks share."""

from mpi4py import MPI

import pytest

from shellmb.model.model import Model
from shellmb.schemes.registry import make_scheme
from shellmb.simulate.problem import Problem


@pytest.fixture
def bind():
    """Bind a scene to its meshes and write its forms, short of compiling anything."""

    def bound(scene):
        return Problem(Model(scene, MPI.COMM_WORLD), make_scheme(scene.scheme, scene.dissipation))

    return bound
