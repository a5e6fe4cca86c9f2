"""The numbers that say whether to trust a run, in words: what the commands print and pages show."""

from __future__ import annotations

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
    found: dict[str, str] = {}

    def add(name: str, value: str | None) -> None:
        if value is not None:
            found[name] = value

    if not summary:
        return found
    steps, rejected = summary["steps"], summary["rejected_steps"]
    add("failed", summary["failed"])
    add("steps", f"{steps} ({rejected} rejected)" if rejected else str(steps))
    add("iterations per step", f"{summary['newton_iterations'] / max(steps, 1):.2f}")
    for name, event in summary.get("events", {}).items():
        times = ", ".join(f"{t:.6g}" for t in event["times"][:4])
        more = ", ..." if len(event["times"]) > 4 else ""
        add(f"event '{name}'", f"t = {times}{more}" if times else "never")
    add("energy balance error", _power(summary["energy_balance_error"]))
    add("director length error", _power(summary["director_max"]))
    add("constraint error", _power(summary["constraint_max"]))
    add("dissipated by the scheme", _share(summary["dissipated_share"]))
    add("linear momentum drift", _power(summary["linear_momentum_drift"]))
    add("angular momentum drift", _power(summary["angular_momentum_drift"]))
    if summary["wall_per_step_s"] is not None:
        add("wall time per step", f"{1000 * summary['wall_per_step_s']:.1f} ms")
    add("wall time", f"{summary['wall_s']:.1f} s")
    for name, value in summary["results"].items():
        # what is no finite number is null in the file
        add(name, with_error(value) if isinstance(value, Mapping) else _number(value))
    errors = summary.get("errors", {})
    for name, value in errors.get("probes", {}).items():
        add(name, with_error(value))
    for k, remark in enumerate(errors.get("remarks", ())):
        add(f"not in the errors ({k + 1})", remark)
    return found


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
    shown = f"{value:.{digits}f}" if digits < 7 else f"{value:.{_significant(value, last)}e}"
    due = ", ".join(
        f"{name} {part:.1e}" for name, part in parts.items() if part and part > LEAST * error
    )
    return f"{shown} +- {error:.1e} ({due})"


def _significant(value: float, last: int) -> int:
    """Decimals of the mantissa that end at a power of ten."""
    return max(0, (math.floor(math.log10(abs(value))) if value else last) - last)


def _number(value: float | None) -> str:
    return "nan" if value is None else f"{value:.6g}"


def _power(value: float | None) -> str | None:
    return None if value is None else f"{value:.1e}"


def _share(value: float | None) -> str | None:
    return f"{100 * value:.2g} %" if value else None
