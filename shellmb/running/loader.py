"""Scenes by name or file: bundled demos and users' Python files.

A scene module defines `scene(**parameters) -> Scene` with defaults for all parameters; the first
line of its docstring says what it is. It may define `results(run) -> dict[str, float]`, what the
scene measures, `mode_results(modes)`, the same for natural modes, and `check(results)`, which
asserts reference values of either.
"""

import importlib
import importlib.util
import inspect
import pkgutil
import re
import sys
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from pydantic import PydanticUserError, TypeAdapter, ValidationError

from shellmb.errors import SceneError, ShellmbError
from shellmb.running.error_origin import in_words, user_failures, user_frame
from shellmb.scene import Scene
from shellmb.scene.lookup import listed

DEMOS = "shellmb.demos"
# kinds of demos, in the order in which to look at them, and of those that say nothing
KINDS = (
    "start here",
    "statics and paths",
    "vibrations and motion",
    "mechanisms",
    "examples of the paper",
    "forms of your own",
)
OTHERS = "others"


@dataclass(frozen=True)
class SceneModule:
    """A module that defines a scene.

    Args:
        name: Name of the demo, or of the file without its ending.
        module: The module, or what has its names.
    """

    name: str
    module: types.ModuleType | types.SimpleNamespace

    @property
    def results(self) -> Callable[..., dict[str, float]] | None:
        """Function of results of the scene, if it has one."""
        return getattr(self.module, "results", None)

    @property
    def mode_results(self) -> Callable[..., dict[str, float]] | None:
        """Function of results of the scene's natural modes, if it has one."""
        return getattr(self.module, "mode_results", None)

    @property
    def check(self) -> Callable[[dict[str, float]], None] | None:
        """Assertions on the results, if there are any."""
        return getattr(self.module, "check", None)

    def require_check(self, measured: Callable[..., Any] | None, what: str) -> None:
        """Refuse to check a scene that says nothing to be checked, before it is run.

        Args:
            measured: What gives the results to be checked.
            what: How it is called, for the error.

        Raises:
            SceneError: If the scene has no check, or no such results.
        """
        if sys.flags.optimize:
            raise SceneError(
                f"scene '{self.name}': --check needs the assertions of its check(results), which "
                "Python leaves out by PYTHONOPTIMIZE or -O; run it without"
            )
        if self.check is None or measured is None:
            missing = "check(results)" if self.check is None else what
            raise SceneError(
                f"scene '{self.name}': there is nothing to check, because it defines no {missing}; "
                "--check must be left out"
            )

    @property
    def parameters(self) -> dict[str, inspect.Parameter]:
        """Parameters of the scene."""
        return parameters_by_name(self.module.scene, f"scene '{self.name}'")

    def build(self, values: Mapping[str, str] | None = None) -> Scene:
        """Make the scene.

        Args:
            values: Values of parameters as text, converted to the parameters' types.

        Raises:
            SceneError: If a parameter is unknown, a value does not fit, or the scene is impossible.
        """
        converted = {name: self.value(name, text) for name, text in (values or {}).items()}
        who = f"scene '{self.name}'"
        check_values(self.module.scene, converted, who, "--set {name}=VALUE")
        return scene_of(self.module.scene, converted, who, "scene()")

    def value(self, name: str, text: str) -> Any:
        """The value that a text means for a parameter.

        Raises:
            SceneError: If the parameter is unknown, or the text does not fit it.
        """
        known = self.parameters
        if name not in known:
            has = f"its parameters are {listed(known)}" if known else "it has no parameters"
            raise SceneError(f"scene '{self.name}': there is no parameter '{name}'; {has}")
        says = f"scene '{self.name}': the types of its parameters cannot be determined"
        with user_failures(SceneError, says):
            hint = typing.get_type_hints(self.module.scene).get(name)
        if hint is None:
            default = known[name].default
            plain = default is None or default is inspect.Parameter.empty
            hint = str if plain else type(default)
        # a tuple is written with commas
        several = typing.get_origin(hint) in (tuple, list) or hint in (tuple, list)
        value: Any = [part.strip() for part in text.split(",")] if several else text
        try:
            return TypeAdapter(hint).validate_python(value)
        except ValidationError:
            raise SceneError(
                f"scene '{self.name}': {name} is '{text}'; it must be {_in_words(hint)}"
            ) from None
        except PydanticUserError:
            raise SceneError(
                f"scene '{self.name}': {name} is '{text}', and no text can be {_in_words(hint)}; "
                "give the parameter a type that text can be made of, or set it from Python"
            ) from None


def _in_words(hint: Any) -> str:
    """Describe what a value of a type is."""
    if typing.get_origin(hint) is typing.Literal:
        return " or ".join(f"'{choice}'" for choice in typing.get_args(hint))
    kinds = {float: "a number", int: "a whole number", bool: "true or false"}
    return kinds.get(hint, f"of type {getattr(hint, '__name__', hint)}")


def _sources() -> dict[str, str]:
    """Texts of the bundled scenes by name."""
    folder = importlib.import_module(DEMOS).__path__
    modules = [info for info in pkgutil.iter_modules(folder) if not info.ispkg]
    names = [info.name for info in modules if not info.name.startswith("_")]
    found = {name: Path(folder[0], f"{name}.py").read_text() for name in names}
    # without a scene it is a program, to be read and run by itself; to parse them takes 0.1 s
    return {name: source for name, source in found.items() if "\ndef scene(" in source}


def demos() -> dict[str, str]:
    """Names of the bundled scenes, each with its line of description; imports none of them."""
    first = {name: source.strip('"').partition("\n")[0] for name, source in _sources().items()}
    return {name: line.removesuffix('"""') for name, line in first.items()}


def kinds() -> dict[str, list[str]]:
    """Names of the bundled demos by their kind, in the order in which to look at them.

    A demo says what it is in a line `# KIND: mechanisms`.
    """
    found: dict[str, list[str]] = {kind: [] for kind in KINDS}
    for name, source in _sources().items():
        said = re.search(r"^# KIND: (.*)$", source, re.MULTILINE)
        found.setdefault(said[1] if said else OTHERS, []).append(name)
    return {kind: names for kind, names in found.items() if names}


def is_file_name(name: str) -> bool:
    """Decide whether a scene is named by the path of a file.

    Args:
        name: What a user calls it.
    """
    return name.endswith(".py") or "/" in name


def load(name: str) -> SceneModule:
    """A scene by the name of a demo or the path of a Python file.

    Args:
        name: Name or path.

    Raises:
        SceneError: If there is no such scene, or its file does not define one.
    """
    if is_file_name(name):
        loaded = SceneModule(Path(name).stem, _module_of_file(Path(name)))
    elif name in (known := demos()):
        loaded = SceneModule(name, importlib.import_module(f"{DEMOS}.{name}"))
    else:
        near = " or ".join(f"'{n}'" for n in get_close_matches(name, known, 2))
        raise SceneError(
            f"there is no scene '{name}'{f'; did you mean {near}?' if near else ';'} `shellmb "
            "list` has all; or give the path of a Python file"
        )
    if not callable(getattr(loaded.module, "scene", None)):
        raise SceneError(f"'{name}' defines no function scene(); it must define one")
    return loaded


def given(scene: Scene | Callable[..., Scene], parameters: Mapping[str, Any]) -> SceneModule:
    """A scene that somebody has at hand, or a function that makes it, as a module would define it.

    Args:
        scene: The scene, or the function.
        parameters: Values of the function's parameters.

    Raises:
        SceneError: If a scene that is made already comes with parameters, or is impossible.
    """
    if isinstance(scene, Scene):
        if parameters:
            raise SceneError(
                f"scene '{scene.name}': parameters are {', '.join(parameters)}; they must be left "
                "out where the scene is made already"
            )
        name, make = scene.name, lambda: scene
    else:
        name, make = getattr(scene, "__name__", "scene"), lambda: scene(**parameters)
    module = types.SimpleNamespace(scene=make)
    module.results = SceneModule(name, module).build().results
    return SceneModule(name, module)


def check_function(scene: Any, who: str) -> None:
    """Check that what is no name of a scene is a function that may make one.

    Args:
        scene: What is given.
        who: Start of an error.

    Raises:
        SceneError: If it is a scene that is made already, or cannot be called.
    """
    if isinstance(scene, Scene) or not callable(scene):
        raise SceneError(
            f"{who}: scene is a {type(scene).__name__}; it must be a function that makes a Scene "
            "from its parameters, the name of a bundled scene, or the path of a Python file"
        )


def parameters_by_name(make: Callable[..., Any], who: str) -> dict[str, inspect.Parameter]:
    """Parameters of a function that can be given by name.

    Args:
        make: The function.
        who: Start of an error.

    Raises:
        SceneError: If it is no function, or one whose parameters Python does not tell.
    """
    try:
        known = inspect.signature(make).parameters
    except (TypeError, ValueError):
        raise SceneError(
            f"{who}: scene is {make!r:.60}; it must be a function that makes a Scene from its "
            "parameters, with `def`"
        ) from None
    unnamed = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.VAR_POSITIONAL)
    return {name: p for name, p in known.items() if p.kind not in unnamed}


def check_names(make: Callable[..., Any], names: Iterable[str], who: str) -> None:
    """Check that a function has parameters of some names.

    Args:
        make: The function.
        names: The names.
        who: Start of an error.

    Raises:
        SceneError: If it lacks one.
    """
    known = parameters_by_name(make, who)
    if any(p.kind is p.VAR_KEYWORD for p in known.values()):
        return
    for name in names:
        if name not in known:
            has = listed(known) or "none"
            raise SceneError(f"{who} has no parameter '{name}'; it has {has}")


def check_values(
    make: Callable[..., Any], values: Iterable[str], who: str, how: str = "values={{'{name}': ...}}"
) -> None:
    """Check that all parameters of a function have values.

    Args:
        make: The function.
        values: Names of the parameters to which values are given.
        who: Start of an error.
        how: How to give one, with its `{name}`.

    Raises:
        SceneError: If one has neither a default nor a value.
    """
    given = set(values)
    for name, p in parameters_by_name(make, who).items():
        if p.default is p.empty and p.kind is not p.VAR_KEYWORD and name not in given:
            raise SceneError(
                f"{who}: its parameter '{name}' has no default; give it one, or a value by "
                + how.format(name=name)
            )


def scene_of(make: Callable[..., Any], values: Mapping[str, Any], who: str, called: str) -> Scene:
    """The scene that a function makes.

    Args:
        make: The function.
        values: Values of its parameters.
        who: Start of an error.
        called: What the error calls the function.

    Raises:
        SceneError: If the scene is impossible, or the function raises, or returns something else.
    """
    with user_failures(SceneError, f"{who}: {called} fails"):
        made = make(**values)
    if not isinstance(made, Scene):
        raise SceneError(f"{who}: {called} returns {type(made).__name__}; it must return a Scene")
    return made


def _module_of_file(path: Path) -> types.ModuleType:
    path = path.resolve()
    if not path.is_file():
        raise SceneError(f"there is no file {path}; give the path of a Python file with a scene")
    spec = importlib.util.spec_from_file_location(f"shellmb_scene_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise SceneError(f"{path} is no Python file; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    # by its name dataclasses find their annotations, by the folder the file finds its neighbours
    sys.modules[spec.name] = module
    sys.path.insert(0, str(path.parent))
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        file = path.name if error.filename is None else Path(error.filename).name
        # a file with zero bytes has no lines
        place = "" if error.lineno is None else f", line {error.lineno}"
        raise SceneError(f"{file}{place}: {error.msg}") from None
    except ShellmbError:
        raise
    except (Exception, SystemExit) as error:
        where = "" if user_frame(error) is not None else f"{path.name}: "
        raise SceneError(f"{where}{in_words(error)}") from None
    finally:
        sys.path.remove(str(path.parent))
    return module
