"""MPI, PETSc and DOLFINx are loaded in their order, whatever a program uses first."""

import subprocess
import sys
from pathlib import Path

from tests.test_architecture import MODULES, crossing, imports, layer

# what links to the MPI library
USERS = {"petsc4py", "slepc4py", "dolfinx"}
LOADERS = {"mpi4py", "shellmb.libraries"}


def loads(module: str) -> bool:
    """Whether a module, or a package that it is in, loads the MPI library first."""
    parts = module.split(".")
    above = (".".join(parts[:k]) for k in range(1, len(parts) + 1))
    return any(LOADERS & set(imports(name)) for name in above)


def test_mpi_comes_before_all_that_needs_it() -> None:
    """Kind: a module that is the first one of a program, as `sm.adjoint` was."""
    # whoever is beside C has been loaded by others
    modules = [m for m in MODULES if layer(m) not in (None, "native")]
    needing = crossing(modules, lambda name: name.split(".")[0] in USERS)
    found = [line for line in needing if not loads(line.split(" ")[0])]
    assert not found, "\n".join(found)


SEEN = """
import shellmb as sm
sm.adjoint, sm.modes
sm.run("heavy_top", parameters={"t_end": 1e-3}, pictures=False)
from petsc4py import PETSc
print(PETSc.Options().getAll())
"""


def test_options_of_a_stranger_s_folder_mean_nothing(tmp_path: Path, monkeypatch) -> None:
    """PETSc would load and write what files of the current folder say."""
    here, home = tmp_path / "here", tmp_path / "home"
    for folder in (here, home):
        folder.mkdir()
    for name in (".petscrc", "petscrc"):
        (here / name).write_text(f"-log_view :{here}/log\n-evil 1\n")
    # the user's own count
    (home / ".petscrc").write_text("-options_left no\n-mine 2\n")
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("PETSC_OPTIONS", "-given 3")
    done = subprocess.run(
        [sys.executable, "-c", SEEN], cwd=here, capture_output=True, text=True, check=True
    )
    options = done.stdout.splitlines()[-1]
    assert "'mine': '2'" in options and "'given': '3'" in options and "evil" not in options
    assert not (here / "log").exists()
