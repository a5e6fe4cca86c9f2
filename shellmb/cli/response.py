"""The command `shellmb response`."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Any

from shellmb.cli.options import (
    OutOption,
    PicturesOption,
    QuietOption,
    SceneArgument,
    SetOption,
    default_directory,
    offers,
)
from shellmb.cli.report import say
from shellmb.options.described import options_of
from shellmb.options.response import LinearOptions, ResponseOptions
from shellmb.options.run import ELEMENTS, Options


@offers(
    *options_of(ResponseOptions),
    *options_of(LinearOptions),
    *options_of(Options, *ELEMENTS, "errors"),
)
def response(
    scene: SceneArgument,
    parameters: SetOption = None,
    out: OutOption = None,
    no_pictures: PicturesOption = False,
    quiet: QuietOption = False,
    **options: Any,
) -> Any:
    """Response of a scene that is linearised: harmonic, random, and to spectra of shocks.

    `shellmb response damped_plate --frequencies 1:50:200`: from its loads to its probes

    `shellmb response my_scene.py --frequencies 1:500:500 --modes 20 --damping 0.02 --psd
    base.z=1e-2`: to random accelerations of ground
    """
    from shellmb.api.responding.respond import response as respond
    from shellmb.running.request import parse_parameters

    plain = {k: v.value if isinstance(v, StrEnum) else v for k, v in options.items() if v}
    directory = out or default_directory(f"{Path(scene).stem}-response")
    chosen = parse_parameters(parameters or [])
    found = respond(scene, directory, parameters=chosen, pictures=not no_pictures, **plain)
    if not quiet:
        say(found.about)
        for name, value in found.numbers.items():
            error = f" +- {found.errors[name]:.2g}" if name in found.errors else ""
            say(f"  {name:32s} {value:.6g}{error}")
        say(f"written: {directory}")
    return found
