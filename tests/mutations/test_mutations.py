"""Mutation testing: each of a list of one-line faults is caught by the tests named for it.

A fault is put into a copy of the packages that comes first on the path of Python; the named tests
are run there, and each has to fail. The copies are made anew for every fault, the checkout is never
touched. Kernels of faulty forms have signatures of their own and so do not disturb the others in
the cache.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from . import (
    faults,
    faults_control,
    faults_derived,
    faults_faces,
    faults_locations,
    faults_recent,
    faults_reports,
    faults_said,
    faults_solution,
)
from .faults import Fault

FAULTS = (
    *faults.FAULTS,
    *faults_solution.FAULTS,
    *faults_locations.FAULTS,
    *faults_control.FAULTS,
    *faults_said.FAULTS,
    *faults_recent.FAULTS,
    *faults_reports.FAULTS,
    *faults_faces.FAULTS,
    *faults_derived.FAULTS,
)

ROOT = Path(__file__).parents[2]
# a test that does not end within this is no quick one [s]
LIMIT = 900.0


def copied(folder: Path) -> Path:
    """A copy of the package as it is installed: forms and demos inside of it."""
    package = folder / "shellmb"
    shutil.copytree(
        ROOT / "shellmb", package, ignore=shutil.ignore_patterns("__pycache__", "figures")
    )
    return package


def place(package: Path, fault: Fault) -> Path:
    """Its file in a copy."""
    parts = Path(fault.file).parts
    return package.joinpath(*(parts[1:] if parts[0] == "shellmb" else parts))


def python(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Python with the copy first on its path; -P: without the working directory before it."""
    return subprocess.run(
        [sys.executable, "-P", *arguments],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )


def test_each_fragment_is_there_once() -> None:
    """Where code was rewritten, the list has to follow."""
    found = []
    for fault in FAULTS:
        count = (ROOT / fault.file).read_text().count(fault.fragment)
        if count != 1:
            found.append(
                f"fault '{fault.name}': its fragment stands {count} times in {fault.file}, and "
                f"must once; give the line that does now what this one did:\n{fault.fragment}"
            )
        if fault.instead == fault.fragment:
            found.append(f"fault '{fault.name}' changes nothing")
        for test in fault.tests:
            file, _, name = test.partition("::")
            if f"def {name.partition('[')[0]}(" not in (ROOT / file).read_text():
                found.append(f"fault '{fault.name}': there is no test {test}")
    assert not found, "\n".join(found)


def test_names_are_different() -> None:
    assert len({fault.name for fault in FAULTS}) == len(FAULTS) >= 100


def test_copies_are_what_is_run(tmp_path: Path) -> None:
    package = copied(tmp_path)
    modules = ("shellmb", "shellmb.forms", "shellmb.demos", "shellmb.system")
    code = f"import {', '.join(modules)}\nfor m in ({', '.join(modules)}): print(m.__file__)"
    done = python(tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr
    assert all(Path(line).is_relative_to(package) for line in done.stdout.split())


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault_is_caught(fault: Fault, tmp_path: Path) -> None:
    package = copied(tmp_path)
    file = place(package, fault)
    text = file.read_text()
    assert text.count(fault.fragment) == 1, f"fragment not found in {fault.file}: {fault.fragment}"
    file.write_text(text.replace(fault.fragment, fault.instead))
    options = ("-n0", "-q", "-rf", "--tb=line", "-p", "no:cacheprovider", "-m", "")
    done = python(tmp_path, "-m", "pytest", *options, *fault.tests)
    # 1: tests were run and some failed; 2 to 5: they were not run at all
    assert done.returncode in (0, 1), f"the tests could not be run:\n{done.stdout}{done.stderr}"
    failed = [
        line.removeprefix("FAILED ") for line in done.stdout.splitlines() if line[:7] == "FAILED "
    ]
    missed = [test for test in fault.tests if not any(line.startswith(test) for line in failed)]
    assert not missed, (
        f"'{fault.name}' is not caught: in {fault.file} '{fault.fragment}' became "
        f"'{fault.instead}', and these passed: {', '.join(missed)}"
    )
