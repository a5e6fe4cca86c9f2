"""The numbers that say whether to trust a run, in words: what the commands print and pages show."""

import math
from collections.abc import Mapping
from typing import Any

# errors below this part of a value are of Newton's method and of round-off; parts of an error below
# this part of it are left out
ROUND_OFF, LEAST = 1e-11, 1e-2


def account(summary: Mapping[str, Any]) -> dict[str, str]:
    """Numbers of a summary by what they are; those that do not apply are left out.

    Args:
        summary: The summary of a run; empty while there is none.
    """
    if not summary:
        return {}
    steps, rejected = summary["steps"], summary["rejected_steps"]
    share, wall = summary["dissipated_share"], summary["wall_per_step_s"]
    found = {
        "failed": summary["failed"],
        "steps": f"{steps} ({rejected} rejected)" if rejected else str(steps),
        "iterations per step": f"{summary['newton_iterations'] / max(steps, 1):.2f}",
    }
    for name, event in summary.get("events", {}).items():
        times = ", ".join(f"{t:.6g}" for t in event["times"][:4])
        more = ", ..." if len(event["times"]) > 4 else ""
        found[f"event '{name}'"] = f"t = {times}{more}" if times else "never"
    found |= {
        "energy balance error": _power(summary["energy_balance_error"]),
        "director length error": _power(summary["director_max"]),
        "constraint error": _power(summary["constraint_max"]),
        "dissipated by the scheme": f"{100 * share:.2g} %" if share else None,
        "linear momentum drift": _power(summary["linear_momentum_drift"]),
        "angular momentum drift": _power(summary["angular_momentum_drift"]),
        "wall time per step": None if wall is None else f"{1000 * wall:.1f} ms",
        "wall time": f"{summary['wall_s']:.1f} s",
    }
    errors = summary.get("errors", {})
    for name, value in (*summary["results"].items(), *errors.get("probes", {}).items()):
        # what is no finite number is null in the file
        found[name] = with_error(value) if isinstance(value, Mapping) else _number(value)
    remarks = enumerate(errors.get("remarks", ()), start=1)
    found |= {f"not in the errors ({k})": remark for k, remark in remarks}
    return {name: value for name, value in found.items() if value is not None}


def bands(summary: Mapping[str, Any]) -> dict[str, float]:
    """Errors of the histories of probes (root mean square) by their names, those that are known.

    Args:
        summary: The summary of a run.
    """
    found = summary.get("errors", {}).get("probes", {}).items()
    known = {name.removesuffix(":l2"): v["error"] for name, v in found if name.endswith(":l2")}
    return {name: error for name, error in known.items() if error is not None}


def with_error(found: Mapping[str, float | None]) -> str:
    """A number to the digits that hold, with its error and what that is due to.

    Args:
        found: Value, error, and its parts error_mesh, error_step, ...; None: not known.
    """
    value, error = found["value"], found["error"]
    if found.get("converges") is False:
        return f"{_number(value)} (does not converge)"
    parts = {k.removeprefix("error_"): v for k, v in found.items() if k.startswith("error_")}
    if value is None or error is None:
        unknown = " and ".join(name for name, part in parts.items() if part is None)
        return f"{_number(value)} (error of the {unknown or 'value'} not known)"
    if error <= ROUND_OFF * abs(value):
        return _number(value)
    # two digits of the error, and no more of the value
    last = math.floor(math.log10(error)) - 1
    digits = max(0, -last)
    value = round(value, digits)
    if not value:
        digits = 0
    shown = f"{value:.{digits}f}"
    if digits >= 7:
        shown = f"{value:.{max(0, math.floor(math.log10(abs(value))) - last)}e}"
    due = ", ".join(
        f"{name} {part:.1e}" for name, part in parts.items() if part and part > LEAST * error
    )
    return f"{shown} +- {error:.1e} ({due})"


def _number(value: float | None) -> str:
    return "nan" if value is None else f"{value:.6g}"


def _power(value: float | None) -> str | None:
    return None if value is None else f"{value:.1e}"
