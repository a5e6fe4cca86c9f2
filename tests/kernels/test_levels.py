"""Levels of x86-64 and numbers of lanes: chosen by the processor, forced, or refused."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from contextlib import suppress
from pathlib import Path

import pytest
from setuptools import Distribution, Extension

from shellmb.errors import RunError
from shellmb.native import library as native
from shellmb.native.compiling import flags, source
from shellmb.native.compiling.flags import FORCED_LANES, FORCED_LEVEL, LEVELS, level_and_lanes
from shellmb.native.compiling.installing import BuildLoops

NAMES = list(LEVELS)
PROJECT = Path(__file__).parents[2] / "pyproject.toml"
SETUPTOOLS = tomllib.loads(PROJECT.read_text())["tool"]["setuptools"]


def features(highest: str) -> set[str]:
    """What a processor of a level can do, and more than the level asks for."""
    known = NAMES[: NAMES.index(highest) + 1] if highest else []
    return {"sse2", "avx_vnni"}.union(*(LEVELS[name][0] for name in known))


@pytest.mark.parametrize(("highest", "lanes"), [("", 2), ("v2", 2), ("v3", 4), ("v4", 8)])
def test_the_processor_chooses(highest, lanes) -> None:
    expected = [f"-march=x86-64-{highest}"] if highest else []
    assert level_and_lanes({}, features(highest)) == (expected, lanes)
    # set, but empty
    assert level_and_lanes({FORCED_LEVEL: "", FORCED_LANES: ""}, features(highest))[1] == lanes


def test_a_level_without_the_one_below_is_none() -> None:
    assert level_and_lanes({}, features("v4") - {"fma"}) == (["-march=x86-64-v2"], 2)


@pytest.mark.parametrize("level", NAMES)
def test_levels_and_lanes_are_forced(level) -> None:
    flag = [f"-march=x86-64-{level}"]
    assert level_and_lanes({FORCED_LEVEL: level}, features("v4")) == (flag, LEVELS[level][1])
    for lanes in ("1", "2", "4", "8"):
        forced = {FORCED_LEVEL: level, FORCED_LANES: lanes}
        assert level_and_lanes(forced, features("v4")) == (flag, int(lanes))
    assert level_and_lanes({FORCED_LANES: "8"}, set()) == ([], 8)


@pytest.mark.parametrize(
    ("environment", "highest", "said"),
    [
        ({FORCED_LEVEL: "v5"}, "v4", "SHELLMB_KERNEL_LEVEL is 'v5': it must be v2, v3, v4"),
        ({FORCED_LEVEL: "native"}, "v4", "'native'"),
        ({FORCED_LEVEL: "v4"}, "v3", "'v4', whose instructions.* runs only up to v3"),
        ({FORCED_LEVEL: "v2"}, "", "'v2', whose instructions.* none of the levels"),
        ({FORCED_LANES: "3"}, "v3", "SHELLMB_KERNEL_LANES is '3': it must be 1, 2, 4, 8"),
        ({FORCED_LANES: "many"}, "v3", "'many'"),
        ({FORCED_LANES: "16"}, "v3", "'16'"),
    ],
)
def test_what_cannot_be_is_refused(environment, highest, said) -> None:
    with pytest.raises(RunError, match=said):
        level_and_lanes(environment, features(highest))


def test_a_run_says_so_before_it_compiles(tmp_path) -> None:
    environment = os.environ | {FORCED_LEVEL: "v9", "XDG_CACHE_HOME": str(tmp_path / "cache")}
    command = [sys.executable, "-m", "shellmb.cli", "run", "sudden_load"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 1 and done.stderr.startswith("error: ") and "v9" in done.stderr
    assert done.stderr.count("\n") == 1 and not list(tmp_path.rglob("*.so"))


RANKS = """
import os, sys
from mpi4py import MPI
rank = MPI.COMM_WORLD.rank
os.environ["SHELLMB_KERNEL_LANES"] = "24"[rank]
from shellmb.errors import RunError
from shellmb.native import library as native
try:
    native.cells()
except RunError as error:
    said = MPI.COMM_WORLD.gather(str(error))
    if rank == 0:
        print(len(set(said)), said[0])
"""


@pytest.mark.mpi
def test_ranks_on_different_processors_are_refused(mpirun) -> None:
    said = mpirun(2, "-c", RANKS, alone=True)
    assert said.startswith("1 the ranks run on different processors") and FORCED_LEVEL in said


FLAGS = """
import json
from shellmb.native.compiling import flags
print(json.dumps([flags.LANES, flags.COMPILER_FLAGS]))
"""


@pytest.mark.skipif(
    "v2" not in flags.runnable(flags.features_here()), reason="no x86-64 of level v2"
)
def test_the_cache_does_not_mix_levels(tmp_path, monkeypatch) -> None:
    """The library of loops has a name of its own for each level and number of lanes."""
    environment = os.environ | {FORCED_LEVEL: "v2", FORCED_LANES: "1"}
    said = subprocess.check_output([sys.executable, "-c", FLAGS], env=environment, text=True)
    lanes, compiler = json.loads(said)
    assert lanes == 1 and {"-march=x86-64-v2", "-DLANES=1"} <= set(compiler)
    before, *_ = source.named_source()
    monkeypatch.setattr(source, "COMPILER_FLAGS", compiler)
    after, *_ = source.named_source()
    assert before != after


def installed(folder: Path) -> Path:
    """The library as setuptools compiles it into a folder when the package is installed."""
    (module,) = SETUPTOOLS["ext-modules"]
    command = BuildLoops(Distribution({"ext_modules": [Extension(**module)]}))
    command.build_lib, command.build_temp = str(folder), str(folder / "temp")
    command.ensure_finalized()
    command.run()
    return folder / "shellmb" / "native" / source.INSTALLED.name


def test_an_installed_library_is_used_where_it_fits(tmp_path, monkeypatch) -> None:
    """Kind: another processor, other C, a damaged file, one that does not load: compiled anew."""
    assert SETUPTOOLS["cmdclass"]["build_ext"] == f"{BuildLoops.__module__}.{BuildLoops.__name__}"
    quick = ["-O0", *source.COMPILER_FLAGS[1:]]
    for module in (source, flags):
        monkeypatch.setattr(module, "COMPILER_FLAGS", quick)
    library = installed(tmp_path)
    monkeypatch.setattr(native, "cache_folder", lambda: tmp_path / "empty")
    monkeypatch.setattr(native, "compile_c", lambda *_: None)
    monkeypatch.setattr(native, "write_c", lambda *_: None)
    monkeypatch.setattr(native, "INSTALLED", library)

    def used() -> bool:
        with suppress(RunError):
            return bool(native._module.__wrapped__())
        return False

    assert used()
    with monkeypatch.context() as patch:
        patch.setattr(source, "COMPILER_FLAGS", [*quick, "-march=x86-64-v2"])
        assert not used()
    with monkeypatch.context() as patch:
        shutil.copytree(source.NATIVE / "c", tmp_path / "c")
        patch.setattr(source, "NATIVE", tmp_path)
        assert used()
        with (tmp_path / "c" / "nodes.c").open("a") as file:
            file.write("/* edited */")
        assert not used()
    # Python remembers what it loaded by its place
    damaged = library.with_name("damaged.so")
    damaged.write_bytes(b"no library")
    monkeypatch.setattr(native, "INSTALLED", damaged)
    assert not used()


def test_an_installation_without_a_compiler_succeeds(tmp_path, monkeypatch, caplog) -> None:
    monkeypatch.setenv("CC", "/nowhere/cc")
    assert not installed(tmp_path).exists()
    assert "there is no C compiler '/nowhere/cc'" in caplog.text
