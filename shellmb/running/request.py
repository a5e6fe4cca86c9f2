"""The request for a run in words that can be stored: scene, parameters, options."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from shellmb.errors import SceneError
from shellmb.files.reading import Damaged, read_json, undamaged
from shellmb.files.writing import add_checksum, checksum, is_intact
from shellmb.options.described import of_today
from shellmb.options.run import Options
from shellmb.running.loader import SceneModule, demos, is_file_name, load
from shellmb.scene import Scene

# name in a run directory
REQUEST = "request.json"


@dataclass(frozen=True)
class Request:
    """A scene with parameters and options, as given on the command line.

    Args:
        scene: Name of a demo or path of a Python file.
        parameters: Values of the scene's parameters as text.
        options: Choices that replace those of the scene.
        unchanged: Whether the file that it is from is as the run wrote it.
        scene_sha256: Checksum of the scene's file when that was written; None for a bundled scene.
    """

    scene: str
    parameters: Mapping[str, str] = field(default_factory=dict)
    options: Options = field(default_factory=Options)
    unchanged: bool = field(default=True, compare=False)
    scene_sha256: str | None = field(default=None, compare=False)

    def build(self) -> tuple[Scene, SceneModule]:
        """The scene, and the module that defines it.

        Raises:
            SceneError: If anything about it is wrong.
        """
        module = load(self.scene)
        scene = self.options.apply(module.build(self.parameters))
        return scene, module

    def to_dict(self) -> dict[str, Any]:
        """Plain values with their checksum; the path of a file is absolute, with its own."""
        file = Path(self.scene).resolve() if is_file_name(self.scene) else None
        return add_checksum(
            {
                "scene": self.scene if file is None else str(file),
                "scene_sha256": None if file is None else checksum(file.read_bytes()),
                "parameters": dict(self.parameters),
                # a scheme that is an object has no words: who resumes gives the scene with it
                "options": {
                    f.name: value
                    for f in fields(self.options)
                    if (value := getattr(self.options, f.name)) is not None
                    and (f.name != "scheme" or isinstance(value, str))
                },
            }
        )

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Request:
        """The request from its plain values.

        Raises:
            pydantic.ValidationError: If they are none.
        """
        given = {name: values.get(name) for name in ("scene", "parameters", "options")}
        if isinstance(options := given["options"], dict):
            given["options"] = of_today(Options, options)
        sealed = {"unchanged": is_intact(values), "scene_sha256": values.get("scene_sha256")}
        return TypeAdapter(cls).validate_python(given | sealed)

    def trusted(self, given: str | None, trust: bool) -> Request:
        """The request with a scene that may be executed.

        A run directory may be anybody's, and what it names is a program.

        Args:
            given: The scene as the user names it now.
            trust: Whether the user trusts what the directory names.

        Raises:
            SceneError: If the scene is a file that the user has not named, or another scene.
        """
        named = self.scene
        if given is not None:
            if is_file_name(given) != is_file_name(named):
                raise SceneError(
                    f"resume: the run is of the scene '{named}' and not of '{given}'; name that one"
                )
            return replace(self, scene=given)
        if is_file_name(named) and not trust:
            raise SceneError(
                f"resume: the run directory names {named}, a program to be executed; give its path "
                "behind the directory, or --trust if the directory is yours"
            )
        return self

    def same_file(self) -> bool:
        """Decide whether the scene's file is the one that the run began with."""
        if not is_file_name(self.scene):
            return self.scene_sha256 is None
        file = Path(self.scene)
        return file.is_file() and checksum(file.read_bytes()) == self.scene_sha256


def parse_parameters(items: list[str], flag: str = "--set") -> dict[str, str]:
    """Values of parameters from "name=value" items.

    Args:
        items: They.
        flag: The option that they are of, for messages.

    Raises:
        SceneError: If an item is not of that form.
    """
    values: dict[str, str] = {}
    for item in items:
        name, equals, text = item.partition("=")
        if not (equals and name.strip()):
            raise SceneError(f"{flag} is '{item}'; it must be of the form name=value")
        if name.strip() in values:
            raise SceneError(
                f"{flag} gives {name.strip()} twice, {values[name.strip()]} and {text.strip()}; "
                "one of them must be left out"
            )
        values[name.strip()] = text.strip()
    return values


def read_request(out: Path | str) -> Request:
    """Request of the scene of a run directory.

    Args:
        out: The run directory.

    Raises:
        SceneError: If the directory does not say, or not in a form that can be used.
    """
    file = Path(out) / REQUEST
    if not file.is_file():
        raise SceneError(
            f"resume: there is no {file}; give a directory made by `shellmb run`, or resume it "
            "from Python with the scene"
        )
    try:
        with undamaged(file):
            request = Request.from_dict(read_json(file))
    except Damaged as error:
        raise SceneError(_unreadable(str(error))) from None
    if not is_file_name(request.scene) and request.scene not in demos():
        raise SceneError(_unreadable(f"{file} names the scene '{request.scene}', which is none"))
    return request


def scene_of_run(
    out: Path | str, command: str, given: str | None = None
) -> tuple[Scene, SceneModule]:
    """The scene of a run, as it was requested.

    Args:
        out: The run directory.
        command: What wants it, for messages.
        given: The scene as the user names it; None: one that is bundled.

    Raises:
        SceneError: If it is no such run: files are programs that a directory must not name.
    """
    try:
        request = read_request(out)
        request = request if given is None else request.trusted(given, False)
    except SceneError as error:
        raise SceneError(str(error).replace("resume: ", f"{command}: ", 1)) from None
    if given is None and is_file_name(request.scene):
        raise SceneError(
            f"{command}: the run in {out} is of {request.scene}, a program to be executed; name it "
            f"as the scene, and {out} as the state"
        )
    return request.build()


def resume_command(out: Path, request: Request | None) -> str:
    """The command that goes on with a run.

    Args:
        out: Its directory.
        request: How its scene was requested; None: from Python.
    """
    named = "" if request is None or not is_file_name(request.scene) else f" {request.scene}"
    return f"`shellmb resume {out}{named}`"


def _unreadable(what: str) -> str:
    return (
        f"resume: {what}; the state may be whole: continue from Python with "
        "`sm.resume(directory, scene)`"
    )
