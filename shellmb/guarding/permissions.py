"""Permissions of files: who but the user and root may write them."""

import errno
import grp
import os
import pwd
import stat
from functools import cache
from pathlib import Path

# permission of others to write
OTHERS = stat.S_IWGRP | stat.S_IWOTH


def other_writers(place: Path, found: os.stat_result) -> str | None:
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
