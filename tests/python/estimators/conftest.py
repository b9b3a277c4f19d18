"""Fixtures of the tests of estimators."""

import pytest


@pytest.fixture(scope="session")
def river():
    """Return the module of river's estimators; skip the test where river is not installed."""
    return pytest.importorskip("sdnn.estimators.river")
