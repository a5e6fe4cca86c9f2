"""Caches that cannot be used or must not be, libraries that are damaged, compilers that lie."""

import ctypes
import os
import pwd
import struct
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import pytest

from shellmb.errors import RunError
from shellmb.native import library as native
from shellmb.native.compiling import source as making
from shellmb.native.compiling import store
from shellmb.native.compiling.folder import cache_folder


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for what is temporary: a test's own."""
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    # what is known of other tests' folders
    store.usable.cache_clear()
    return tmp_path / "tmp"


@pytest.fixture(name="cache")
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return cache_folder()


def built(folder: Path) -> Path:
    """A small library in a cache, made as that of the loops is."""
    source = folder / "loops.1.c"
    source.write_text("int PyInit_loops(void) { return 3; }\n")
    making.compile_c(source, folder / "loops.so")
    return folder / "loops.so"


class Place:
    """What a file system says of itself."""

    f_flag, f_bavail, f_frsize = 0, 10**6, 4096


# --- where it is ----------------------------------------------------------------------------------
@pytest.mark.parametrize("where", ["/dev/null/fenics", "/proc/fenics", "file/fenics"])
def test_an_impossible_cache_is_replaced_by_a_private_one(where, temporary, caplog) -> None:
    (temporary / "file").touch()
    found = store.usable(temporary / where)
    assert found.is_relative_to(temporary) and found.name == "fenics"
    assert found.parent.stat().st_mode & 0o777 == 0o700
    assert f"{temporary / where}, cannot be used (" in caplog.text
    assert "XDG_CACHE_HOME" in caplog.text


@pytest.mark.parametrize(
    ("place", "why"),
    [({"f_flag": store.os.ST_NOEXEC}, "nothing may be executed"), ({"f_bavail": 3}, "no room")],
)
def test_noexec_and_full_ones_are_replaced(place, why, tmp_path, caplog, monkeypatch) -> None:
    def statvfs(path):
        found = Place()
        if Path(path).name == "cache":
            vars(found).update(place)
        return found

    monkeypatch.setattr(store.os, "statvfs", statvfs)
    assert store.usable(tmp_path / "cache") != tmp_path / "cache"
    assert why in caplog.text


MOUNTED = """
import logging, os, subprocess, sys
from pathlib import Path
from mpi4py import MPI
from shellmb.errors import RunError
from shellmb.native.compiling.folder import cache_folder
from shellmb.native.compiling.source import compile_c
logging.basicConfig(format="%(message)s", stream=sys.stdout)

def mount(name, options, *more):
    folder = Path(name).absolute()
    folder.mkdir()
    for order in (options, *more):
        subprocess.run(["mount", "-t", "tmpfs", "-o", order, "tmpfs", folder], check=True)
    os.environ["XDG_CACHE_HOME"] = str(folder)
    return cache_folder()

mount("noexec", "noexec,mode=700"), mount("ro", "mode=700", "remount,ro")
full = mount("full", "size=2m,mode=700")
(full.parent / "others").write_bytes(bytes(2**21 - 5 * 4096))
source = full / "loops.1.c"
source.write_text("int PyInit_loops[30000] = {1};")
try:
    compile_c(source, full / "loops.so")
except RunError as error:
    print(error)
"""


def test_caches_on_file_systems_that_say_no(temporary) -> None:
    """Kind: real ones, which nothing may be executed on, read only, and full in the middle."""
    spaces = ["unshare", "--user", "--map-root-user", "--mount"]
    here = {"cwd": temporary, "capture_output": True, "text": True}
    try:
        tried = subprocess.run(
            [*spaces, "mount", "-t", "tmpfs", "tmpfs", temporary], check=False, **here
        )
    except FileNotFoundError:
        pytest.skip("no command unshare here")
    if tried.returncode:
        pytest.skip(f"no name spaces here ({tried.stderr.strip()})")
    variables = {**os.environ, "TMPDIR": str(temporary)}
    done = subprocess.run(
        [*spaces, sys.executable, "-c", MOUNTED], env=variables, check=True, **here
    )
    noexec, ro, full = [line for line in done.stdout.splitlines() if "XDG_CACHE_HOME" in line]
    assert "/noexec/fenics, cannot be used (nothing may be executed there), and" in noexec
    assert "/ro/fenics, cannot be used (Read-only file system), and" in ro
    assert str(temporary / "full") in full and "make room" in full


def test_libraries_that_can_only_be_read_are_used(cache, monkeypatch) -> None:
    # a name that the cache of kernels shares
    library = built(cache)
    library.rename(cache / "shellmb_loops.so")
    real = store._wrong
    monkeypatch.setattr(store, "_wrong", lambda f: "Read-only" if f == cache else real(f))
    store.usable.cache_clear()
    assert (cache_folder() / "shellmb_loops.so").exists() and cache_folder() != cache


def test_without_any_place_it_says_which_variable(temporary) -> None:
    (temporary / f"shellmb-{store.os.getuid()}").touch()
    with pytest.raises(RunError, match=r"neither can .*XDG_CACHE_HOME"):
        store.usable(Path("/dev/null/fenics"))


@pytest.mark.parametrize("open_", [".", "fenics"])
def test_a_cache_that_everybody_can_write_is_refused(open_, tmp_path) -> None:
    folder = tmp_path / "home" / "fenics"
    folder.mkdir(parents=True)
    (tmp_path / "home" / open_).chmod(0o777)
    with pytest.raises(RunError, match=r"everybody can write .*XDG_CACHE_HOME"):
        store.usable(folder)


class Group:
    """A group of the system."""

    def __init__(self, name: str, *members: str) -> None:
        self.gr_name, self.gr_mem = name, list(members)


USER = pwd.getpwuid(os.getuid()).pw_name
# groups that others are in: as members, by their account, by its name (who is in it is unknown)
SHARED = {
    "members": (Group(USER, USER, "somebody"), ()),
    "accounts": (Group(USER), ("somebody",)),
    "name": (Group("staff"), ()),
}


@pytest.fixture(name="grouped")
def make_grouped(monkeypatch: pytest.MonkeyPatch):
    """Let the system know one group only: the group, and accounts that have it."""

    def grouped(group, accounts=()) -> None:
        known = [SimpleNamespace(pw_name=name, pw_gid=os.getgid()) for name in (USER, *accounts)]
        monkeypatch.setattr(store.grp, "getgrgid", lambda number: group)
        monkeypatch.setattr(store.pwd, "getpwall", lambda: known)
        store._is_private.cache_clear()

    yield grouped
    store._is_private.cache_clear()


@pytest.mark.parametrize("open_", [".", "fenics"])
def test_a_cache_that_a_group_can_write_is_refused(open_, tmp_path, grouped) -> None:
    """Kind: whoever else may write there has his programs executed by us."""
    folder = tmp_path / "home" / "fenics"
    folder.mkdir(parents=True)
    (tmp_path / "home" / open_).chmod(0o770)
    for group, accounts in SHARED.values():
        grouped(group, accounts)
        with pytest.raises(RunError, match=rf"its group \({group.gr_name}\) can write .*go-w"):
            store.usable(folder)
    grouped(Group(USER, USER))
    assert store.usable(folder) == folder


def test_a_cache_that_users_of_a_list_can_write_is_refused(tmp_path, grouped) -> None:
    folder = tmp_path / "fenics"
    folder.mkdir()
    # owner, user 12345, group, mask, others: read, write, execute; the numbers of linux/posix_acl.h
    entries = (1, 7, -1), (2, 7, 12345), (4, 5, -1), (16, 7, -1), (32, 5, -1)
    content = struct.pack("<I", 2) + b"".join(struct.pack("<HHi", *entry) for entry in entries)
    try:
        os.setxattr(folder, "system.posix_acl_access", content)
    except OSError as error:
        pytest.skip(f"no access control lists here ({error.strerror})")
    grouped(Group(USER))
    with pytest.raises(RunError, match="who is in its access control list can write"):
        store.usable(folder)
    folder.chmod(0o700)
    assert store.usable(folder) == folder


def test_a_cache_in_the_temporary_folder_is_the_user_s(tmp_path) -> None:
    folder = tmp_path / "home" / "fenics"
    folder.mkdir(parents=True)
    folder.parent.chmod(0o1777)
    assert store.usable(folder) == folder


def test_what_we_make_is_ours_alone_whatever_is_usual(tmp_path, monkeypatch) -> None:
    """Kind: new files that everybody may write, which a process is told to make by its mask."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home" / "cache"))
    before = store.os.umask(0)
    try:
        library = built(cache_folder())
        assert store.is_intact(library, "loops")
        for path in (library, library.parent, library.parent.parent):
            assert not path.stat().st_mode & 0o022
    finally:
        store.os.umask(before)


# --- what is in it --------------------------------------------------------------------------------
DAMAGE = {
    "emptied": lambda content: b"",
    "cut": lambda content: content[: len(content) // 2],
    "its end cut off": lambda content: content[:-100],
    "zeros": lambda content: bytes(len(content)),
    "garbage": lambda content: b"\xff\xfe" * (len(content) // 2),
    "spoilt within": lambda content: content[:4000] + b"\xff" * 64 + content[4064:],
    "text": lambda content: b"no library\n",
}


@pytest.mark.parametrize("how", DAMAGE)
def test_a_damaged_library_is_made_anew(how, cache) -> None:
    """The kind: whatever is not as it was written, before the system loads (or maps) any of it."""
    library = built(cache)
    assert store.is_intact(library, "loops")
    content = library.read_bytes()
    library.unlink()
    library.write_bytes(DAMAGE[how](content))
    assert not store.is_intact(library, "loops")
    # and made anew
    assert store.is_intact(built(cache), "loops") and library.stat().st_size == len(content)


@pytest.mark.parametrize("what", ["writable", "shared", "another library", "another machine"])
def test_whole_libraries_that_are_not_ours_are_made_anew(what, cache, grouped) -> None:
    """Kind: what has the right checksum, and is not what we wrote under this name."""
    library = built(cache)
    content = library.read_bytes()
    library.unlink()
    other = content[: -len(store.MARK) - 8]
    if what == "another library":
        other = other.replace(library.stem.encode(), b"x" * len(library.stem))
    if what == "another machine":
        other = other[:18] + b"\xff\xff" + other[20:]
    library.write_bytes(other)
    store.seal(library)
    grouped(*SHARED["members"])
    library.chmod({"writable": 0o666, "shared": 0o664}.get(what, 0o644))
    assert not store.is_intact(library, "loops")
    assert store.is_intact(built(cache), "loops")
    assert library.read_bytes() == content and not library.stat().st_mode & 0o022


def test_the_loops_are_made_anew_where_they_are_damaged(cache, monkeypatch) -> None:
    library = built(cache)
    monkeypatch.setattr(native, "INSTALLED", cache / "none")
    monkeypatch.setattr(native, "compile_c", lambda source, target: source.unlink())
    target, _, compiling = native._compiled.__wrapped__()
    assert compiling is not None
    compiling.result()
    library.replace(target)
    assert native._compiled.__wrapped__()[-1] is not None


# --- the compiler ---------------------------------------------------------------------------------
OUT = "import sys; out = sys.argv[sys.argv.index('-o') + 1]; "
LIARS = {
    "nothing": "pass",
    "an empty file": OUT + "open(out, 'w')",
    "garbage": OUT + "open(out, 'wb').write(b'garbage' * 1000)",
    "another library": OUT + "import mpi4py.MPI, shutil; shutil.copy(mpi4py.MPI.__file__, out)",
    "half of one": OUT
    + "import mpi4py.MPI as m; open(out, 'wb').write(open(m.__file__, 'rb').read()[:9999])",
}


@pytest.mark.parametrize("writes", LIARS)
def test_a_compiler_that_writes_something_else_is_named(writes, cache, monkeypatch) -> None:
    program = cache.parent / "liar.py"
    program.write_text(LIARS[writes])
    monkeypatch.setenv("CC", f"{sys.executable} {program}")
    with pytest.raises(RunError, match=r"liar.py' ends without an error.* variable CC"):
        built(cache)
    assert not list(cache.glob("*.so*"))


def test_a_library_that_does_not_load_is_removed(cache) -> None:
    library = built(cache)
    library.write_bytes(library.read_bytes()[:100])
    with pytest.raises(RunError, match=r"cannot be loaded .* and is removed"):
        with store.loading(library):
            ctypes.CDLL(str(library))
    assert not library.exists()


def test_a_compiler_that_fails_or_is_not_there_is_told(cache, monkeypatch) -> None:
    monkeypatch.setenv("CC", "gcc --no-such-option")
    with pytest.raises(RunError, match="compiler fails: gcc --no-such-option"):
        built(cache)
    monkeypatch.setenv("CC", "/nowhere/cc")
    with pytest.raises(RunError, match=r"no C compiler '/nowhere/cc'.*install"):
        built(cache)
    monkeypatch.delenv("CC")
    assert store.is_intact(built(cache), "loops")


@pytest.mark.parametrize("named", ["gcc '", " ", '"'])
def test_names_of_compilers_that_are_none(named, cache, monkeypatch) -> None:
    monkeypatch.setenv("CC", named)
    with pytest.raises(RunError, match=r"variable CC is .* must name a C compiler"):
        built(cache)


def test_a_compiler_speaks_any_language(cache, monkeypatch) -> None:
    """What it says may be no UTF-8."""
    program = cache.parent / "latin.py"
    program.write_text("import sys; sys.stderr.buffer.write(b'unm\\xf6glich'); sys.exit(1)")
    monkeypatch.setenv("CC", f"{sys.executable} {program}")
    with pytest.raises(RunError, match="the C compiler fails"):
        built(cache)


# --- what stands in the current folder ------------------------------------------------------------
SEEN = """
import shellmb
from shellmb.native.compiling import folder
import ffcx.options
from petsc4py import PETSc
print(folder.cache_folder())
print(ffcx.options.get_options()["epsilon"], PETSc.Options().getAll())
"""


def test_options_of_a_stranger_s_folder_mean_nothing(tmp_path, monkeypatch) -> None:
    """Kernels would be loaded from where it says, and PETSc would write and load what it says."""
    here, home = tmp_path / "here", tmp_path / "home"
    for folder in (here, home / ".config" / "ffcx"):
        folder.mkdir(parents=True)
    (here / "dolfinx_jit_options.json").write_text(f'{{"cache_dir": "{here}/kernels"}}')
    (here / "ffcx_options.json").write_text('{"epsilon": 1e-3}')
    for name in (".petscrc", "petscrc"):
        (here / name).write_text(f"-log_view :{here}/log\n-evil 1\n")
    # the user's own count
    (home / ".petscrc").write_text("-options_left no\n-mine 2\n")
    (home / ".config" / "ffcx" / "ffcx_options.json").write_text('{"epsilon": 1e-13}')
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("PETSC_OPTIONS", "-given 3")
    # a relative one would be of this folder
    monkeypatch.setenv("XDG_CACHE_HOME", "kernels")
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    done = subprocess.run(
        [sys.executable, "-c", SEEN], cwd=here, capture_output=True, text=True, check=True
    )
    folder, others = done.stdout.splitlines()[:2]
    assert folder == str(home / ".cache" / "fenics")
    assert others.startswith("1e-13 ")
    assert "'mine': '2'" in others and "'given': '3'" in others and "evil" not in others
    assert not (here / "log").exists() and not (here / "kernels").exists()
