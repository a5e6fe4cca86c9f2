"""Checks that nothing is requested that would have no effect, or twice the effect."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from shellmb.errors import SceneError, warn
from shellmb.scene.control.signals import Signal
from shellmb.scene.description import Description
from shellmb.scene.initial import FromMode
from shellmb.scene.schemes import DISSIPATIVE
from shellmb.scene.values.user_functions import on_trial
from shellmb.scene.values.validate import Sentences, listed, said, show

# a step longer than the whole run by less than this fraction of it is round-off
ROUND_OFF = 1e-9
# angles below are hardly degrees
LEAST_DEGREES = 15
# and hardly others than multiples of this are
COMMON_DEGREES = 15
# sizes whose squares are numbers
SPAN = 1e-100, 1e100


def effect_rules(scene: Description, _: Any) -> Sentences:
    """Refuse steps and velocities where there are none, and warn of what has no effect.

    What does no harm, as `alpha` of a scheme without dissipation, is warned of, and so is what is
    given twice.
    """
    low, high = SPAN
    if not low <= scene.dt <= high:
        yield "dt", f"it must be between {low:g} and {high:g}, or its square is no number"
    if scene.dt > scene.t_end * (1 + ROUND_OFF):
        yield "dt", f"it must be at most t_end, which is {show(scene.t_end)}"
    least = scene.step_control.min_dt
    if least is not None and least > scene.dt * (1 + ROUND_OFF):
        yield f"min_dt is {show(least)}; it must be at most dt, which is {show(scene.dt)}"
    if scene.static and scene.initial:
        first = scene.initial[0]
        what = f"{said(first)}: linear is {show(first.linear)} and spin {show(first.spin)}"
        raise SceneError(
            f"{what}; it must be left out, because scheme {show(scene.scheme_name)} has no "
            "velocities as 'ep' and 'ed' have"
        )
    if scene.static and any(isinstance(s, str | FromMode) for s in scene.starts):
        anyway = f"scheme {show(scene.scheme_name)} seeks equilibria anyway"
        yield "start", f"it must be left out, because {anyway}"
    for sentence in _doubts(scene):
        warn(sentence)


def doubts(scene: Description) -> tuple[str, ...]:
    """Warnings given when the scene and its sections were made, for the record of a run."""
    found = [sentence for shell in scene.shells for sentence in shell.section.doubts]
    return tuple(dict.fromkeys([*found, *_doubts(scene)]))


def _doubts(scene: Description) -> list[str]:
    rules = _idle_alpha, _weights, _twice, _degrees
    return [sentence for rule in rules for sentence in rule(scene)]


def _degrees(scene: Description) -> Iterator[str]:
    """Angles in radians that are multiples of 15 degrees, as numbers."""
    found: list[tuple[str, Any]] = []
    for body in scene.rigid_bodies:
        vector = np.asarray(body.rotation, dtype=float)
        if vector.shape == (3,) and np.linalg.norm(vector) > 2.1 * np.pi:
            # no place needs more than a turn
            found += [(f"{said(body)}: rotation", angle) for angle in vector]
    for spring in scene.force_elements:
        if getattr(spring, "joint", None) and scene.coordinates_of(spring)[0] == "rotation":
            angles = (getattr(spring, name, None) for name in ("rest", "lower", "upper"))
            found += [(said(spring), angle) for angle in angles]
    driven: list[Any] = [(s, s.rotation) for s in scene.supports]
    driven += [(driver, driver.rotation) for driver in scene.drivers]
    for item, rotation in driven:
        # on a path it has the load factor, whose end is not that of time
        if callable(rotation) and not isinstance(rotation, Signal) and scene.path is None:
            end, before = (float(on_trial(rotation)(t * scene.t_end)) for t in (1.0, 0.99))
            # what still turns at the end may do so by any number of turns
            if scene.static or end == before:
                found.append((f"{said(item)}: rotation", end))
    for who, angle in found:
        if angle is not None and abs(angle) >= LEAST_DEGREES and abs(angle) % COMMON_DEGREES == 0:
            yield (
                f"{who} is {angle:g} rad, {abs(angle) / (2 * np.pi):.3g} turns; if {angle:g} "
                f"degrees are meant, it must be {np.radians(angle):.4g}"
            )


def _twice(scene: Description) -> Iterator[str]:
    """Loads and contacts that are given twice: they add up."""
    contacts: list[Any] = [replace(contact, name="any") for contact in scene.contacts]
    several: list[Any] = [scene.loads, contacts]
    for items in several:
        for k, item in enumerate(items):
            if item in items[:k]:
                bodies = listed(body.name for body in scene.bodies_of(item))
                yield (
                    f"scene '{scene.name}': two equal {item.label}s act on {bodies}, and add up; "
                    "remove one of them if that is not meant"
                )


def _idle_alpha(scene: Description) -> Iterator[str]:
    """A dissipation for a scheme that has none, or one of its own."""
    if scene.alpha and scene.scheme not in DISSIPATIVE:
        yield (
            f"scene '{scene.name}': alpha={show(scene.alpha)} has no effect: "
            f"{show(scene.scheme_name)} takes no numerical dissipation from the scene; remove "
            "alpha, or use 'ed' or 'ed3'"
        )


def _weights(scene: Description) -> Iterator[str]:
    """In statics bodies need no mass, except under gravity; warns where some have none."""
    for load in scene.weights if scene.static else ():
        light = [body for body in scene.bodies_of(load) if not body.mass_given > 0]
        if len(light) == len(scene.bodies_of(load)):
            raise SceneError(
                f"{said(load)}: it pulls at {', '.join(map(said, light))}, whose mass is 0; give "
                "its section a density, or leave the load out"
            )
        # rigid links without mass are common, sections without density are forgotten
        forgotten = [body.name for body in light if not body.single]
        if forgotten:
            yield (
                f"{said(load)}: it does not pull at {listed(forgotten)}, which has no mass; give "
                "its section a density, or name the body that the load is for"
            )


def check_begin(scene: Description) -> None:
    """In motion supports begin at the given positions: a jump would be an impact.

    Raises:
        SceneError: If a support begins elsewhere.
    """
    if scene.static or any(not isinstance(s, FromMode) for s in scene.starts):
        return
    for support in scene.supports:
        for name, value in support.given.items():
            begin = value(0.0) if callable(value) else value
            if begin is not None and np.any(begin):
                raise SceneError(
                    f"{said(support)}: {name} is {show(begin)} at t = 0; with scheme "
                    f"{show(scene.scheme_name)} it must begin at 0, where the body is, or the "
                    "scene must have start='equilibrium'"
                )
