"""One-line faults, each with the quick tests that must catch it.

A fragment stands exactly once in its file (`test_mutations.py` checks that), so that what it is
replaced by is one fault at one place. Where code is rewritten, the fault moves with it: the same
wrong physics in the new words.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """A fault.

    Args:
        name: What is wrong.
        file: Where, from the root of the checkout.
        fragment: What stands there; exactly once in the file.
        instead: What is put in its place.
        tests: Tests that must fail then, each of them: nodes of pytest, from the root.
    """

    name: str
    file: str
    fragment: str
    instead: str
    tests: tuple[str, ...]


INTERNAL = "tests/forms/test_internal.py"
BEAM = "tests/forms/beam/test_beam.py"
BEAM_INERTIA = "tests/forms/beam/test_inertia_and_loads.py"
JOINTS = "tests/forms/test_joints.py"
COORDINATES = "tests/forms/test_coordinates.py"
ELEMENTS = "tests/forms/test_elements.py"
LOADS = "tests/forms/test_loads.py"
MODAL_LOADS = "tests/reduced/test_loads.py"
DISCRETE = "tests/forms/test_discrete.py"
PRESCRIBED = "tests/schemes/test_prescribed.py::test_what_is_carried_along_follows"
SECTIONS = "tests/schemes/test_sections_in_motion.py"
DESCRIPTION = f"{SECTIONS}::test_an_offset_is_a_matter_of_description"
ACCURACY = "tests/schemes/test_accuracy.py"
CONSERVATION = "tests/schemes/test_conservation.py"
ACTING = "tests/model/test_elements.py"
FIBRES = "tests/simulate/test_fibres.py"
SUPPORTS = "tests/simulate/test_supports.py"
FREEDOMS = f"{JOINTS}::test_a_joint_leaves_its_freedoms_and_no_others"

FAULTS = (
    # strains and kinematics of shells
    Fault(
        "membrane shear strain by one of its two products",
        "forms/shell.py",
        "ufl.dot(a.x1, b.x2) + ufl.dot(a.x2, b.x1),",
        "2 * ufl.dot(a.x1, b.x2),",
        (f"{INTERNAL}::test_a_rigid_motion_of_the_reference_has_no_strain[quad-isotropic]",),
    ),
    Fault(
        "curvature of the reference left out of the bending strain",
        "forms/shell.py",
        "ufl.dot(a.x2, b.d2) + ufl.dot(a.d2, b.x2),",
        "ufl.dot(a.x2, b.d2),",
        (f"{INTERNAL}::test_a_rigid_motion_of_the_reference_has_no_strain[quad-isotropic]",),
    ),
    Fault(
        "shear strain 23 with the wrong tangent",
        "forms/shell.py",
        "ufl.dot(a.x2, b.d) + ufl.dot(a.d, b.x2)",
        "ufl.dot(a.x1, b.d) + ufl.dot(a.d, b.x2)",
        (f"{INTERNAL}::test_a_rigid_motion_of_the_reference_has_no_strain[quad-isotropic]",),
    ),
    Fault(
        "director constraint without its quadratic part",
        "forms/shell.py",
        "return ufl.dot(D, w) + ufl.dot(w, w) / 2",
        "return ufl.dot(D, w)",
        (f"{DISCRETE}::test_the_director_constraint_is_the_length",),
    ),
    Fault(
        "first moment with the wrong sign in the linear momentum",
        "forms/shell.py",
        "h, g = h + mass.s * dw, g + mass.s * v",
        "h, g = h - mass.s * dw, g + mass.s * v",
        (f"{SECTIONS}::test_momenta_of_an_eccentric_plate_in_closed_form",),
    ),
    Fault(
        "first moment with the wrong sign throughout",
        "shellmb/scene/shells/lamination.py",
        "return m, s + c * m,",
        "return m, -(s + c * m),",
        (
            f"{SECTIONS}::test_momenta_of_an_eccentric_plate_in_closed_form",
            f"{DESCRIPTION}[ep-0-1]",
        ),
    ),
    Fault(
        "first moment left out of the jump of the director's velocity",
        "forms/shell.py",
        "momentum = db if arm is None else db + arm * b",
        "momentum = db",
        (f"{SECTIONS}::test_energy_law_and_momenta[offset up-ed-1]",),
    ),
    Fault(
        "coupling of membrane and bending with the wrong sign",
        "shellmb/model/sections/section.py",
        "fields.of(lambda at: at.B) if couples",
        "fields.of(lambda at: -at.B) if couples",
        (
            f"{DESCRIPTION}[ep-0-1]",
            f"{DESCRIPTION}[ep-0--1]",
            f"{FIBRES}::test_a_pulled_strip_curves_towards_its_stiffer_face",
        ),
    ),
    Fault(
        "weight of an eccentric section on its reference surface",
        "forms/loads.py",
        "moved, _ = momenta(du, dw, mass)",
        "moved, _ = momenta(du, 0 * dw, mass)",
        (f"{DESCRIPTION}[ep-0-1]",),
    ),
    Fault(
        "second tangent vector to the other side",
        "forms/shell.py",
        "return Surface(e1, ufl.cross(normal, e1), D)",
        "return Surface(e1, ufl.cross(e1, normal), D)",
        (f"{FIBRES}::test_pulled_fibres_turn_towards_the_load",),
    ),
    # frames
    Fault(
        "frames that may shear",
        "forms/frame.py",
        "rows.append(ufl.dot(R[k], W[m]) + ufl.dot(W[k], R[m]) + ufl.dot(W[k], W[m]))",
        "rows.append(ufl.dot(R[k], W[m]) + ufl.dot(W[k], R[m]))",
        (f"{DISCRETE}::test_the_frame_constraints_are_lengths_and_angles",),
    ),
    Fault(
        "products of inertia in one of their two places only",
        "forms/frame.py",
        "                g[m] = g[m] + J * W[k]",
        "                g[m] = g[m] + 0 * J * W[k]",
        (f"{BEAM_INERTIA}::test_inertia_is_that_of_the_section_swept_along_the_line",),
    ),
    Fault(
        "first moments of a beam in its velocity only",
        "forms/frame.py",
        "h, g[k] = h + s * W[k], g[k] + s * v",
        "h, g[k] = h + 0 * W[k], g[k] + s * v",
        (f"{BEAM_INERTIA}::test_inertia_is_that_of_the_section_swept_along_the_line",),
    ),
    # joints
    Fault(
        "one row of eq. (35) twice",
        "forms/constraints/joints.py",
        "return [ufl.dot(a.e[0], b.e[-1]), ufl.dot(a.e[1], b.e[-1])]",
        "return [ufl.dot(a.e[0], b.e[-1]), ufl.dot(a.e[0], b.e[-1])]",
        (f"{FREEDOMS}[shell revolute]", f"{FREEDOMS}[revolute]"),
    ),
    Fault(
        "a gap that is closed along two axes",
        "forms/constraints/joints.py",
        "return [gap[0], gap[1], gap[2]]",
        "return [gap[0], gap[1], gap[1]]",
        (f"{FREEDOMS}[spherical]",),
    ),
    Fault(
        "a slider that leaves its axis",
        "forms/constraints/joints.py",
        "return [ufl.dot(a.e[0], _gap(a, b)), ufl.dot(a.e[1], _gap(a, b))]",
        "return [ufl.dot(a.e[0], _gap(a, b)), ufl.dot(a.e[2], _gap(a, b))]",
        (f"{FREEDOMS}[cylindrical]",),
    ),
    Fault(
        "a plane with the wrong normal",
        "forms/constraints/joints.py",
        "return [ufl.dot(a.e[2], _gap(a, b))]",
        "return [ufl.dot(a.e[1], _gap(a, b))]",
        (f"{FREEDOMS}[in-plane]",),
    ),
    Fault(
        "a weld that turns",
        "forms/constraints/joints.py",
        "turn = [ufl.dot(a.e[k], b.e[(k + 1) % 3]) for k in range(3)]",
        "turn = [ufl.dot(a.e[k], b.e[k]) for k in range(3)]",
        (f"{FREEDOMS}[weld]", f"{JOINTS}::test_reference_configuration_is_closed[weld]"),
    ),
    # coordinates and force elements
    Fault(
        "angles counted the other way round",
        "forms/constraints/coordinates.py",
        "return ufl.as_vector([ufl.dot(a.e[0], b.e[0]), ufl.dot(a.e[1], b.e[0])])",
        "return ufl.as_vector([ufl.dot(a.e[0], b.e[0]), ufl.dot(a.e[0], b.e[1])])",
        (f"{ACTING}::test_turns_are_counted",),
    ),
    Fault(
        "gradient of an angle by its linear part",
        "forms/constraints/coordinates.py",
        "series = (1 - tangent**2 / 3 + tangent**4 / 5)",
        "series = (1 - tangent**2 / 2 + tangent**4 / 5)",
        (f"{COORDINATES}::test_gradient_along_the_increment_is_the_increment",),
    ),
    Fault(
        "distance with the wrong sign",
        "forms/constraints/coordinates.py",
        "return (l**2 - ufl.dot(gap, gap)) / (2 * size)",
        "return (l**2 + ufl.dot(gap, gap)) / (2 * size)",
        (f"{COORDINATES}::test_translation_and_distance",),
    ),
    Fault(
        "springs without the jump of their force",
        "forms/steps/potentials.py",
        "return stress + beta / 2 * convex(",
        "return stress + 0 * convex(",
        (f"{ELEMENTS}::test_the_jump_of_the_force_takes_out_energy",),
    ),
    Fault(
        "springs whose force is that of their middle",
        "forms/steps/potentials.py",
        "stress += weight * gradient(U, (a + b) / 2 + g / 2 * increment)",
        "return gradient(U, (a + b) / 2)",
        (f"{ELEMENTS}::test_work_is_the_change_of_the_energy",),
    ),
    Fault(
        "springs whose natural length is forgotten",
        "shellmb/model/elements.py",
        "ufl.as_vector([self.x(q) - self.rest])",
        "ufl.as_vector([self.x(q)])",
        (f"{ACTING}::test_two_coordinates_of_a_cylindrical_joint",),
    ),
    Fault(
        "dampers that drive",
        "shellmb/model/elements.py",
        "return -self._resistance(self.x(rates.chord)) * self.x(dq) * ufl.dx",
        "return self._resistance(self.x(rates.chord)) * self.x(dq) * ufl.dx",
        (f"{ACTING}::test_damper_takes_out_exactly_its_work",),
    ),
    Fault(
        "windows that end one step late",
        "shellmb/model/joints/switches.py",
        "any(start <= late < end for start, end in w)",
        "any(start <= late <= end + 1 for start, end in w)",
        (f"{ACTING}::test_lock_holds_and_releases",),
    ),
    # loads
    Fault(
        "pressure inwards",
        "forms/loads.py",
        "return p * ufl.dot(ufl.cross(x1, x2), du)",
        "return p * ufl.dot(ufl.cross(x2, x1), du)",
        (f"{LOADS}::test_pressure_is_the_gradient_of_the_volume",),
    ),
    Fault(
        "moments on an edge the other way round",
        "forms/loads.py",
        "return ufl.dot(ufl.cross(moment, d), dd) / ufl.dot(d, d)",
        "return ufl.dot(ufl.cross(d, moment), dd) / ufl.dot(d, d)",
        (f"{LOADS}::test_an_edge_moment_does_work_on_rotations",),
    ),
    Fault(
        "follower forces that do not follow",
        "forms/loads.py",
        "+ components[2] * (surf.D + w)",
        "+ components[2] * surf.D",
        (f"{LOADS}::test_resultants_turn_with_the_shell_or_stay",),
    ),
    Fault(
        "moments on frames by two of their three directors",
        "forms/frame.py",
        "- ufl.dot(dd[b], d[a])) / 2 for a, b in ACROSS]",
        "- ufl.dot(dd[b], d[a])) / 2 for a, b in ((1, 2), (2, 0), (2, 0))]",
        (f"{BEAM_INERTIA}::test_loads_do_the_work_of_their_resultants_on_rigid_velocities",),
    ),
    # bodies in modes
    Fault(
        "moments of what acts on points of modes left out of the balance",
        "shellmb/observers/forces/reactions.py",
        "        self._counted = np.ones(where.stop - where.start)",
        "        self._counted = np.zeros(where.stop - where.start)",
        (f"{MODAL_LOADS}::test_loads_give_a_free_body_their_impulses[ep-0.0]",),
    ),
    Fault(
        "modes of distributed loads left out",
        "shellmb/preprocessing/modal/basis.py",
        "[*self._loads.vectors(), *terms.forces()]",
        "[*terms.forces()]",
        ("tests/reduced/test_recovered.py::test_statics_is_that_of_the_full_body[section0]",),
    ),
    Fault(
        "supports of bodies in modes carried along by them",
        "shellmb/preprocessing/modal/basis.py",
        "return InterfaceModes(frame, -carried[:3] - arm, -carried[3:])",
        "return InterfaceModes(frame, carried[:3] + arm, carried[3:])",
        ("tests/reduced/test_supported.py::test_moves_as_the_full_body_does[hinged around-ep]",),
    ),
    Fault(
        "round-off of loads on what is held as modes",
        "shellmb/preprocessing/modal/ritz.py",
        " if abs(f.dot(v)) * stiffness > NO_MOTION * f.dot(f)]",
        "]",
        (f"{MODAL_LOADS}::test_a_load_on_a_place_that_is_held_bends_nothing",),
    ),
    Fault(
        "loads that turn do not see the deflection",
        "shellmb/preprocessing/modal/loads.py",
        "        found = np.stack([isolated.work(forces, fields) for forces in changed], axis=1)",
        "        found = np.stack([isolated.work(still, fields) for forces in changed], axis=1)",
        (f"{MODAL_LOADS}::test_a_pressure_stays_across_what_it_bends",),
    ),
    # materials and energies
    Fault(
        "discrete gradient without its correction",
        "forms/steps/discrete.py",
        "return tau + factor * scaled",
        "return tau",
        (f"{DISCRETE}::test_the_discrete_gradient_does_the_exact_work",),
    ),
    Fault(
        "bending of a nonlinear material forgotten through the thickness",
        "forms/materials.py",
        "density(strains.eps + z * thickness * strains.kap, strains.gam)",
        "density(strains.eps, strains.gam)",
        (f"{DISCRETE}::test_through_the_thickness_a_quadratic_material_is_the_linear_section",),
    ),
    Fault(
        "twist of beams with the wrong sign",
        "forms/beam.py",
        "return [half(k, m) - half(m, k) for k, m in ACROSS]",
        "return [half(m, k) - half(k, m) for k, m in ACROSS]",
        (f"{BEAM}::test_strains_of_a_helix_in_closed_form",),
    ),
)
