"""Scenes as FMUs, read back by fmpy: numbers of a run, states, failures, and a closed loop.

The kind: any program that steps FMUs of FMI 2 or 3, with its own step, and takes steps back.
"""

import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from pythonfmu.builder import FmuBuilder
from typer.testing import CliRunner

import shellmb as sm
from shellmb.cli.main import app

PLANT = '''"""A clamped strip with a push at its tip."""

import shellmb as sm


def scene(thickness: float = 0.01, elements: int = 4, scheme: str = "ep") -> sm.Scene:
    """The strip."""
    section = sm.Isotropic(E=1e7, nu=0.3, thickness=thickness, density=1000.0)
    tip = (1.0, 0.0, 0.0)
    return sm.Scene(
        "plant",
        sm.Shell("strip", sm.Rectangle(1.0, 0.2), section, mesh=(elements, 1)),
        supports=sm.Clamped("left"),
        loads=sm.PointForce(tip, (0, 0, 1.0), time=sm.Input("push", 0.25, unit="N", linear=True)),
        probes=[sm.Probe("tip", tip), sm.Probe("speed", tip, "velocity")],
        scheme=scheme,
        units="m, kg, s",
        dt=0.01,
        t_end=0.2,
    )
'''

CONTROLLER = '''"""A damper: a force against a speed."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Damper(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.speed, self.force = 0.0, 0.25
        self.register_variable(Real("speed", causality=Fmi2Causality.input))
        self.register_variable(Real("force", causality=Fmi2Causality.output))

    def do_step(self, t, dt):
        self.force = 0.25 - 0.5 * self.speed
        return True
'''


@pytest.fixture(scope="module")
def files(tmp_path_factory: Any) -> Path:
    folder = tmp_path_factory.mktemp("fmus")
    (folder / "plant.py").write_text(PLANT)
    (folder / "controller.py").write_text(CONTROLLER)
    return Path(folder)


@pytest.fixture(scope="module", params=[2, 3])
def version(request: Any) -> int:
    return int(request.param)


@pytest.fixture(scope="module")
def plant(files: Path, version: int) -> Path:
    return sm.export_fmu(str(files / "plant.py"), files / f"plant{version}.fmu", version=version)


def scene_of(**parameters: Any) -> sm.Scene:
    space: dict[str, Any] = {}
    exec(PLANT, space)
    made: sm.Scene = space["scene"](**parameters)
    return made


class Unit:
    """An FMU that is stepped by hand."""

    def __init__(self, path: Path, **start: float) -> None:
        self.described = fmpy.read_model_description(str(path))
        self.version = 3 if self.described.fmiVersion.startswith("3") else 2
        self.references = {v.name: v.valueReference for v in self.described.modelVariables}
        made: Any = FMU3Slave if self.version == 3 else FMU2Slave
        self.unit = made(
            guid=self.described.guid,
            unzipDirectory=fmpy.extract(str(path)),
            modelIdentifier=self.described.coSimulation.modelIdentifier,
            instanceName="unit",
        )
        self.unit.instantiate()
        if self.version == 2:
            self.unit.setupExperiment(startTime=0.0)
        for name, value in start.items():
            self.set(name, value)
        self.unit.enterInitializationMode()
        self.unit.exitInitializationMode()

    def set(self, name: str, value: float) -> None:
        setter = self.unit.setFloat64 if self.version == 3 else self.unit.setReal
        setter([self.references[name]], [value])

    def get(self, *names: str) -> list[float]:
        getter = self.unit.getFloat64 if self.version == 3 else self.unit.getReal
        return list(getter([self.references[name] for name in names]))

    def step(self, t: float, dt: float) -> None:
        self.unit.doStep(currentCommunicationPoint=t, communicationStepSize=dt)


@pytest.fixture
def loaded() -> Iterator[Callable[..., Unit]]:
    units: list[Unit] = []

    def make(*args: Any, **start: float) -> Unit:
        units.append(Unit(*args, **start))
        return units[-1]

    yield make
    for each in units:
        each.unit.terminate()
        each.unit.freeInstance()


def test_an_fmu_is_the_run(plant: Path) -> None:
    """Its communication step is three of the scene's; parameters and inputs count."""
    start = {"push": 0.5, "thickness": 0.012}
    found = fmpy.simulate_fmu(
        str(plant),
        stop_time=0.18,
        step_size=0.03,
        output_interval=0.03,
        fmi_type="CoSimulation",
        start_values=start,
        output=["tip", "total_energy", "t"],
    )
    scene = scene_of(thickness=0.012)
    load = sm.PointForce((1.0, 0.0, 0.0), (0, 0, 1.0), time=lambda t: 0.5)
    run = sm.run(replace(scene, loads=load), pictures=False)
    assert len(found) == 7
    for row in found[1:]:
        there = run.history.iloc[round(row["time"] / 0.01)]
        assert row["t"] == pytest.approx(row["time"], rel=1e-12)
        for name in ("tip", "total_energy"):
            assert row[name] == pytest.approx(there[name], rel=1e-10)


def test_states_are_got_and_set(plant: Path, loaded: Callable[..., Unit]) -> None:
    """Bit for bit, also as bytes; and two units of one FMU know nothing of each other."""
    unit, other = loaded(plant), loaded(plant)
    names = "tip", "speed", "total_energy", "work_inputs"
    unit.step(0.0, 0.02)
    get = unit.unit.getFMUState if unit.version == 3 else unit.unit.getFMUstate
    put = unit.unit.setFMUState if unit.version == 3 else unit.unit.setFMUstate
    state, here = get(), unit.get(*names)
    bytes_of = unit.unit.serializeFMUState if unit.version == 3 else unit.unit.serializeFMUstate
    again = unit.unit.deserializeFMUState if unit.version == 3 else unit.unit.deSerializeFMUstate
    saved = bytes_of(state)
    ends = []
    for k, back in enumerate((state, again(saved), state)):
        unit.set("push", 0.9)
        unit.step(0.02, 0.005 * (k + 1))
        put(back)
        assert unit.get(*names) == here
        assert unit.get("push") == [0.25]
        unit.step(0.02, 0.03)
        ends.append(unit.get(*names))
        put(state)
    other.step(0.0, 0.02)
    other.step(0.02, 0.03)
    assert ends == [other.get(*names)] * 3


def test_a_step_that_fails_is_discarded(plant: Path, loaded: Callable[..., Unit]) -> None:
    """Too long a step, no number, and a time that is not the scene's: nothing is lost."""
    unit, other = loaded(plant), loaded(plant)
    for each in (unit, other):
        each.step(0.0, 0.01)
    before = unit.get("tip", "t")
    for value, t, dt in ((0.25, 0.01, 0.5), (float("nan"), 0.01, 0.01), (0.25, 0.02, 0.01)):
        unit.set("push", value)
        with pytest.raises(Exception, match=r"(?i)status|discard|doStep"):
            unit.step(t, dt)
        assert unit.get("tip", "t") == before
    unit.set("push", 0.25)
    for each in (unit, other):
        each.step(0.01, 0.01)
    assert unit.get("tip") == other.get("tip")


def test_the_description(plant: Path, version: int) -> None:
    described = fmpy.read_model_description(str(plant))
    variables = {v.name: v for v in described.modelVariables}
    kinds = {name: v.causality for name, v in variables.items()}
    assert kinds["push"] == "input"
    assert [kinds[k] for k in ("thickness", "elements", "scheme")] == ["parameter"] * 3
    assert kinds["tip"] == kinds["work_inputs"] == "output"
    units = {k: variables[k].unit for k in ("push", "tip", "speed", "total_energy", "t")}
    assert units == {"push": "N", "tip": "m", "speed": "m/s", "total_energy": "J", "t": "s"}
    assert float(variables["push"].start) == 0.25
    assert described.fmiVersion[0] == str(version)
    assert described.coSimulation.canHandleVariableCommunicationStepSize
    state = described.coSimulation
    assert getattr(state, "canGetAndSetFMUstate", False) or state.canGetAndSetFMUState
    assert float(described.defaultExperiment.stepSize) == 0.01


def test_a_controller_in_another_fmu_closes_a_loop(
    plant: Path, files: Path, loaded: Callable[..., Unit]
) -> None:
    """It damps the strip as the same law beside a motion does, and as far as the work says."""
    law = FmuBuilder.build_FMU(files / "controller.py", dest=files)
    damper, unit = loaded(law), loaded(plant)
    motion, push = sm.SceneMotion(scene_of()), 0.25
    for k in range(10):
        t = 0.02 * k
        damper.set("speed", unit.get("speed")[0])
        damper.step(t, 0.02)
        unit.set("push", damper.get("force")[0])
        unit.step(t, 0.02)
        motion.inputs["push"] = 0.25 - 0.5 * motion.outputs["speed"]
        motion.trial(0.02)
        motion.accept()
        assert unit.get("tip", "work_inputs") == [
            motion.outputs["tip"],
            motion.outputs["work_inputs"],
        ]
    assert push * motion.outputs["tip"] - motion.outputs["work_inputs"] > 1e-4


def test_refused(files: Path, monkeypatch: Any) -> None:
    name = str(files / "plant.py")
    with pytest.raises(sm.SceneError, match=r"FMI is 1; it must be 2 or 3"):
        sm.export_fmu(name, version=1)
    (files / "pair.py").write_text(
        PLANT.replace('scheme: str = "ep"', 'scheme: str = "ep", pair: tuple[int, int] = (1, 2)')
    )
    with pytest.raises(sm.SceneError, match=r"'pair' is \(3, 4\); an FMU has numbers, truth"):
        sm.export_fmu(str(files / "pair.py"), files, parameters={"pair": "3,4"})
    with pytest.raises(sm.SceneError, match=r"there is no parameter 'height'"):
        sm.export_fmu(name, parameters={"height": "1"})
    (files / "clash.py").write_text(PLANT.replace('Probe("tip"', 'Probe("push"'))
    with pytest.raises(sm.SceneError, match=r"'push' names two of the time, inputs, outputs"):
        sm.export_fmu(str(files / "clash.py"), files)
    with pytest.raises(sm.SceneError, match=r"scheme is 'static', which has no time"):
        sm.export_fmu(name, files, parameters={"scheme": "static"})
    found = CliRunner().invoke(app, ["export", name])
    assert found.exit_code == 2
    assert "the format is missing; it must be --fmu" in found.output
    found = CliRunner().invoke(app, ["export", name, "--fmu", "--out", str(files / "cli.fmu")])
    assert found.exit_code == 0, found.output
    assert (files / "cli.fmu").is_file()
    real = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda n, *a: None if n == "pythonfmu" else real(n, *a)
    )
    with pytest.raises(sm.SceneError, match=r"pythonfmu is missing.*pip install 'shellmb.exchange"):
        sm.export_fmu(name, files)


TWICE = """
import sys
import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
described, units = fmpy.read_model_description({unit!r}), []
made = FMU3Slave if described.fmiVersion.startswith("3") else FMU2Slave
for name in ("one", "two"):
    units.append(made(
        guid=described.guid,
        unzipDirectory=fmpy.extract({unit!r}),
        modelIdentifier=described.coSimulation.modelIdentifier,
        instanceName=name,
    ))
    units[-1].instantiate()
for unit in units:
    unit.terminate()
    unit.freeInstance()
print("done")
"""


def test_a_process_with_fmus_ends_in_order(plant: Path) -> None:
    """Kind: libraries that free what is freed; without our order, one end in three is an abort."""
    for _ in range(4):
        run = subprocess.run(
            [sys.executable, "-c", TWICE.format(unit=str(plant))],
            capture_output=True,
            text=True,
            check=False,
            # what is freed is overwritten
            env={**os.environ, "MALLOC_PERTURB_": "165"},
        )
        assert (run.returncode, run.stdout) == (0, "done\n"), run.stderr


OTHER = """
import sys
sys.path.insert(0, {folder!r})
import fmpy
assert not any("exchange" in path or "venv" in path for path in sys.path[1:])
found = fmpy.simulate_fmu({unit!r}, stop_time=0.02, step_size=0.02, output=["tip"])
print("tip", found["tip"][-1])
"""


@pytest.mark.skipif(sys.prefix == sys.base_prefix, reason="not in a virtual environment")
def test_another_python_finds_the_environment(
    plant: Path, tmp_path: Path, loaded: Callable[..., Unit]
) -> None:
    """One that has fmpy only, as a program that embeds Python would."""
    here = Path(fmpy.__file__).parents[1]
    for name in ("fmpy", "lxml", "lark", "msgpack", "attr", "attrs", "numpy", "numpy.libs"):
        if (here / name).exists():
            (tmp_path / name).symlink_to(here / name)
    text = OTHER.format(folder=str(tmp_path), unit=str(plant))
    python = Path(sys.executable).resolve()
    run = subprocess.run([python, "-I", "-c", text], capture_output=True, text=True, check=False)
    unit = loaded(plant)
    unit.step(0.0, 0.02)
    # round-off of another process
    assert run.returncode == 0, run.stderr
    assert float(run.stdout.split()[-1]) == pytest.approx(unit.get("tip")[0], rel=1e-12)
