"""Kernel estimators in C, compiled for this processor, against their sums in a fixed order.

``nox -s emulation`` has other compilers and processors.
"""

import pytest
from sklearn.exceptions import NotFittedError

from c_kernel_estimators import KERNEL_ESTIMATORS, check_kernel, fitted_kernel
from c_policies import SANITIZED
from refusals import refuses
from sdnn import SDNNKernelRidge
from sdnn.export import estimator_header


@pytest.mark.parametrize("name", KERNEL_ESTIMATORS)
def test_outputs_in_c_are_sums_in_the_order_of_the_samples(name, target, tmp_path):
    # A compiled program predicts 100 samples; NumPy adds the same terms one after the other.
    check_kernel(name, target, tmp_path, 100, *SANITIZED)


def test_limits_of_kernel_headers_count_samples_features_and_mixtures(monkeypatch):
    model, _ = fitted_kernel("directions")  # of 200 samples with four features
    n_mixtures, n_inputs = len(model.directions_), model.X_fit_.shape[1]
    sizes = f"200 samples of {n_inputs - n_mixtures} features and {n_mixtures} mixtures"
    assert sizes in estimator_header(model, "model").text
    with pytest.raises(ValueError, match=f"{sizes}.* smaller max_components"):
        estimator_header(model, "model", flash_bytes=1)
    monkeypatch.setattr("sdnn.export.kernel_writer._MOST_INPUTS", 4)
    with pytest.raises(ValueError, match=f"at most 4 .* mixtures .* got 4 and {n_mixtures}"):
        estimator_header(model, "model")


def test_kernel_estimators_do_not_learn_in_c():
    model, _ = fitted_kernel("directions")
    refuses("learning", estimator_header, model, "model", learning=True)
    with pytest.raises(NotFittedError):
        estimator_header(SDNNKernelRidge(), "model")
