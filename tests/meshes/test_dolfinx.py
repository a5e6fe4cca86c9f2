"""Without DOLFINx, or with another one, shellmb says so before anything else fails."""

import subprocess
import sys

import pytest


def said(before: str) -> subprocess.CompletedProcess[str]:
    code = f"import sys\n{before}\nimport shellmb.meshes\n"
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=240)


def test_without_it() -> None:
    got = said("sys.modules['dolfinx'] = None")
    assert got.returncode == 1
    assert "is not installed" in got.stderr and "shellmb[wheel]" in got.stderr


@pytest.mark.parametrize(("version", "silent"), [("0.11.3", True), ("0.12.0", False)])
def test_another_one(version: str, silent: bool) -> None:
    made = f"m = types.ModuleType('dolfinx')\nm.__version__ = '{version}'"
    got = said(f"import types\n{made}\nsys.modules['dolfinx'] = m")
    assert got.returncode == 0
    assert ("DOLFINx is 0.12.0" in got.stderr) is not silent
