"""Functions of the position as fields on a shell's nodes."""

from dolfinx import fem

from shellmb.barrier import first_found
from shellmb.errors import SceneError
from shellmb.meshes.shared import space_on
from shellmb.meshes.spaces import MixedSpace
from shellmb.scene.values.user_functions import OfPosition, values_at


def interpolated(function: OfPosition, mixed: MixedSpace, size: int, who: str) -> fem.Function:
    """A vector, or a number, of reference positions (3, n), at the nodes.

    Args:
        function: The function.
        mixed: Space of the shell, whose displacement has the nodes.
        size: Number of its components, 3 or 1.
        who: What messages call it.

    Collective.

    Raises:
        SceneError: If it fails, or gives another shape or a number that is not finite.
    """
    space = mixed.subspaces["u"]
    if size == 1:
        space = space_on(space.mesh, space.ufl_element().sub_elements[0])
    field, failed = fem.Function(space, name=who), None
    try:
        field.interpolate(lambda x: values_at(function, x, size, who))
    except SceneError as error:
        failed = error
    # what one rank finds at its nodes all of them tell
    failed = first_found(space.mesh.comm, failed)
    if failed is not None:
        raise failed
    return field
