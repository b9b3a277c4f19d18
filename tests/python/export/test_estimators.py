"""Regressors and classifiers in C, compiled for this processor and compared bit for bit.

``nox -s emulation`` has other compilers and processors.
"""

import pytest

from c_estimators import ESTIMATORS, check_predictions
from c_policies import TARGETS

SANITIZED = ("-fsanitize=undefined", "-fno-sanitize-recover=all", "-fsanitize=address")


@pytest.fixture
def target(needs):
    needs(TARGETS["x86-64"].compiler, options=SANITIZED)
    return TARGETS["x86-64"]


@pytest.mark.parametrize("name", ESTIMATORS)
def test_predictions_in_c_have_the_bits_of_the_estimator(name, target, tmp_path):
    check_predictions(name, target, tmp_path, 300, *SANITIZED)
