"""Sums over nodes are those of their vectors, one after the other."""

import numpy as np
import pytest

from shellmb.observers.fields.nodal import NodeSums

RANDOM = np.random.default_rng(0)


@pytest.mark.parametrize("directors", [1, 3])
def test_sums_over_nodes(directors: int) -> None:
    """Of positions, then of directors; dofs in any order, some of which do not count."""
    dofs = RANDOM.permutation(90)[: 3 * 5 * (1 + directors)].reshape(-1, 3)
    reference, q, more = RANDOM.normal(size=dofs.shape), *RANDOM.normal(size=(2, 90))
    counted = RANDOM.integers(0, 2, 90).astype(float)
    nodes = NodeSums(dofs, reference, 5)

    force = (counted * more)[dofs]
    moment = np.cross(reference + q[dofs], force).sum(axis=0)
    gross = np.linalg.norm(force[:5], axis=1).sum()
    found = nodes.resultants(q[None], 1.0, more[None], counted)
    assert found[0] == pytest.approx([*force[:5].sum(axis=0), *moment, gross], rel=1e-12)

    sums, middle = np.zeros(43), reference + (q + more)[dofs] / 2
    change = (more - q)[dofs]
    square = nodes.rotation_sums(directors, q, more, sums)
    assert sums[:7] == pytest.approx([5, *middle[:5].sum(axis=0), *change[:5].sum(axis=0)])
    products = [
        (a[part].T @ b[part]).ravel()
        for part in (slice(5), slice(5, None))
        for a, b in ((middle, middle), (middle, change))
    ]
    assert sums[7:] == pytest.approx(np.concatenate(products), rel=1e-12)
    assert square == pytest.approx((change[5:] ** 2).reshape(5, -1).sum(axis=1).max())
