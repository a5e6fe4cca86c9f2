"""Faults of derivatives and their uses, stated errors and their levels; as in `faults`."""

from .faults import Fault

EXACT = "tests/sensitivity/test_exact.py"
FIT = "tests/sensitivity/test_fit.py"
REQUEST = "tests/accuracy/test_request.py"
KINDS = "tests/accuracy/test_kinds.py"

FAULTS: tuple[Fault, ...] = (
    # derivatives, and what is made of them
    Fault(
        "old factors contract as in the step before",
        "shellmb/sensitivity/tangent.py",
        "measured = not lags or len(sizes) > 1",
        "measured = True",
        (
            f"{EXACT}::test_short_contacts_and_stops_have_exact_derivatives_by_default[knock-given0-place]",
        ),
    ),
    Fault(
        "a deviation of zero is refused",
        "shellmb/api/fitting/band.py",
        "np.where(deviations >= 0, deviations, np.nan)",
        "np.where(deviations > 0, deviations, np.nan)",
        (f"{FIT}::test_deviations_are_squared_and_may_be_zero",),
    ),
    Fault(
        "deviations for variances",
        "shellmb/api/fitting/band.py",
        "np.where(deviations >= 0, deviations, np.nan) ** 2)",
        "np.where(deviations >= 0, deviations, np.nan))",
        (f"{FIT}::test_deviations_are_squared_and_may_be_zero",),
    ),
    Fault(
        "ranks by roots of sums",
        "shellmb/api/fitting/rank.py",
        "return float(np.sqrt(np.nanmean(np.square(values.to_numpy(dtype=float)))))",
        "return float(np.nanmean(np.square(values.to_numpy(dtype=float))))",
        (f"{FIT}::test_ranks_of_histories_are_by_root_mean_squares_of_what_is_known",),
    ),
    Fault(
        "ranks by means with the sign",
        "shellmb/api/fitting/rank.py",
        "return float(np.sqrt(np.nanmean(np.square(values.to_numpy(dtype=float)))))",
        "return float(np.nanmean(values.to_numpy(dtype=float)))",
        (f"{FIT}::test_ranks_of_histories_are_by_root_mean_squares_of_what_is_known",),
    ),
    Fault(
        "ranks of what is not known at the start",
        "shellmb/api/fitting/rank.py",
        "return float(np.sqrt(np.nanmean(np.square(values.to_numpy(dtype=float)))))",
        "return float(np.sqrt(np.mean(np.square(values.to_numpy(dtype=float)))))",
        (f"{FIT}::test_ranks_of_histories_are_by_root_mean_squares_of_what_is_known",),
    ),
    # what is said of elements, and the levels of a request
    Fault(
        "levels that may miss their error",
        "shellmb/accuracy/request/choose.py",
        "AIM = 0.8",
        "AIM = 0.9",
        (f"{REQUEST}::test_predictions_leave_a_fifth_of_the_error",),
    ),
    Fault(
        "orders of meshes without caution",
        "shellmb/accuracy/request/choose.py",
        "return min(max(found - CAUTION, 1.0), MESH_ORDER)",
        "return min(max(found + CAUTION, 1.0), MESH_ORDER)",
        (f"{REQUEST}::test_the_order_of_meshes_is_observed_with_some_caution",),
    ),
    Fault(
        "orders of meshes below one",
        "shellmb/accuracy/request/choose.py",
        "return min(max(found - CAUTION, 1.0), MESH_ORDER)",
        "return min(found - CAUTION, MESH_ORDER)",
        (f"{REQUEST}::test_the_order_of_meshes_is_observed_with_some_caution",),
    ),
    Fault(
        "orders of meshes above two",
        "shellmb/accuracy/request/choose.py",
        "return min(max(found - CAUTION, 1.0), MESH_ORDER)",
        "return max(found - CAUTION, 1.0)",
        (f"{REQUEST}::test_the_order_of_meshes_is_observed_with_some_caution",),
    ),
    # errors that are stated
    Fault(
        "differences that do not fall are errors",
        "shellmb/accuracy/estimates.py",
        "return Estimate(error, resolved=falls, converges=falls)",
        "return Estimate(error, resolved=falls)",
        (
            f"{KINDS}::test_a_moment_under_a_point_force_has_no_limit_and_others_have",
            f"{KINDS}::test_what_does_not_converge_ends_a_request",
        ),
    ),
)
