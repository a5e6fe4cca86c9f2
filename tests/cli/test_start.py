"""What a command does not need is not loaded: a start takes as long as its imports."""

import json
import subprocess
import sys
from pathlib import Path

# one process: first what answers without a scene, then a run without pictures
CODE = """
import sys
from shellmb.cli import app

def loaded(arguments):
    try:
        app(arguments)
    except SystemExit as ended:
        assert not ended.code, ended.code
    return sorted({name.partition(".")[0] for name in sys.modules} | {
        name for name in sys.modules if name == "scipy.linalg"
    })

found = [loaded(["--help"]), loaded(sys.argv[1:])]
import json
open("loaded.json", "w").write(json.dumps(found))
"""
# of a mesh of gmsh's, of pictures, of tables as a data frame, of modes
RUN = {"gmsh", "pyvista", "matplotlib", "imageio", "PIL", "pandas", "scipy.linalg"}
RUN |= {"slepc4py"}
HELP = {"numpy", "pydantic", "mpi4py", "ufl", "basix", "dolfinx", "petsc4py", "scipy"}


def test_a_run_loads_what_it_needs(tmp_path: Path) -> None:
    run = ("run", "roll_up", "--no-pictures", "--quiet", "--out", "one")
    command = [sys.executable, "-c", CODE, *run]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    helped, ran = (set(names) for names in json.loads((tmp_path / "loaded.json").read_text()))
    assert not helped & (RUN | HELP)
    assert not ran & RUN
    # files are written all the same, and what is measured is there
    assert len(list((tmp_path / "one" / "fields").glob("strip_*.vtu"))) >= 2
    summary = json.loads((tmp_path / "one" / "summary.json").read_text())
    assert summary["results"]["closure_error_over_L"] < 1e-3
    # numbers are read back without what computes them
    code = "import sys, shellmb; shellmb.load('one').results; assert 'dolfinx' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, timeout=240)
