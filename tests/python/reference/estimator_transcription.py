"""The regressor's and classifier's core as its sources write it: slow, plain NumPy.

Sources: Nonaka, Tanaka, Morita 2011 (selective desensitization for regression); Auer, Burgsteiner,
Maass 2008 (the p-delta rule). The classes have the names and arguments of those in ``sdnn._core``
and must agree with them bit for bit. What is drawn at random (patterns, first weights) is handed
over, or drawn from NumPy's generator where no agreement is asked for.
"""

from __future__ import annotations

import numpy as np


class SelectiveDesensitization:
    """x_SD: per pair (mu, nu), the pattern of input mu where that of nu is +1, elsewhere 0."""

    def __init__(self, modified, modifiers, pairs):
        self.modified = [np.asarray(table, dtype=np.int8) for table in modified]
        self.modifiers = [np.asarray(table, dtype=np.int8) for table in modifiers]
        self.pairs = np.asarray(pairs, dtype=np.int32)
        self.n_inputs = int(self.pairs.max()) + 1
        self.n_pairs = len(self.pairs)
        self.n_units = self.modified[0].shape[1]
        self.n_columns = self.n_pairs * self.n_units

    def transform(self, bins):
        blocks = [
            (1 + modifier[bins[:, nu]]) // 2 * modified[bins[:, mu]]
            for modified, modifier, (mu, nu) in zip(
                self.modified, self.modifiers, self.pairs, strict=True
            )
        ]
        return np.concatenate(blocks, axis=1)

    def gram(self, bins, other_bins=None):
        # Whole numbers below 2**24 are exact in 32-bit floats, and their products are fast.
        one = self.transform(bins).astype(np.float32)
        other = one if other_bins is None else self.transform(other_bins).astype(np.float32)
        return (one @ other.T).astype(np.int32)


class ParallelPerceptron:
    """N units, potential = weights . x_SD - threshold, all whole numbers."""

    def __init__(self, code, n_units, seed=0, weights=None, thresholds=None, initial_range=5):
        random = np.random.RandomState(seed % 2**32)
        drawn = random.randint(-initial_range, initial_range + 1, (n_units, code.n_columns))
        self.code = code
        self.n_units = n_units
        self.weights = np.array(drawn if weights is None else weights, dtype=np.int32)
        self.thresholds = np.array(
            np.zeros(n_units) if thresholds is None else thresholds, dtype=np.int32
        )

    def potentials(self, bins, n_threads=1):
        code = self.code.transform(bins).astype(np.float64)
        sums = code @ self.weights.T.astype(np.float64)
        return sums.astype(np.int32) - self.thresholds

    def counts(self, bins, n_groups=1, n_threads=1):
        firing = self.potentials(bins) > 0
        return firing.reshape(len(firing), n_groups, -1).sum(axis=2, dtype=np.int32)


class Trainer:
    """Both rules share this: present samples in order, correct some units by +-x_SD at once."""

    def __init__(self, layer, bins):
        self.layer = layer
        self.form = "plain"
        self.memory = 0
        self.code = layer.code.transform(bins).astype(np.int32)

    def present(self, order):
        n_samples = n_units = 0
        for t in order:
            x = self.code[t]
            potentials = self.layer.weights @ x - self.layer.thresholds
            changes = self.corrections(t, potentials)
            units = np.flatnonzero(changes)
            self.layer.weights[units] += np.outer(changes[units], x)
            self.layer.thresholds[units] -= changes[units]
            n_samples += len(units) > 0
            n_units += len(units)
        return n_samples, n_units

    def synchronize(self):
        pass


def p_delta(potentials, target, share=1.0):
    """+1, 0 or -1 per unit: the units nearest to their threshold on the wrong side."""
    error = min(max(int(target + 0.5), 0), len(potentials)) - np.count_nonzero(potentials > 0)
    n_delta = max(1, int(share * abs(error) + 0.5)) if error else 0
    changes = np.zeros(len(potentials), dtype=np.int32)
    if error > 0:
        off = np.flatnonzero(potentials <= 0)
        nearest = off[np.argsort(-potentials[off], kind="stable")[:n_delta]]
        changes[nearest] = 1
    else:
        on = np.flatnonzero(potentials > 0)
        nearest = on[np.argsort(potentials[on], kind="stable")[:n_delta]]
        changes[nearest] = -1
    return changes


class PDeltaTrainer(Trainer):
    """Regression: brings the number of firing units of each group to its target."""

    def __init__(self, layer, bins, targets, share=1.0, form="auto", memory_limit=0, n_threads=1):
        super().__init__(layer, bins)
        self.targets = np.asarray(targets, dtype=np.float64)
        self.share = share

    def corrections(self, t, potentials):
        groups = np.split(potentials, self.targets.shape[1])
        return np.concatenate(
            [
                p_delta(group, target, self.share)
                for group, target in zip(groups, self.targets[t], strict=True)
            ]
        )


def class_pairs(n_classes):
    """The units of one-versus-one: (0, 1), (0, 2), ..., (1, 2), ...; firing votes for the first."""
    return [(i, j) for i in range(n_classes) for j in range(i + 1, n_classes)]


class PerceptronTrainer(Trainer):
    """Classification: corrects every unit that answers wrongly."""

    def __init__(
        self, layer, bins, labels, n_classes, scheme, form="auto", memory_limit=0, n_threads=1
    ):
        super().__init__(layer, bins)
        self.labels = np.asarray(labels)
        self.n_classes = n_classes
        self.scheme = scheme

    def corrections(self, t, potentials):
        label = self.labels[t]
        if self.scheme == "one_vs_rest":
            wanted = np.where(np.arange(len(potentials)) == label, 1, -1)
        else:
            pairs = class_pairs(self.n_classes)
            wanted = np.array([1 if i == label else -1 if j == label else 0 for i, j in pairs])
        return np.where((potentials > 0) == (wanted > 0), 0, wanted).astype(np.int32)
