"""Faults of contact with faces of shells; as in `faults`."""

from .faults import Fault

RUBS = "tests/contact/test_faces_friction.py"
LOSES = f"{RUBS}::test_what_rubs_loses_energy_and_no_momentum[0.002-ep-None]"

FAULTS: tuple[Fault, ...] = (
    Fault(
        "friction of faces that drives what slides",
        "shellmb/simulate/couplings/contact_forces.py",
        "forces = [*forces, -normal] if self._rubs else forces",
        "forces = [*forces, normal] if self._rubs else forces",
        (LOSES,),
    ),
    Fault(
        "damping of faces that pushes what leaves",
        "shellmb/simulate/couplings/contact_forces.py",
        "approach = (parts[0] - parts[-1]) * self._rate",
        "approach = (parts[-1] - parts[0]) * self._rate",
        (f"{RUBS}::test_damping_does_not_attract",),
    ),
    Fault(
        "friction of faces without its moment on directors",
        "forms/contact.py",
        "return motion - arm * lever(normal, directors[0]) * changes[0]",
        "return motion",
        (LOSES,),
    ),
    Fault(
        "a contact of faces without the thickness of the shell",
        "shellmb/model/shell_contact/faces.py",
        "reach = item.radius + faces.thickness / 2",
        "reach = item.radius + 1e-3 * faces.thickness",
        ("tests/contact/test_faces.py::test_energy_and_momenta[ep-None]",),
    ),
    Fault(
        "forces of faces that push the wrong body",
        "shellmb/model/shell_contact/faces.py",
        "weights = np.column_stack([np.ones(len(pairs)), -on])",
        "weights = np.column_stack([np.ones(len(pairs)), on])",
        ("tests/contact/test_faces.py::test_energy_and_momenta[ep-None]",),
    ),
    Fault(
        "pairs and entries of the matrix that a resumed run has forgotten",
        "shellmb/simulate/couplings/faces.py",
        'self._wider = float(state["wider"])',
        "return",
        ("tests/contact/test_faces_resumed.py::test_resumed_bit_for_bit[ep]",),
    ),
    Fault(
        "facets of the elements of one rank only",
        "shellmb/model/shell_contact/facets.py",
        "cells = np.concatenate(domain.comm.allgather(mine))",
        "cells = mine",
        ("tests/contact/test_faces_ranks.py::test_one_and_two_ranks_agree[names0]",),
    ),
    Fault(
        "legs that pass through each other in a step in which they turn",
        "shellmb/model/shell_contact/facets.py",
        "found[i + j + k] += np.vecdot(normal, away[k])",
        "found[3 * k] += 3 * np.vecdot(normal, away[k]) * (i == j == k)",
        ("tests/contact/test_passing.py::test_all_crossings_are_found[0.0]",),
    ),
)
