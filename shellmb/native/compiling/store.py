"""The cache: whose it must be, where it is if it cannot be used, and whole libraries.

What is in it is executed, so it must be the user's own. A library carries a checksum of itself
at its end, which the system's loader does not look at: what was cut or spoilt is made anew.
"""

import errno
import grp
import logging
import os
import pwd
import shutil
import stat
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from shellmb.errors import RunError

_log = logging.getLogger(__name__)

# what less room than this is taken for none [bytes]
ROOM = 1_000_000
# begins the end of a library
MARK = b"shellmb crc32 "
# bytes of the head of an ELF file that say for which machine it is: class, order, machine
MACHINE = (slice(0, 6), slice(18, 20))
SAY = "name another folder by the environment variable XDG_CACHE_HOME"

# permission of others to write
OTHERS = stat.S_IWGRP | stat.S_IWOTH


@cache
def usable(folder: Path) -> Path:
    """The cache, or where it is instead.

    Args:
        folder: Where it should be.

    Returns:
        It; a private one in the temporary folder if it cannot be written or executed from.

    Raises:
        RunError: If others can write it, or the temporary one is no better.
    """
    wrong = _wrong(folder)
    if wrong is None:
        return folder
    private = Path(tempfile.gettempdir()) / f"shellmb-{os.getuid()}" / "fenics"
    try:
        private.parent.mkdir(mode=0o700, exist_ok=True)
        beside = _wrong(private)
    except OSError as error:
        beside = error.strerror
    if beside is not None:
        raise RunError(
            f"the cache of loops, {folder}, cannot be used ({wrong}), and neither can {private} "
            f"({beside}); {SAY}",
            alone=True,
        )
    # the installation writes libraries where there is no MPI yet
    from mpi4py import MPI

    if MPI.COMM_WORLD.rank == 0:
        _log.warning(
            "the cache of loops, %s, cannot be used (%s), and %s is used instead; to choose, %s",
            folder,
            wrong,
            private,
            SAY,
        )
    _share(folder, private)
    return private


def _wrong(folder: Path) -> str | None:
    """Say why a folder cannot be used; it is made where it is not there.

    Raises:
        RunError: If others can write it.
    """
    try:
        for place in (*reversed(folder.parents), folder):
            # ours alone, whatever new files may be by default
            if not place.exists():
                place.mkdir(mode=0o700, exist_ok=True)
        folder.mkdir(exist_ok=True)
        _refuse_shared(folder)
        room = os.statvfs(folder)
        if room.f_flag & os.ST_NOEXEC:
            return "nothing may be executed there"
        with tempfile.NamedTemporaryFile(dir=folder, prefix=".try-") as file:
            file.write(b"0" * 4096)
            file.flush()
        if room.f_bavail * room.f_frsize < ROOM:
            return "no room is left there"
    except OSError as error:
        return error.strerror or type(error).__name__
    return None


def _refuse_shared(folder: Path) -> None:
    """Refuse a folder that others may write: they could let us execute its content.

    Raises:
        RunError: If it is such a folder.
    """
    for place in (folder, folder.parent):
        found = place.stat()
        if found.st_uid not in (os.getuid(), 0):
            raise RunError(
                f"the cache of loops, {folder}, is not used: {place} belongs to another user "
                f"(number {found.st_uid}), who could put programs there; {SAY}",
                alone=True,
            )
        sticky = place is not folder and found.st_mode & stat.S_ISVTX
        if not sticky and (writers := _other_writers(place, found)):
            raise RunError(
                f"the cache of loops, {folder}, is not used: {writers} can write {place}, and "
                f"put programs there; remove that permission (chmod go-w), or {SAY}",
                alone=True,
            )


def _share(folder: Path, private: Path) -> None:
    """Take what is in a folder that can be read only."""
    try:
        names = {f.name for f in os.scandir(folder) if f.name.startswith("shellmb_")}
        for name in names - set(os.listdir(private)):
            shutil.copyfile(folder / name, private / name)
    except OSError:
        # then it is compiled
        return


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Error of the system when the loops cannot be written, as a sentence.

    Args:
        folder: The cache.

    Raises:
        RunError: If they cannot be.
    """
    try:
        yield
    except OSError as error:
        raise RunError(
            f"the compiled loops cannot be written to {folder} ({error.strerror or error}); make "
            f"room, or {SAY}"
        ) from error


@contextmanager
def loading(library: Path) -> Iterator[Path]:
    """Error of the system when a library cannot be loaded, as a sentence.

    Args:
        library: Its file.

    Raises:
        RunError: If it cannot be.
    """
    try:
        yield library
    except (OSError, ValueError, ImportError) as error:
        # the next run makes it anew
        with suppress(OSError):
            library.unlink()
        raise RunError(
            f"{library} cannot be loaded ({error}), and is removed: see that the C compiler is "
            f"right and files may be executed there, or {SAY}",
            alone=True,
        ) from error


def is_library(content: bytes) -> bool:
    """Decide whether content is that of a library of this machine, and none of it is cut off.

    Args:
        content: Of a file.
    """
    own = _own_head()
    if not own:
        # a system that has other kinds
        return len(content) >= 64
    if len(content) < 64 or any(content[part] != own[part] for part in MACHINE):
        return False
    if content[4] != 2:
        # offsets have other places where numbers have 32 bits
        return True
    # the table of its sections comes last
    start, size, count = (
        int.from_bytes(content[a:b], "little") for a, b in ((40, 48), (58, 60), (60, 62))
    )
    return start + size * count <= len(content)


@cache
def _own_head() -> bytes:
    try:
        with Path("/proc/self/exe").open("rb") as file:
            return file.read(20)
    except OSError:
        return b""


def seal(library: Path) -> None:
    """Put a checksum behind a library.

    Args:
        library: Its file, which nobody else knows yet.
    """
    content = library.read_bytes()
    with library.open("ab") as file:
        file.write(MARK + b"%08x" % zlib.crc32(content))
        os.fchmod(file.fileno(), stat.S_IMODE(os.fstat(file.fileno()).st_mode) & ~OTHERS)


def is_intact(library: Path, name: str) -> bool:
    """Decide whether a library is there, ours, and as it was written.

    Args:
        library: Its file.
        name: What it has to be called inside.
    """
    try:
        found = library.stat()
        ours = found.st_uid in (os.getuid(), 0) and not _other_writers(library, found)
        if not (stat.S_ISREG(found.st_mode) and ours):
            return False
        content = library.read_bytes()
    except OSError:
        return False
    checksum = MARK + b"%08x" % zlib.crc32(memoryview(content)[: -len(MARK) - 8])
    # a file without a cut may hold code for another machine
    return is_library(content) and name.encode() in content and content.endswith(checksum)


def _other_writers(place: Path, found: os.stat_result) -> str | None:
    """Others who may write a file or a folder.

    Args:
        place: Its path.
        found: Its status.

    Returns:
        Their name; none if only its owner may, or a group of the user alone.
    """
    if found.st_mode & stat.S_IWOTH:
        return "everybody"
    if not found.st_mode & stat.S_IWGRP:
        return None
    # the permissions of a group are the most that a list of users gives
    if _has_list(place):
        return "who is in its access control list"
    return None if _is_private(found.st_gid) else f"its group ({_group_name(found.st_gid)})"


def _has_list(place: Path) -> bool:
    try:
        os.getxattr(place, "system.posix_acl_access")
    except (OSError, AttributeError) as error:
        # systems without such lists, or none for this file
        return getattr(error, "errno", None) == errno.EACCES
    return True


@cache
def _is_private(number: int) -> bool:
    """Decide whether a group is that of the user alone, which has the user's name by custom."""
    try:
        user, group = pwd.getpwuid(os.getuid()).pw_name, grp.getgrgid(number)
    except KeyError:
        return False
    others = (account.pw_name for account in pwd.getpwall() if account.pw_gid == number)
    return group.gr_name == user and {*group.gr_mem, *others} <= {user}


def _group_name(number: int) -> str:
    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return str(number)
