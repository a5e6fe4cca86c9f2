"""Analyses beside runs, about their motions and states."""

from __future__ import annotations

from shellmb.demos.effects.effect import Effect, fixed, refuse

_GROUP = "beside runs"


def _modes(name: str, title: str, command: str) -> Effect:
    return Effect(
        name,
        _GROUP,
        title,
        fixed(False, f"`{command}` has it, no run"),
        refuse("no run has it"),
        refuse(f"a run cannot have it; ask for it with `{command}`"),
    )


EFFECTS = (
    _modes(
        "modes_in_rotation",
        "complex modes about steady rotations: gyroscopic, centrifugal, damping terms",
        "shellmb modes SCENE --rate RATES",
    ),
    _modes(
        "modes_of_states",
        "complex modes about states of runs, with their accelerations and forces",
        "shellmb modes RUN_DIR --at TIME",
    ),
    _modes(
        "linear_buckling",
        "load factors of linear buckling: eigenvalues of the geometric stiffness",
        "shellmb modes SCENE --buckling",
    ),
)
