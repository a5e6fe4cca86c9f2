"""Standard streams that are closed, full or read by nobody: the run is saved, a code says so."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCENE = Path(__file__).with_name("scene_pendulum.py")
COMMAND = f"{sys.executable} -m shellmb.cli run {SCENE} --no-pictures --out run"
# what a shell does with the streams, the exit code, and what stderr ends with
CASES = {
    "nobody reads": ("exec 3>&1; (" + "{run}; echo $? >&3) 2>err | :", 141, "(Broken pipe)"),
    "full": ("{run} >/dev/full 2>err; echo $?", 1, "(No space left on device)"),
    "full beside it": ("{run} >out 2>/dev/full; echo $?", 0, ""),
    "closed": ("{run} >&- 2>&- <&-; echo $?", 0, ""),
}


@pytest.mark.parametrize("case", CASES)
def test_a_run_whose_words_nobody_gets(case: str, tmp_path: Path) -> None:
    command, code, said = CASES[case]
    done = subprocess.run(
        ["bash", "-c", command.format(run=COMMAND)], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.stdout.split() == [str(code)]
    assert "Traceback" not in done.stderr
    for name in ("history.csv", "summary.json", "state/state.json"):
        # no other stream's words in a file that has got its number
        assert (tmp_path / "run" / name).read_text().startswith(("step,t,dt", "{"))
    if said:
        last = (tmp_path / "err").read_text().splitlines()[-1]
        assert last == (
            f"error: the output cannot be written {said}; everything else is finished and saved"
        )


HALF = f"""
import os
from shellmb.errors import SceneError
def scene():
    if os.environ.get("PMI_RANK") == "1":
        raise SceneError("of one rank only")
    import sys
    sys.path.insert(0, {str(SCENE.parent)!r})
    import scene_pendulum
    return scene_pendulum.scene()
"""


@pytest.mark.mpi
def test_a_rank_that_fails_before_the_others_begin_ends_them(tmp_path: Path) -> None:
    """They would wait for it for ever, in MPI or PETSc, where they begin."""
    (tmp_path / "half.py").write_text(HALF)
    mpiexec = Path(sys.executable).parent / "mpiexec"
    command = [mpiexec, "-n", "2", sys.executable, "-m", "shellmb.cli", "run", "half.py"]
    done = subprocess.run(
        [*map(str, command), "--quiet", "--out", "run"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ,
    )
    assert done.returncode == 2
    assert "error: of one rank only" in done.stderr
