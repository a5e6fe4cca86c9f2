"""Mistakes in a user's file: one sentence with its line, an exit code, and no traceback."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from shellmb.cli import app

HEAD = """import numpy as np
from shellmb.scene import *
ARM = RigidBody("arm", 2.0, (0.01, 0.2, 0.2), com=(0.5, 0, 0))
PIN = Revolute("pin", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0))
def made(**more):
    parts = dict(rigid_bodies=ARM, joints=PIN, loads=Gravity(), scheme="ep", dt=1e-3, t_end=4e-3)
    return Scene("bad", **(parts | more))
"""
PLATE = """
def plate(side=1.0, mesh=(1, 1), **more):
    steel = Isotropic(E=2e11, nu=0.3, thickness=0.01, density=7800.0)
    given = {k: more.pop(k) for k in ("supports", "scheme", "dt", "t_end") if k in more}
    shell = Shell("plate", Rectangle(side, 1.0), steel, mesh=mesh, **more)
    return Scene("bad", shell, **({"supports": Clamped("left")} | given))
"""
# something else within the first step than before and behind it
LATE = "def late(bad, good): return lambda t: bad if 3e-4 < t < 8e-4 else good\n"

# name -> (file behind the head, exit code, what is said)
BEFORE = {
    "the file raises": ("x = {}['a']", "bad.py, line 8: KeyError: 'a'"),
    "the file divides by zero": (
        "x = 1 / 0",
        "bad.py, line 8: ZeroDivisionError: division by zero",
    ),
    "the file ends Python": ("raise SystemExit(3)", "bad.py, line 8: SystemExit: 3"),
    "the file is no Python": ("def scene(:", "bad.py, line 8: invalid syntax"),
    "a module is missing": ("import nosuch", "bad.py, line 8: ModuleNotFoundError"),
    "scene raises": (
        "def scene():\n    return made(loads=[][1])",
        "scene 'bad': scene() fails: bad.py, line 9: IndexError: list index out of range",
    ),
    "scene exits": ("def scene():\n    raise SystemExit", "line 9: SystemExit"),
    "scene passes nonsense": (
        "def scene():\n    return made(rigid_bodies=object())",
        "scene 'bad': rigid_bodies[0] is <object",
    ),
    "scene needs an argument": (
        "def scene(mass):\n    return made()",
        "scene 'bad': its parameter 'mass' has no default; give it one, or a value by --set mass=",
    ),
    "scene needs an argument by name": ("def scene(*, a): return made()", "'a' has no default"),
    "scene returns nothing": ("def scene():\n    made()", "scene() returns NoneType"),
    "the type of a parameter is unknown": (
        "def scene(a: 'Nope' = 1): return made()",
        "the types of its parameters cannot be determined",
    ),
    "a load function raises": (
        "def swell(t):\n    return {}['a']\ndef scene(): return made(loads=Gravity(time=swell))",
        "KeyError: 'a'",
    ),
    "a load function returns nothing": (
        "def scene(): return made(loads=Gravity(time=lambda t: None))",
        "it must give a finite number",
    ),
}


def shellmb(folder: Path, text: str, *arguments: str) -> tuple[int, list[str]]:
    """Exit code, and the lines of errors."""
    (folder / "bad.py").write_text(HEAD + text)
    command = ["run", str(folder / "bad.py"), "--quiet", "--no-pictures"]
    done = CliRunner().invoke(app, [*command, "--out", str(folder / "run"), *arguments])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.stderr.splitlines()


@pytest.mark.parametrize("case", BEFORE)
def test_mistakes_that_are_seen_before_anything_is_built(case: str, tmp_path: Path) -> None:
    text, expected = BEFORE[case]
    options = ("--set", "a=1") if "types" in expected else ()
    code, said = shellmb(tmp_path, text, *options)
    assert code == 2
    assert len(said) == 1 and said[0].startswith("error: ")
    assert expected in said[0]
    assert not (tmp_path / "run").exists()


# the same where only building or running shows them
LATER = {
    "a load function raises later": (
        "def swell(t):\n    assert 1.5e-3 > t or t in (2e-3, 4e-3), 'too late'\n    return 1.0\n"
        "def scene(): return made(loads=Gravity(time=swell))",
        "a function of the scene fails: bad.py, line 9: AssertionError: too late; the last good "
        "state is in",
    ),
    "a load function gives text later": (
        LATE + "def scene(): return made(loads=Gravity(time=late('x', 1.0)))",
        "gravity: time gives 'x' at t = 0.0005; it must give a finite number",
    ),
    "a load function gives no number later": (
        LATE + "def scene(): return made(loads=Gravity(time=late(float('nan'), 1.0)))",
        "gravity: time gives nan at t = 0.0005; it must give a finite number",
    ),
    "a driver gives nothing later": (
        LATE + "TURN = Driver('turn', 'pin', rotation=late(None, 0.0))\n"
        "def scene(): return made(drivers=TURN)",
        "driver 'turn': rotation gives None at t = 0.0005; it must give a finite number",
    ),
    "a support gives complex numbers later": (
        LATE + PLATE + "def scene():\n"
        "    held = Fixed('left', displacement=(late(1j, 0.0), 0, 0))\n"
        "    return plate(supports=held, scheme='ep', dt=1e-3, t_end=4e-3)",
        "fixed components of 'plate': prescribed value gives 1j at t = 0.0",
    ),
    "a driven edge gives two numbers later": (
        LATE + PLATE + "def scene():\n"
        "    held = Driven('left', translation=late((0, 0), (0, 0, 0)))\n"
        "    return plate(supports=held, scheme='ep', dt=1e-3, t_end=4e-3)",
        "Driven('left') of 'plate': translation gives (0, 0) at t = 0.0",
    ),
    "a motor whose number is complex": (
        "PUSH = Motor('push', 'pin', law=lambda x, rate, t: 1j * x)\n"
        "def scene(): return made(force_elements=PUSH)",
        "bad.py, line 8: motor 'push': law <lambda> has the number 1j; it must be finite and real",
    ),
    "strains that are text": (
        PLATE + "def scene(): return plate(strains=lambda u, w, surface: 'x')",
        "shell 'plate': strains <lambda> returns 'x'; it must return ShellStrains, with eps a",
    ),
    "a motor of numpy": (
        "PUSH = Motor('push', 'pin', law=lambda x, rate, t: np.sin(t))\n"
        "def scene(): return made(force_elements=PUSH)",
        "bad.py, line 8: motor 'push': law <lambda> fails (loop of ufunc does not support",
    ),
    "a motor of the module math": (
        "import math\nPUSH = Motor('push', 'pin', law=lambda x, rate, t: math.sin(x))\n"
        "def scene(): return made(force_elements=PUSH)",
        "bad.py, line 9: motor 'push': law <lambda> fails (it asks for the value of a quantity",
    ),
    "a motor whose number is none": (
        "PUSH = Motor('push', 'pin', law=lambda x, rate, t: float('nan') * x)\n"
        "def scene(): return made(force_elements=PUSH)",
        "bad.py, line 8: motor 'push': law <lambda> has the number nan; it must be finite",
    ),
    "a motor that returns nothing": (
        "PUSH = Motor('push', 'pin', law=lambda x, rate, t: None)\n"
        "def scene(): return made(force_elements=PUSH)",
        "bad.py, line 8: motor 'push': law <lambda> returns None; it must return a scalar of UFL",
    ),
    "an energy that returns a list": (
        "SOFT = JointSpring('soft', 'pin', potential=lambda x: [x])\n"
        "def scene(): return made(force_elements=SOFT)",
        "bad.py, line 8: joint spring 'soft': law <lambda> returns",
    ),
    "a load that ends the program": (
        "import sys\n"
        "def stop(t):\n    return sys.exit() if t == 1.5e-3 else 1.0\n"
        "def scene(): return made(loads=Gravity(time=stop))",
        "a function of the scene ends the program (bad.py, line 10: SystemExit); it must return",
    ),
    "a load that ends the program where only what watches the run asks": (
        "import sys\n"
        "def stop(t):\n    return sys.exit() if 4e-5 < t < 7e-5 else 1.0\n"
        "def scene(): return made(loads=Gravity(time=stop))",
        "a function of the scene ends the program (bad.py, line 10: SystemExit); it must return",
    ),
    "results that end the program": (
        "import sys\ndef scene(): return made()\ndef results(run): sys.exit()",
        "everything is computed and saved except the results: bad.py, line 10: SystemExit",
    ),
    "a damper that raises": (
        "def law(rate):\n    return rate.speed\n"
        "OIL = JointDamper('oil', 'pin', law=law)\ndef scene(): return made(force_elements=OIL)",
        "bad.py, line 9: joint damper 'oil': law law fails (AttributeError",
    ),
}


@pytest.mark.parametrize("case", LATER)
def test_mistakes_that_are_seen_when_functions_are_called(case: str, tmp_path: Path) -> None:
    text, expected = LATER[case]
    code, said = shellmb(tmp_path, text)
    assert code in (1, 2)
    assert len(said) == 1 and said[0].startswith("error: ")
    assert expected in said[0]


AT_THE_END = {
    "results raise": ("def results(run):\n    return {}['tip']", (), "bad.py, line 10: KeyError"),
    "results are no numbers": ("def results(run): return {'tip': 'high'}", (), "gives 'high' for"),
    "results return nothing": ("def results(run): pass", (), "it returns None; it must return"),
    "check raises": (
        "def results(run): return {}\ndef check(results):\n    results['tip']",
        ("--check",),
        "check() of the scene fails: bad.py, line 11: KeyError: 'tip'",
    ),
    "check says nothing": (
        "def results(run): return {}\ndef check(results):\n    assert 1 > 2",
        ("--check",),
        "check failed: a reference value of the scene is not met (bad.py, line 11)",
    ),
}


@pytest.mark.parametrize("case", AT_THE_END)
def test_what_is_evaluated_behind_a_run_loses_nothing_of_it(case: str, tmp_path: Path) -> None:
    text, options, expected = AT_THE_END[case]
    code, said = shellmb(tmp_path, f"def scene(): return made()\n{text}", *options)
    assert code == 1
    assert len(said) == 1
    assert expected in said[0]
    summary = (tmp_path / "run" / "summary.json").read_text()
    assert '"failed": null' in summary and '"steps": 4' in summary
    assert (tmp_path / "run" / "history.csv").read_text().count("\n") == 6
    # mended, the run is evaluated without being computed again
    (tmp_path / "bad.py").write_text(
        f"{HEAD}def scene(): return made()\ndef results(run): return {{'a': 1}}"
    )
    done = CliRunner().invoke(app, ["resume", str(tmp_path / "run"), "--trust", "--no-pictures"])
    assert done.exit_code == 0
    assert '"a": 1.0' in (tmp_path / "run" / "summary.json").read_text()


IMPOSSIBLE = {
    "a side of nothing": ("def scene(): return plate(side=1e-300)", "'plate': an element has"),
    "a side beyond all": ("def scene(): return plate(side=1e300)", "'plate': an element has"),
    "a beam of nothing": (
        "def scene(): return Scene('bad', beams=Beam('bar', Line((0, 0, 0), (1e-300, 0, 0)),\n"
        "    RectangularSection(7e10, 0.3, width=0.02, height=0.01, density=2700.0)),\n"
        "    supports=Clamped('start'))",
        "beam 'bar': an element has",
    ),
    "more elements than memory": ("def scene(): return plate(mesh=(100000, 100000))", "memory"),
}


@pytest.mark.parametrize("case", IMPOSSIBLE)
def test_what_no_machine_can_compute_is_said_at_once(case: str, tmp_path: Path) -> None:
    text, expected = IMPOSSIBLE[case]
    code, said = shellmb(tmp_path, PLATE + text)
    assert code == 2
    assert len(said) == 1 and said[0].startswith("error: ")
    assert expected in said[0]
