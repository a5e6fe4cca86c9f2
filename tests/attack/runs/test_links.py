"""Links in a run directory: nothing is written to what they point to, and folders are none."""

import os
from pathlib import Path

import pytest

from shellmb.api.runs import load
from shellmb.errors import RunError, SceneError
from shellmb.files.locks import FileLock
from shellmb.files.writing import drafted, make_folder
from shellmb.observers.history import GrowingFile
from shellmb.running.resume import resume

SCENE = str(Path(__file__).with_name("scene_pendulum.py"))
PRECIOUS = "precious\n"
# all that a run and its page write, but what a run goes on with (which is read, and written anew)
WRITTEN = ["lock", "report.html", "shape.png", "probes.png", "energy.png", "joints.png"]
WRITTEN += ["steps.png", "animation.gif", "summary.json", "scene.json", "fields/all.pvd"]
WRITTEN += ["fields/rigid_bodies_0003.vtu", "fields/rigid_bodies.vtu.series", "history.tmp"]
WRITTEN += ["state/state.tmp", "state/step-00000004-rank0.npz", "fields/joints_0004.vtu"]
READ = ["request.json", "history.csv", "state/state.json", "fields/rigid_bodies_0000.vtu"]


@pytest.mark.parametrize("link", ["symbolic", "hard"])
def test_what_links_point_to_is_left_alone(link: str, run: Path, tmp_path: Path) -> None:
    """Every file that is written, at once: a stranger's directory that is gone on with."""
    make = Path.symlink_to if link == "symbolic" else Path.hardlink_to
    kept = {}
    for number, name in enumerate([*WRITTEN, *READ]):
        victim, place = tmp_path / f"victim{number}", run / name
        content = place.read_bytes() if name in READ else PRECIOUS.encode()
        victim.write_bytes(content)
        place.unlink(missing_ok=True)
        make(place, victim)
        kept[victim] = content
    resume(run, scene_file=SCENE)
    load(run).report()
    assert {victim: victim.read_bytes() for victim in kept} == kept
    for name in ("report.html", "shape.png", "summary.json", "history.csv", "fields/all.pvd"):
        assert not (run / name).is_symlink() and PRECIOUS not in (run / name).read_text("latin1")


@pytest.mark.parametrize("folder", ["fields", "state"])
def test_a_folder_that_is_a_link_is_refused(folder: str, run: Path, tmp_path: Path) -> None:
    (run / folder).rename(tmp_path / "elsewhere")
    (run / folder).symlink_to(tmp_path / "elsewhere")
    before = sorted(os.listdir(tmp_path / "elsewhere"))
    with pytest.raises(SceneError, match=rf"{folder} is a link.*put a folder there"):
        resume(run, scene_file=SCENE, pictures=False)
    with pytest.raises(RunError, match=rf"{folder} is a link.*put a folder there"):
        make_folder(run / folder)
    assert not (run / "lock").exists()
    assert sorted(os.listdir(tmp_path / "elsewhere")) == before


@pytest.mark.parametrize("points", ["dangling", "/dev/zero", "fifo"])
def test_files_and_locks_take_the_place_of_links(points: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo")
    place = tmp_path / "file.txt"
    for write in ("lock", "growing", "draft"):
        place.symlink_to(tmp_path / points)
        if write == "lock":
            lock = FileLock(place)
            assert lock.acquire() and f"{os.getpid()}" in lock.owner
            lock.release()
            continue
        if write == "growing":
            file = GrowingFile(place, "a")
            file.add(["x"])
            file.close()
        else:
            with drafted(place) as draft:
                draft.write_text("x")
        assert place.is_file() and not place.is_symlink()
        place.unlink()
    assert sorted(os.listdir(tmp_path)) == ["fifo"]


def test_a_file_that_cannot_be_written_whole_is_as_before(tmp_path: Path) -> None:
    (tmp_path / "file.txt").write_text("before")

    def spoil() -> None:
        with drafted(tmp_path / "file.txt") as draft:
            draft.write_text("half")
            raise OSError("full")

    with pytest.raises(OSError, match="full"):
        spoil()
    assert (tmp_path / "file.txt").read_text() == "before"
    assert os.listdir(tmp_path) == ["file.txt"]
