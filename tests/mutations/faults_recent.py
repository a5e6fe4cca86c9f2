"""Faults of rotations of joints, tolerances, tension, files, studies, damping; as in `faults`."""

from .faults import Fault

TENSION = "tests/beams/test_tension.py"
ALONG = "tests/reduced/test_forces_along.py"
SMALL = "tests/modes/test_small_strains.py"
TURNS = "tests/mechanisms/test_turns.py"
IN_UNITS = "tests/mechanisms/test_units_of_constraints.py"
WHOLE = "tests/observers/test_whole_turns.py"
CONCAVE = "tests/schemes/test_concave.py::test_what_is_pushed_off_a_hill_gains_no_energy"
PULLS = "tests/contact/test_damped.py"
VOLUMES = "tests/model/test_volumes.py"
VALUES = "tests/kernels/test_values.py"
QUANTITY = "tests/study/test_quantity.py"

FAULTS: tuple[Fault, ...] = (
    # beams in tension
    Fault(
        "axial strain of a beam without its square",
        "forms/beam.py",
        "return ufl.dot(a.x1, b.x1)",
        "return ufl.dot(a.d[0], b.x1) + ufl.dot(b.d[0], a.x1)",
        (f"{TENSION}::test_large_tension_and_compression[1.5-axis]",),
    ),
    Fault(
        "tension at a line beside that of the centre",
        "forms/beam.py",
        "carried = [c3 * turns[1] - c2 * turns[2], -c3 * turns[0], c2 * turns[0]]",
        "carried = [c3 * turns[1] + c2 * turns[2], -c3 * turns[0], c2 * turns[0]]",
        (f"{TENSION}::test_offsets_are_exact_twins[static-2-exact]",),
    ),
    Fault(
        "resultants of a stretched beam as work sees them",
        "forms/beam.py",
        "along_d1 = ufl.sqrt(1 + 2 * g1 / r1",
        "along_d1 = ufl.sqrt(1 + 0 * g1 / r1",
        (f"{TENSION}::test_large_tension_and_compression[1.5-axis]",),
    ),
    # bodies with small strains
    Fault(
        "loaded modes of small strains without a word on forces",
        "shellmb/diagnostics/modes.py",
        "if share > STIFFENED]",
        "if share > 1e3]",
        (f"{SMALL}::test_what_is_said_is_what_beck_has_otherwise[modal]",),
    ),
    Fault(
        "compression of bodies with small strains in statics",
        "shellmb/preprocessing/modal/tangent.py",
        "np.max(-lowest, initial=0.0)",
        "np.max(lowest, initial=0.0)",
        (
            f"{SMALL}::test_what_is_compressed_says_so_where_stability_is_counted[linear-beam]",
            f"{SMALL}::test_what_is_compressed_says_so_where_stability_is_counted[modal-beam]",
        ),
    ),
    Fault(
        "forces along the second axis of a shell with the other sign in squares of rotations",
        "forms/floating/frame.py",
        "+ N[1] * (t2**2 + turn**2)",
        "- N[1] * (t2**2 + turn**2)",
        (f"{ALONG}::test_forces_work_on_rotations",),
    ),
    Fault(
        "shear forces of a shell once in squares of rotations",
        "forms/floating/frame.py",
        "2 * N[2] * t1 * t2",
        "N[2] * t1 * t2",
        (f"{ALONG}::test_forces_work_on_rotations",),
    ),
    Fault(
        "rotations about the normal without work of forces along a shell",
        "forms/floating/frame.py",
        "N[0] * (t1**2 + turn**2)",
        "N[0] * (t1**2)",
        (f"{ALONG}::test_forces_work_on_rotations",),
    ),
    Fault(
        "what a joint may hold as a clamp does is as stiff as what is free",
        "shellmb/preprocessing/modal/isolated.py",
        "CLAMPED = 6.36",
        "CLAMPED = 6.26",
        (f"{ALONG}::test_a_beam_at_a_joint_is_as_soft_as_a_cantilever[True-3.516]",),
    ),
    Fault(
        "the negative load factor farthest from zero",
        "shellmb/simulate/buckling.py",
        "max(negative, default=None)",
        "min(negative, default=None)",
        ("tests/modes/test_buckling.py::test_a_plate_in_shear_buckles_under_either_sign",),
    ),
    Fault(
        "loaded states whose dampers are left out",
        "shellmb/running/natural_modes/vibration.py",
        "if state is None or not resisting:",
        "if state is None or resisting:",
        ("tests/modes/test_loaded_damping.py::test_a_mass_under_its_weight",),
    ),
    Fault(
        "rotors without gyroscopic terms in a frame that stands",
        "shellmb/running/rotating/linearised.py",
        "derivative(2 * spun, q)",
        "derivative(0 * spun, q)",
        ("tests/rotating/test_spinning.py::test_rotors_in_bearings_that_differ[ep4-False]",),
    ),
    Fault(
        "paths that do not end on what is prescribed",
        "shellmb/system/newton/bordered.py",
        "system.x.array[:] += missing",
        "system.x.array[:] += 0 * missing",
        ("tests/simulate/test_given_paths.py::test_each_row_has_what_is_prescribed[shell-steep]",),
    ),
    Fault(
        "complex pairs of multipliers among modes",
        "shellmb/system/eigenvalues.py",
        "LARGE, INFINITE = 1e3, 1e12",
        "LARGE, INFINITE = 1e12, 1e12",
        (f"{SMALL}::test_what_is_said_is_what_beck_has_otherwise[modal]",),
    ),
    # rotations of joints
    Fault(
        "starts from another run modulo whole turns",
        "shellmb/simulate/start/initial_state.py",
        "group.begin(q)",
        "pass",
        ("tests/simulate/test_start_turns.py::test_one_more_spring_leaves_the_other_wound",),
    ),
    Fault(
        "rotations of joints modulo whole turns",
        "forms/constraints/coordinates.py",
        "return x - before - increment(start, cosine_sine(a, b))",
        "return increment(cosine_sine(a, b), ufl.as_vector([ufl.cos(x), ufl.sin(x)]))",
        # a good first guess hides it where the coordinate goes on
        ("tests/simulate/test_start_turns.py::test_one_more_spring_leaves_the_other_wound",),
    ),
    Fault(
        "a joint may turn by half a turn in a step",
        "shellmb/simulate/stepping.py",
        "if rate * dt >= math.pi:",
        "if rate * dt >= 9 * math.pi:",
        (f"{TURNS}::test_half_a_turn_a_step_is_cut[ep-0.0]",),
    ),
    Fault(
        "turns of probes that are counted one way only",
        "shellmb/observers/probes.py",
        "along = -1 if self._turns and way @ self._axis < 0 else 1",
        "along = 1",
        (f"{WHOLE}::test_turns_about_an_axis_that_stays[-0.7]",),
    ),
    Fault(
        "rotation vectors of what tumbles that are those of another rotation",
        "shellmb/observers/probes.py",
        "round(float(axis @ counted - size) / TURN) * axis",
        "self._turns * self._axis",
        (f"{WHOLE}::test_a_rotation_vector_is_that_of_three_points[ep4-turned0]",),
    ),
    # tolerances
    Fault(
        "directions in parts of the scene's length",
        "shellmb/model/joints/constraints.py",
        "np.abs(violations) / self.sizes, 0.0)",
        "np.abs(violations) / max(self.sizes), 0.0)",
        (f"{IN_UNITS}::test_the_largest_constraint_error_counts_what_was_dropped[1000000.0]",),
    ),
    # springs and contact
    Fault(
        "springs on a hill give energy in ED",
        "forms/steps/potentials.py",
        "return stress + beta / 2 * convex(gradient(U, b) - gradient(U, a), increment)",
        "return stress + beta / 2 * (gradient(U, b) - gradient(U, a))",
        (f"{CONCAVE}[0.2-ed-1.0-on_rail]",),
    ),
    Fault(
        "springs on a hill give energy in ED3",
        "forms/steps/potentials.py",
        "damping = alpha / 2 * convex(ufl.dot(curvature(U, e), e.bow), e.bow)",
        "damping = alpha / 2 * ufl.dot(curvature(U, e), e.bow)",
        (f"{CONCAVE}[0.2-ed3-1.0-on_rail]",),
    ),
    Fault(
        "damped contact that attracts",
        "forms/contact.py",
        "return normal * ufl.conditional(ufl.gt(share, -1), share, -1)",
        "return normal * share",
        (
            f"{PULLS}::test_contact_never_pulls[plane-ep-0.0]",
            f"{PULLS}::test_stops_never_pull[ep-0.0]",
        ),
    ),
    # damping of modes, and what a controller aims at
    Fault(
        "damping of modes without couplings",
        "shellmb/model/reduced/floating_body.py",
        "NOTHING = 1e-9",
        "NOTHING = 0.999",
        ("tests/reduced/test_couplings.py::test_complex_modes_of_a_body_in_modes",),
    ),
    Fault(
        "a target that moves is taken as one that stands",
        "shellmb/scene/control/controllers.py",
        "rate = self.kd * (moving - float(readings[1]))",
        "rate = self.kd * (0 * moving - float(readings[1]))",
        ("tests/control/test_laws.py::test_pid_follows_a_target_that_moves[0.0]",),
    ),
    # studies and tables
    Fault(
        "means over steps stand at the ends of steps",
        "shellmb/accuracy/studies/quantity.py",
        "t = (t[1:] + t[:-1]) / 2\n",
        "t = t[1:]\n",
        (f"{QUANTITY}::test_means_over_steps_stand_at_their_middles",),
    ),
    Fault(
        "a mesh that all runs have is refined",
        "shellmb/accuracy/studies/sweep.py",
        "len({(c.mesh, c.divide) for c in runs}) == 1:",
        "len({(c.mesh, c.divide) for c in runs}) == 0:",
        ("tests/study/test_sweep.py::test_what_is_not_refined_is_named",),
    ),
    Fault(
        "numbers that do not fit are cut",
        "shellmb/accuracy/measuring.py",
        "        table.width = natural\n",
        "        table.width = to.width\n",
        ("tests/measuring/test_measuring.py::test_no_number_is_cut[20]",),
    ),
    Fault(
        "doubts about a scene are on stderr only",
        "shellmb/running/execute.py",
        "before = setup_warnings([*ignored_settings.doubts(scene), *simulation.doubts])",
        "before = doubted(simulation.doubts)",
        (
            "tests/diagnostics/test_run_warnings.py::"
            "test_doubts_about_a_scene_are_in_the_record_of_its_run",
        ),
    ),
    # files
    Fault(
        "folds that are too sharp",
        "shellmb/meshes/directors.py",
        "STEEPEST = 47.5",
        "STEEPEST = 89.0",
        (
            "tests/meshes/test_folds.py::"
            "test_folds_beyond_a_right_angle_are_refused_where_they_are[0.001-0-quad]",
        ),
    ),
    Fault(
        "seams that are joined in one unit only",
        "shellmb/meshes/files/joined.py",
        "near = away <= part * room",
        "near = away <= part * 1e-4",
        ("tests/meshes/test_gaps.py::test_seams_are_joined[1.0-None-1e-06-quad]",),
    ),
    Fault(
        "forces of joints in the unit of statics, taken by a model of motions",
        "shellmb/running/natural_modes/vibration.py",
        "checked_model(scene.with_options(scheme=SIMPLEST), comm, static.model.force)",
        "checked_model(scene.with_options(scheme=SIMPLEST), comm)",
        (
            "tests/modes/test_loaded_mechanisms.py::test_a_pendulum_swings_by_its_weight[0.2]",
            "tests/modes/test_loaded_mechanisms.py::test_a_force_that_keeps_its_direction"
            "[1.0-1.0-1.0]",
        ),
    ),
    # what nobody asked for, and what is not the same
    Fault(
        "gmsh runs programs that lie beside a mesh",
        "shellmb/meshes/surfaces/gmsh_mesh.py",
        "if path.suffix.lower() == PROGRAM:",
        "if path.suffix == path.suffix.lower():",
        ("tests/meshes/test_files.py::test_programs_beside_a_mesh_are_not_run[msh]",),
    ),
    Fault(
        "libraries that others can write are loaded",
        "shellmb/native/compiling/folder.py",
        "if others or status",
        "if status",
        ("tests/attack/test_caches.py::test_a_cache_that_others_can_write_is_refused[511]",),
    ),
    Fault(
        "ranks have functions of time of their own",
        "shellmb/model/rank_consistency.py",
        "apart = most - least > CLOSE",
        "apart = most - least > 1 / CLOSE",
        (
            "tests/attack/test_ranks.py::"
            "test_functions_that_ask_for_their_rank_are_refused_on_all_ranks",
        ),
    ),
    Fault(
        "splines of two scenes are one",
        "shellmb/scene/fingerprint.py",
        "values = {**_slots(value), **getattr",
        "values = {**getattr",
        ("tests/attack/test_memory.py::test_scenes_are_told_apart_by_what_their_laws_hold",),
    ),
    Fault(
        "directions of elements are left out",
        "shellmb/meshes/files/nastran.py",
        "if given.isdigit() or real(card, offset - 1) != 0:",
        "if given.isdigit():",
        ("tests/meshes/test_decks.py::test_directions_of_elements_are_refused",),
    ),
    # volumes
    Fault(
        "volumes turn what they fill",
        "shellmb/model/potentials/volume.py",
        "traits.keeps_angular_momentum and not differ(normals)",
        "traits.keeps_angular_momentum and differ(normals)",
        (f"{VOLUMES}::test_ep_keeps_the_angular_momentum_of_what_is_filled[filling0]",),
    ),
    Fault(
        "a kernel for each exponent of a gas",
        "shellmb/model/potentials/volume.py",
        "self.constant(gas.exponent - 1)",
        "gas.exponent - 1",
        (f"{VALUES}::test_values_are_in_no_kernel[enclosed_volume]",),
    ),
    Fault(
        "another kernel where lengths are one",
        "shellmb/model/massless.py",
        "if 0 < len(directions) < count:",
        "if len(set(sizes)) > 1:",
        (f"{VALUES}::test_kernels_stay_where_the_scene_is_of_length_one",),
    ),
    Fault(
        "volumes of another scheme are no start",
        "shellmb/simulate/start/initial_state.py",
        "body not in following",
        "body not in model.mechanism.bodies",
        (f"{VOLUMES}::test_a_motion_goes_on_in_another_scheme_or_filled_anew[ep4-ep]",),
    ),
    Fault(
        "paths land on load levels to 1e-9 only",
        "shellmb/simulate/paths/levels.py",
        "if near and (before or not missing):",
        "if near:",
        ("tests/hard/test_starts.py::test_bent_by_heat_and_ground_it_stays_at_rest[ep-0.0-SI]",),
    ),
    Fault(
        "edges that move as frames are held over any distance",
        "shellmb/model/frames/rigid_from_mesh.py",
        "        edges_together(joint, first, second)",
        "        pass",
        ("tests/mechanisms/test_edge_hinges.py::test_edges_of_frames_apart[models0]",),
    ),
    Fault(
        "planes across a path do not turn with a parameter",
        "shellmb/sensitivity/paths.py",
        "missing = dot(normal, d_start - d + a) - dot(tilt, u - u_start)",
        "missing = dot(normal, d_start - d + a)",
        ("tests/sensitivity/test_paths.py::test_points_of_a_path_have_exact_derivatives",),
    ),
    Fault(
        "bifurcations do not move along the path",
        "shellmb/sensitivity/paths.py",
        "self._slope[name] = delta + shift * ahead.rate",
        "self._slope[name] = delta",
        (
            "tests/sensitivity/test_paths.py::"
            "test_bifurcations_have_the_derivatives_of_their_closed_form[detect]",
        ),
    ),
    # slow modes, and starts
    Fault(
        "what is slow beside bending is zero",
        "shellmb/running/rotating/quadratic.py",
        "MIXED, TILTED = 1e-8, 3e-5",
        "MIXED, TILTED = 1e-3, 1e-3",
        (
            "tests/rotating/test_soft_mounts.py::test_a_plate_that_hardly_bends_swings_by_its_weight",
        ),
    ),
    Fault(
        "a step in which masses hold everything ends at rest",
        "shellmb/simulate/start/consistent.py",
        "(moved <= HELD * fastest * tau**2 or tau >= long)",
        "True",
        ("tests/mechanisms/test_start.py::test_an_equilibrium_does_not_depend_on_the_step[1e-08]",),
    ),
    Fault(
        "multipliers of directors that joints act on go with the cell",
        "shellmb/simulate/problem.py",
        "return declared.multipliers[joined].ravel()",
        "return declared.multipliers[:0].ravel()",
        ("tests/mechanisms/test_rolling.py::test_flexible_bodies_on_wheels_in_ed",),
    ),
    Fault(
        "forces are judged without the torques beside them",
        "shellmb/diagnostics/unknown_forces.py",
        "largest = max(force, torque / length)",
        "largest = force",
        (
            "tests/diagnostics/test_alternating.py::"
            "test_forces_that_torques_do_not_need_are_round_off",
        ),
    ),
)
