"""The compiler of this processor, for tests of C headers."""

import pytest

from c_policies import SANITIZED, TARGETS


@pytest.fixture
def target(needs):
    """The compiler, which must have sanitizers."""
    needs(TARGETS["x86-64"].compiler, options=SANITIZED)
    return TARGETS["x86-64"]
