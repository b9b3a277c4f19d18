"""Settings of regressors and classifiers for small processors."""

from __future__ import annotations

from sdnn.support.arguments import require, whole

_N_WEIGHTS = 30_720  # of a network: 60 kB in 16 bits, and in bytes 90 kB for three networks
_N_UNITS = 64
_MOST_PAIRS = 20
_MOST_PATTERN_UNITS = 480
_MOST_EPOCHS = 80

Pairs = list[tuple[int, int | None]]


def small_settings(
    n_inputs: int, *, n_outputs: int | None = None, n_classes: int | None = None
) -> dict[str, object]:
    """Return parameters with which an estimator fits a small processor.

    Up to about 20 inputs the C header takes at most 128 kB of flash. Predictions need less than 16
    kB of RAM, and learning on the processor at most 64 kB. Chosen on five data sets with four
    inputs; see docs/how-to/estimators-on-a-chip.md.

    Parameters
    ----------
    n_inputs : int
        Number of features.
    n_outputs : int, optional
        Number of outputs of an `SDNNRegressor`; by default 1.
    n_classes : int, optional
        Number of classes, for the parameters of an `SDNNClassifier`.

    Examples
    --------
    >>> from sdnn import SDNNRegressor
    >>> model = SDNNRegressor(**small_settings(4), random_state=0)
    >>> model.n_output_units, model.n_pattern_units, len(model.pairs)
    (64, 80, 6)
    """
    n_inputs = whole("n_inputs", n_inputs, 1, 2**16)
    is_single = n_outputs is None or n_classes is None
    require(is_single, "n_classes", "be None with n_outputs", n_classes)
    pairs = each_pair_once(n_inputs)
    settings: dict[str, object] = {
        "pairs": pairs,
        "n_averaged_epochs": 3,
        "max_iter": _MOST_EPOCHS,
    }
    if n_classes is None:
        n_groups = 1 if n_outputs is None else whole("n_outputs", n_outputs, 1, 2**16)
        n_units = max(8, _N_UNITS // n_groups)
        settings |= {"n_output_units": n_units, "correction_share": 0.3}
    else:
        n_groups = whole("n_classes", n_classes, 2, 1024)
        n_units = max(2, _N_UNITS // n_groups)
        settings |= {"n_units_per_class": n_units}
    n_columns = _N_WEIGHTS // (n_groups * n_units)
    even = 2 * (n_columns // len(pairs) // 2)
    return {**settings, "n_pattern_units": min(_MOST_PATTERN_UNITS, max(8, even))}


def each_pair_once(n_inputs: int) -> Pairs:
    """Return pairs in which each two inputs occur once; of many inputs only some pairs.

    Every input modifies, and is modified, about equally often.

    >>> each_pair_once(4)
    [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3)]
    >>> each_pair_once(1), each_pair_once(2), len(each_pair_once(30))
    ([(0, None)], [(0, 1)], 30)
    """
    if n_inputs == 1:
        return [(0, None)]
    pairs: Pairs = []
    for away in range(1, n_inputs // 2 + 1):
        n_new = n_inputs // 2 if 2 * away == n_inputs else n_inputs
        if pairs and len(pairs) + n_new > _MOST_PAIRS:
            break
        pairs += [(first, (first + away) % n_inputs) for first in range(n_new)]
    return pairs
