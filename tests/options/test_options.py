"""Options are described once: commands and functions have the same ones, in the same words."""

import inspect
import re

import pytest
import typer

import shellmb as sm
from shellmb.api.modal import modes
from shellmb.api.runs import run
from shellmb.api.studies import study
from shellmb.cli.main import app
from shellmb.cli.options import requested
from shellmb.errors import SceneError
from shellmb.options.described import options_of
from shellmb.options.run import ELEMENTS, Options, StudyOptions
from shellmb.scene.schemes import SCHEMES

COMMANDS = typer.main.get_command(app).commands
EVERY = (
    ("run", run, options_of(Options)),
    ("modes", modes, options_of(Options, *ELEMENTS)),
    ("study", study, [*options_of(StudyOptions), *options_of(Options, "body", "t_end")]),
)


@pytest.mark.parametrize(("command", "function", "options"), EVERY, ids=lambda x: str(x)[:9])
def test_the_command_line_and_python_have_the_same(command, function, options) -> None:
    offered = {name: p.help for p in COMMANDS[command].params for name in p.opts}
    taken = inspect.signature(function).parameters
    said = " ".join(inspect.getdoc(function).split())
    assert options
    for option in options:
        assert offered[option.flag].startswith(option.about.help)
        assert taken[option.name].kind is inspect.Parameter.KEYWORD_ONLY
        # rounds of a study are one in Python, where nobody compares times by the way
        if option.name != "repeat":
            assert taken[option.name].default == option.default
        assert f"{option.name}: {option.about.help}" in said
    assert not any(p.kind is p.VAR_KEYWORD for p in taken.values())


def test_all_schemes_are_named() -> None:
    (scheme,) = options_of(Options, "scheme")
    assert set(SCHEMES) <= set(re.findall(r"[\w-]+", scheme.about.help))


def test_another_name_is_refused_before_anything_runs() -> None:
    with pytest.raises(TypeError, match="unexpected keyword argument 'schem'"):
        run("sudden_load", schem="ep")
    with pytest.raises(TypeError, match="unexpected keyword argument 'alpha'"):
        sm.modes("sudden_load", alpha=0.5)
    with pytest.raises(TypeError, match="unexpected keyword argument 'dts'"):
        sm.study("sudden_load", dts=(1e-3,))


def test_texts_and_values_mean_the_same() -> None:
    """A mesh is a text on the command line, and may be one in Python."""
    from shellmb.api.runs import requested as in_python

    scene = requested("sudden_load", None, mesh="4x1", model="floating-frame").scene
    for mesh in ("4x1", (4, 1)):
        assert in_python("sudden_load", None, mesh=mesh, model="floating-frame").scene == scene
    assert scene.shells[0].mesh == (4, 1) and scene.shells[0].linear
    with pytest.raises(SceneError, match="mesh is '4'; it must be two counts"):
        in_python("sudden_load", None, mesh="4")
