"""The observers of a run: they look, and what they cost is time."""

from __future__ import annotations

from dataclasses import replace

from shellmb.demos.effects.effect import Effect, Use, fixed, refuse, whole
from shellmb.scene import Scene

_GROUP = "observers"
_STANDARD = (
    "every run has it, for its summary; without it a run must be one of your own, with "
    "Simulation(scene).run(observers)"
)
_RUN = "every run has it"
_FILES = "`shellmb run` has it, execute(scene, out=None) does not"


def _probes(scene: Scene) -> Use:
    return Use(bool(scene.probes), f"probes has {len(scene.probes) or 'none'}")


def _joints(scene: Scene) -> Use:
    return Use(bool(scene.joints), f"joints has {len(scene.joints) or 'none'}")


def _standard(name: str, title: str) -> Effect:
    always = refuse("every run has it")
    return Effect(
        f"observe_{name}", _GROUP, title, fixed(True, _RUN), refuse(_STANDARD), always, (), name
    )


def _writer(name: str, title: str) -> Effect:
    why = (
        "it is there where a directory is written; without it a run must be one from Python: "
        "execute(scene, out=None)"
    )
    always = refuse("every run that writes has it")
    return Effect(
        f"observe_{name}", _GROUP, title, fixed(True, _FILES), refuse(why), always, (), name
    )


EFFECTS = (
    _standard("energy", "energies and the balance of work"),
    _standard("constraints", "largest violations"),
    _standard("momentum", "linear and angular momentum"),
    Effect(
        "observe_probes",
        _GROUP,
        "values at points",
        _probes,
        whole(lambda scene: replace(scene, probes=())),
        refuse("its point must be given: add a Probe to the scene's probes"),
        (),
        "probes",
    ),
    Effect(
        "observe_joints",
        _GROUP,
        "forces and coordinates of joints",
        _joints,
        refuse("it is present if the scene has joints"),
        refuse("there is no joint; the scene must have one"),
        (),
        "joints",
    ),
    _standard("history", "the table of all of them"),
    _writer("frames", "fields for ParaView, pictures and animation"),
    _writer("checkpoint", "the last good state"),
)
