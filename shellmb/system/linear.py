"""Direct solver of the linear systems, and its failures in words."""

from petsc4py import PETSc

# MUMPS estimates the workspace of the factorisation from the pattern; a saddle point needs far more
WORKSPACE_PERCENT = 400

# icntl_6 = 0: the analysis, done once per structure, depends on the pattern alone and not on the
# values that
# happen to be in the matrix, so that a resumed run orders its unknowns as the first one did
MUMPS_OPTIONS: dict[str, int] = {
    "mat_mumps_icntl_14": WORKSPACE_PERCENT,
    "mat_mumps_icntl_6": 0,
}


# of a small system the estimate is a few kilobytes, and delayed pivots may need many times that
SMALL_SYSTEM, SMALL_WORKSPACE_PERCENT = 5000, 20_000


def direct_solver(ksp: PETSc.KSP, prefix: str, size: int) -> None:
    """Set a Krylov solver up as a direct one (MUMPS LU).

    Args:
        ksp: Solver to set up.
        prefix: Options prefix, unique per system.
        size: Number of unknowns.
    """
    ksp.setOptionsPrefix(prefix)
    options = PETSc.Options()
    for key, value in MUMPS_OPTIONS.items():
        options[prefix + key] = value
    if size < SMALL_SYSTEM:
        options[prefix + "mat_mumps_icntl_14"] = SMALL_WORKSPACE_PERCENT
    ksp.setType(PETSc.KSP.Type.PREONLY)
    pc = ksp.getPC()
    pc.setType(PETSc.PC.Type.LU)
    pc.setFactorSolverType("mumps")
    # a system that is never factorised uses none of them, which is no reason for a warning
    options["options_left"] = 0
    # the options stay: MUMPS reads them at each first factorisation of a structure, not here
    ksp.setFromOptions()


def failure(ksp: PETSc.KSP) -> str | None:
    """Why the last factorisation failed, or None if it did not; the next one starts afresh."""
    if ksp.getConvergedReason() >= 0:
        return None
    reason = _reason(ksp)
    # a factor that failed once is not tried again
    ksp.getPC().reset()
    return reason


def _reason(ksp: PETSc.KSP) -> str:
    try:
        infog = ksp.getPC().getFactorMatrix().getMumpsInfog(1)
    except PETSc.Error:
        return "the linear solver failed"
    reasons = {
        -10: "the matrix is singular: a body can move freely, or constraints are redundant",
        -9: "the direct solver ran out of workspace",
        -13: "the direct solver could not allocate memory",
    }
    return reasons.get(infog, f"the direct solver failed (MUMPS INFOG(1) = {infog})")
