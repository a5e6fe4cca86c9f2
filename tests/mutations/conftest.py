"""Names of tests that must catch faults: checked whenever all tests are collected."""

import pytest

from .test_mutations import FAULTS


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Refuse names of tests, with their parameters, that are not there."""
    if config.args != config.getini("testpaths"):
        return
    there = {item.nodeid for item in items}
    there |= {nodeid.partition("[")[0] for nodeid in there}
    unknown = {test for fault in FAULTS for test in fault.tests} - there
    if unknown:
        raise pytest.UsageError(f"faults name tests that do not exist: {sorted(unknown)}")
