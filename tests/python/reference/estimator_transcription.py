"""The regressor's and classifier's core transcribed into plain NumPy from the papers.

Nonaka, Tanaka, Morita 2011 (selective desensitization for regression); Auer, Burgsteiner,
Maass 2008 (the p-delta rule). The classes have the names of those in ``sdnn._core`` and must agree
with them bit for bit. Patterns and first weights, which are random, are those of the core.
"""

from __future__ import annotations

import numpy as np


class SelectiveDesensitization:
    """x_SD: per pair (mu, nu), the pattern of input mu where that of nu is +1, elsewhere 0."""

    def __init__(self, modified, modifiers, pairs):
        self.modified = [np.asarray(table, dtype=np.int8) for table in modified]
        self.modifiers = [np.asarray(table, dtype=np.int8) for table in modifiers]
        self.pairs = np.asarray(pairs, dtype=np.int32)

    def transform(self, bins):
        blocks = [
            (1 + modifier[bins[:, nu]]) // 2 * modified[bins[:, mu]]
            for modified, modifier, (mu, nu) in zip(
                self.modified, self.modifiers, self.pairs, strict=True
            )
        ]
        return np.concatenate(blocks, axis=1)


class ParallelPerceptron:
    """Units with potentials weights . x_SD - threshold, all integers."""

    def __init__(self, code, weights, thresholds):
        self.code = code
        self.weights = np.array(weights, dtype=np.int32)
        self.thresholds = np.array(thresholds, dtype=np.int32)

    def potentials(self, bins):
        code = self.code.transform(bins).astype(np.float64)
        sums = code @ self.weights.T.astype(np.float64)
        return sums.astype(np.int32) - self.thresholds

    def counts(self, bins, n_groups):
        firing = self.potentials(bins) > 0
        return firing.reshape(len(firing), n_groups, -1).sum(axis=2, dtype=np.int32)


class Trainer:
    """Presents samples in order; both rules correct some units by +-x_SD at once."""

    def __init__(self, layer, bins):
        self.layer = layer
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


def p_delta(potentials, target, share=1.0):
    """Return +1, 0 or -1 for each unit: those nearest to their threshold are corrected.

    They are on the side of it where too many units are.
    """
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

    def __init__(self, layer, bins, targets, share=1.0):
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
    """Return the classes that each unit tells apart: (0, 1), (0, 2), ..., (1, 2), and so on.

    A firing unit votes for the first of its pair.
    """
    return [(i, j) for i in range(n_classes) for j in range(i + 1, n_classes)]


class PerceptronTrainer(Trainer):
    """Classification: corrects every unit that answers wrongly."""

    def __init__(self, layer, bins, labels, n_classes, scheme):
        super().__init__(layer, bins)
        self.labels = np.asarray(labels)
        self.n_classes = n_classes
        self.scheme = scheme

    def corrections(self, t, potentials):
        label = self.labels[t]
        if self.scheme == "one_vs_rest":
            targets = np.where(np.arange(len(potentials)) == label, 1, -1)
        else:
            pairs = class_pairs(self.n_classes)
            targets = np.array([1 if i == label else -1 if j == label else 0 for i, j in pairs])
        return np.where((potentials > 0) == (targets > 0), 0, targets).astype(np.int32)
