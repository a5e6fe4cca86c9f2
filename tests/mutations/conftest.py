"""Tests that must catch faults are there and run every day: checked with all tests."""

import pytest

from .test_mutations import FAULTS

EVERY = pytest.StashKey[list[pytest.Item]]()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Refuse names of tests, with their parameters, that are not there."""
    if config.args != config.getini("testpaths"):
        return
    # before any are left out by `-m` or `-k`; they are marked behind this
    config.stash[EVERY] = list(items)
    there = {item.nodeid for item in items}
    there |= {nodeid.partition("[")[0] for nodeid in there}
    unknown = {test for fault in FAULTS for test in fault.tests} - there
    if unknown:
        raise pytest.UsageError(f"faults name tests that do not exist: {sorted(unknown)}")


@pytest.hookimpl(trylast=True, specname="pytest_collection_modifyitems")
def pytest_faults_are_caught_daily(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Refuse faults that no test of the README's second command catches."""
    if config.args != config.getini("testpaths"):
        return
    marked = {"slow", "ci"}
    every = config.stash[EVERY]
    daily = {i.nodeid for i in every if not marked & {mark.name for mark in i.iter_markers()}}
    daily |= {nodeid.partition("[")[0] for nodeid in daily}
    missed = [fault.name for fault in FAULTS if daily.isdisjoint(fault.tests)]
    if missed:
        raise pytest.UsageError(f"only slow tests, or those of CI, catch these faults: {missed}")
