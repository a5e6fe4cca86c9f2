"""Links of the unknowns of node meshes to those of bodies: the paper's Boolean identification."""

from collections.abc import Sequence

import numpy as np

from shellmb.arrays import Ints
from shellmb.meshes.nodes import NodeMesh
from shellmb.model.body import Dofs, NodeLink


def node_links(nodes: NodeMesh, rows: Dofs, bodies: Sequence[str], targets: Ints) -> list[NodeLink]:
    """Links of a part of a node mesh, one for each body; the same bodies on all ranks.

    Args:
        nodes: The node mesh.
        rows: Local dofs of the part, one row per local cell, shape (n, size).
        bodies: Name of the body of each item.
        targets: Global dofs in the body's space, one row per item, shape (items, size).
    """
    owner, wanted = np.array(bodies)[nodes.item], targets[nodes.item]
    return [
        NodeLink(rows[owner == name].ravel(), name, wanted[owner == name].ravel())
        for name in dict.fromkeys(bodies)
    ]
