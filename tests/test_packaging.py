"""What is installed besides the modules: licence, data, entry point, lock."""

import re
import subprocess
import sys
import tomllib
from collections.abc import Callable
from importlib.metadata import distribution, entry_points
from pathlib import Path

import pytest
from typer.testing import CliRunner

import shellmb
from shellmb.cli.main import OF_CHECKOUTS, app

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def test_versions_agree() -> None:
    assert PROJECT["project"]["version"] == distribution("shellmb").version == shellmb.__version__


def test_data_files_are_packaged() -> None:
    """All that is no module: tables of values, loops in C, types."""
    packaged = {
        path
        for package, patterns in PROJECT["tool"]["setuptools"]["package-data"].items()
        for pattern in patterns
        for path in (ROOT / package.replace(".", "/")).glob(pattern)
    }
    there = {path for path in (ROOT / "shellmb").rglob("*") if path.is_file()}
    there |= set((ROOT / "shellmb/demos/references/data").iterdir())
    # the loops are compiled in place where the installation is editable
    made = {path for path in there if path.suffix in {".py", ".so"}}
    made |= {path for path in there if path.parent.name == "__pycache__"}
    assert there - made == packaged


def test_evidence_is_not_installed() -> None:
    """What measures the package, and what makes the paper's figures, stays in the checkout."""
    packages = PROJECT["tool"]["setuptools"]["packages"]
    roots = {name.split(".")[0] for name in packages}
    assert roots == {"shellmb"}
    named = {part for name in packages for part in name.split(".")}
    assert not named & {"bench", "effects", "figures", "paper", "peers", "tests", "verification"}
    assert "shellmb.demos.studies" not in packages
    for command, module in OF_CHECKOUTS.items():
        said = CliRunner().invoke(app, [command, "--json"])
        assert said.exit_code == 2 and module in said.output, said.output
        assert (ROOT / module.split()[-1].replace(".", "/") / "__main__.py").is_file()


@pytest.mark.parametrize("command", ["verify --slow", "study --bundled all", "effects sudden_load"])
def test_a_wheel_says_where_evidence_is(command: str, tmp_path: Path) -> None:
    """An installation is what the list of packages says; the commands of a checkout name it."""
    for name in PROJECT["tool"]["setuptools"]["packages"]:
        to = tmp_path / name.replace(".", "/")
        to.mkdir(parents=True, exist_ok=True)
        for path in (ROOT / name.replace(".", "/")).glob("*.py"):
            (to / path.name).symlink_to(path)
    said = subprocess.run(
        [sys.executable, "-m", "shellmb.cli", *command.split()],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert said.returncode == 2
    (line,) = said.stderr.splitlines()
    assert re.fullmatch(
        r"error: `(shellmb (verify|study --bundled|effects))` belongs to a checkout of shellmb, "
        r"run it there: `python3 -m uv run \1`",
        line,
    )


def test_command() -> None:
    (script,) = entry_points(group="console_scripts", name="shellmb")
    assert script.value == "shellmb.cli:app"


def test_bundled_packages_are_the_top_level_folders() -> None:
    code = "from shellmb import demos, forms; print(*forms.__path__, *demos.__path__, sep='\\n')"
    # from elsewhere: they must be found through the installed package alone
    paths = subprocess.check_output([sys.executable, "-c", code], text=True, cwd="/").splitlines()
    assert [Path(path).resolve() for path in paths] == [ROOT / "forms", ROOT / "demos"]


def test_an_editable_install_is_a_folder_on_the_path() -> None:
    """Editors and mypy follow no import hook; and nothing but `shellmb` may be in that folder."""
    files = [f for f in distribution("shellmb").files or () if f.suffix == ".pth"]
    for file in files:
        (line,) = Path(str(file.locate())).read_text().splitlines()
        packages = [p.name for p in Path(line).iterdir() if not p.name.endswith(".egg-info")]
        assert packages == ["shellmb"]


@pytest.mark.mpi
def test_ranks_see_each_other(mpirun: Callable[..., str]) -> None:
    """The mpiexec of the environment belongs to the MPI library that mpi4py loads."""
    code = "from mpi4py import MPI; c = MPI.COMM_WORLD; n = c.allreduce(1); c.rank or print(n)"
    assert mpirun(2, "-c", code).split() == ["2"]
