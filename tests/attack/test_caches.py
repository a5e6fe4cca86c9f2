"""Caches that cannot be used or must not be, libraries that are damaged, compilers that lie."""

import os
import sys
from pathlib import Path

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import pytest

from shellmb.errors import RunError
from shellmb.native import library as native
from shellmb.native.compiling.folder import cache_folder

SOURCE = """
#include <Python.h>
static struct PyModuleDef loops = {PyModuleDef_HEAD_INIT, "loops"};
PyMODINIT_FUNC PyInit_loops(void) { return PyModuleDef_Init(&loops); }
"""


@pytest.fixture(name="cache")
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return cache_folder()


@pytest.fixture(name="build")
def make_build(cache: Path, monkeypatch: pytest.MonkeyPatch):
    """Finds a small module in place of the loops, in the cache or by the compiler."""

    def write_c(folder: Path, named: tuple[str, str, str]) -> Path:
        written.append(folder / "loops.1.c")
        written[-1].write_text(SOURCE)
        return written[-1]

    def build() -> tuple[Path, bool]:
        written.clear()
        module = native._module.__wrapped__()
        return Path(module.__file__), bool(written)

    written: list[Path] = []
    monkeypatch.setattr(native, "INSTALLED", cache / "none.so")
    monkeypatch.setattr(native, "named_source", lambda: ("loops", "", ""))
    monkeypatch.setattr(native, "write_c", write_c)
    return build


# --- where it is ----------------------------------------------------------------------------------
@pytest.mark.parametrize("where", ["/dev/null", "/proc", "file"])
def test_a_cache_that_cannot_be_written_is_named(where, tmp_path, monkeypatch) -> None:
    """Kind: no folder, one of the system, one that is full or can only be read."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / where))
    with pytest.raises(RunError, match=rf"written to .*{where}/shellmb \(.*XDG_CACHE_HOME"):
        cache_folder()


@pytest.mark.parametrize("mode", [0o777, 0o770])
def test_a_cache_that_others_can_write_is_refused(mode, cache) -> None:
    """Kind: whoever else may write there has his programs executed by us."""
    cache.chmod(mode)
    with pytest.raises(RunError, match=r"other users can write .*go-w.*XDG_CACHE_HOME"):
        cache_folder()
    cache.chmod(0o755)
    assert cache_folder() == cache


def test_a_folder_without_a_name_is_of_the_home(tmp_path, monkeypatch) -> None:
    """A relative one would be of the current folder, which may be a stranger's."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", "kernels")
    assert cache_folder() == tmp_path / ".cache" / "shellmb"


def test_what_we_make_is_ours_alone_whatever_is_usual(tmp_path, monkeypatch) -> None:
    """Kind: new files that everybody may write, which a process is told to make by its mask."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    before = os.umask(0)
    try:
        for path in (cache_folder(), cache_folder().parent):
            assert not path.stat().st_mode & 0o022
    finally:
        os.umask(before)


def test_an_installed_library_needs_no_cache(build, cache, monkeypatch) -> None:
    library, _ = build()
    monkeypatch.setattr(native, "INSTALLED", library.rename(cache.parent / "loops.so"))
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")
    assert build() == (cache.parent / "loops.so", False)


# --- what is in it --------------------------------------------------------------------------------
DAMAGE = {
    "emptied": lambda content: b"",
    "zeros": lambda content: bytes(len(content)),
    "garbage": lambda content: b"\xff\xfe" * (len(content) // 2),
    "text": lambda content: b"no library\n",
    "another machine": lambda content: content[:18] + b"\xff\xff" + content[20:],
}


@pytest.mark.parametrize("how", DAMAGE)
def test_a_damaged_library_is_made_anew(how, build, tmp_path, monkeypatch) -> None:
    """Kind: whatever the system does not load, or that is of another machine."""
    content = build()[0].read_bytes()
    # in another place, as the system knows by its place what it has loaded
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "other"))
    library = cache_folder() / "loops.so"
    library.write_bytes(DAMAGE[how](content))
    assert build() == (library, True)
    assert build() == (library, False)


# --- the compiler ---------------------------------------------------------------------------------
OUT = "import sys; out = sys.argv[sys.argv.index('-o') + 1]; "
LIARS = {
    "an empty file": OUT + "open(out, 'w')",
    "garbage": OUT + "open(out, 'wb').write(b'garbage' * 1000)",
    "another library": OUT + "import mpi4py.MPI, shutil; shutil.copy(mpi4py.MPI.__file__, out)",
}


@pytest.mark.parametrize("writes", LIARS)
def test_a_compiler_that_writes_something_else_is_named(writes, build, cache, monkeypatch) -> None:
    program = cache.parent / "liar.py"
    program.write_text(LIARS[writes])
    monkeypatch.setenv("CC", f"{sys.executable} {program}")
    with pytest.raises(RunError, match=r"loops.so, cannot be loaded .* another compiler by CC"):
        build()
    assert not list(cache.glob("*.so*"))


def test_a_compiler_that_fails_or_is_not_there_is_told(build, monkeypatch) -> None:
    monkeypatch.setenv("CC", "gcc --no-such-option")
    with pytest.raises(RunError, match="compiler fails: gcc --no-such-option"):
        build()
    monkeypatch.setenv("CC", "/nowhere/cc")
    with pytest.raises(RunError, match=r"no C compiler '/nowhere/cc'.*install"):
        build()
    monkeypatch.delenv("CC")
    assert build()[1]


@pytest.mark.parametrize("named", ["gcc '", " ", '"'])
def test_names_of_compilers_that_are_none(named, build, monkeypatch) -> None:
    monkeypatch.setenv("CC", named)
    with pytest.raises(RunError, match=r"variable CC is .* must name a C compiler"):
        build()


def test_a_compiler_speaks_any_language(build, cache, monkeypatch) -> None:
    """What it says may be no UTF-8."""
    program = cache.parent / "latin.py"
    program.write_text("import sys; sys.stderr.buffer.write(b'unm\xf6glich'); sys.exit(1)")
    monkeypatch.setenv("CC", f"{sys.executable} {program}")
    with pytest.raises(RunError, match="the C compiler fails"):
        build()
