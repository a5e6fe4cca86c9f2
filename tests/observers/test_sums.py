"""Sums over nodes in C, beside the same written out."""

import numpy as np
import pytest

from shellmb.observers.account.rotations import _directions
from shellmb.observers.fields.nodal import Nodes
from shellmb.observers.forces.reactions import Carrier
from shellmb.scene import Beam, Isotropic, Line, Rectangle, RectangularSection, Scene, Shell
from shellmb.simulate.simulation import Simulation

SOFT = Isotropic(E=1e6, nu=0.3, thickness=0.05, density=1000)


@pytest.fixture(scope="module")
def bodies():
    """A shell, whose nodes have one director each, and a beam, whose nodes have three."""
    plate = Shell("plate", Rectangle(1.0, 0.5), SOFT, mesh=(2, 1))
    section = RectangularSection(E=1e6, nu=0.3, width=0.1, height=0.2, density=1000)
    beam = Beam("beam", Line((0, 2, 0), (1, 2, 0)), section, elements=2)
    simulation = Simulation(Scene("two", plate, beams=beam, scheme="ep", dt=1e-3, t_end=1e-3))
    return simulation.model.meshed


@pytest.mark.parametrize("name", ["plate", "beam"])
@pytest.mark.parametrize("whole", [1.0, 0.0])
def test_resultants(bodies, name, whole) -> None:
    """Forces on positions, and moments with couples on directors; some of the nodes, or all."""
    body, rng = bodies[name], np.random.default_rng(0)
    size, before = body.mixed.space.dofmap.index_map.size_local, 3
    q, forces = rng.normal(size=size), rng.normal(size=size + before)
    X, D = body.mixed.nodes("u"), body.node_directors()
    u, w = body.mixed.dofs["u"].reshape(-1, 3), body.mixed.dofs["w"].reshape(D.shape)
    x, d, f = whole * X + q[u], whole * D + q[w], forces[before:]
    carrier = Carrier(body, slice(before, before + size))
    marked = X[:, 0] > 0.3
    for nodes in (None, marked):
        here = np.ones(len(X), dtype=bool) if nodes is None else nodes
        ((found,),), (gross,) = carrier.resultants(q[None], whole, [forces[None]], nodes)
        moment = np.cross(x, f[u])[here].sum(axis=0) + np.cross(d, f[w])[here].sum(axis=(0, 1))
        np.testing.assert_allclose(found, [*f[u][here].sum(axis=0), *moment], rtol=1e-12)
        assert gross == pytest.approx(np.linalg.norm(f[u][here], axis=1).sum(), rel=1e-12)


@pytest.mark.parametrize("name", ["plate", "beam"])
def test_sums_of_a_step(bodies, name) -> None:
    """Of some of the nodes: sums of the middle and of changes, and the largest chord."""
    body, rng = bodies[name], np.random.default_rng(1)
    size = body.mixed.space.dofmap.index_map.size_local
    start, end = rng.normal(size=(2, size))
    some = np.array([4, 0, 2], dtype=np.int32)
    D = body.node_directors()
    u = body.mixed.dofs["u"].reshape(-1, 3)[some]
    w = body.mixed.dofs["w"].reshape(D.shape)[some]
    middle, change = (start + end) / 2, end - start
    x, dx = body.mixed.nodes("u")[some] + middle[u], change[u]
    d, dd = (D[some] + middle[w]).reshape(-1, 3), change[w].reshape(-1, 3)
    squares = np.concatenate([x.T @ x, x.T @ dx, d.T @ d, d.T @ dd]).ravel()
    nodes = Nodes(body, some)
    square = nodes.sums().rotation_sums(nodes.directors, start, end, sums := np.zeros(43))
    chord = np.sqrt(square / _directions(nodes.directors))
    expected = np.concatenate([[3], x.sum(axis=0), dx.sum(axis=0), squares])
    np.testing.assert_allclose(sums, expected, rtol=1e-12, atol=1e-13)
    # of a rotation by `a` two of three directors see a chord of `2 sin(a/2)`
    sizes = (change[w] ** 2).sum(axis=(1, 2)) / (2 if D.shape[1] == 3 else 1)
    assert chord == pytest.approx(np.sqrt(sizes.max()), rel=1e-12)
