"""Locks of files."""

import os

from shellmb.files.locks import FileLock


def test_lock_of_a_removed_file_is_nobodys(tmp_path) -> None:
    first, second = FileLock(tmp_path / "lock"), FileLock(tmp_path / "lock")
    assert first.acquire() and not second.acquire()
    assert second.owner == f"process {os.getpid()} on {os.uname().nodename}"
    (tmp_path / "lock").unlink()
    # two would hold locks of different files under one name
    assert second.acquire()
    first.release()
    assert (tmp_path / "lock").exists()
    second.release()
    assert not (tmp_path / "lock").exists()
