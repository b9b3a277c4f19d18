"""Regressors and classifiers that learn as C headers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sdnn.estimators.classifier import FIRING_SHARE
from sdnn.estimators.regressor import MARGIN
from sdnn.export.estimator_writer import EstimatorWriter, require_small
from sdnn.export.text import Tables, real_number, rounded_up

if TYPE_CHECKING:
    from sdnn.export.estimator_writer import Model

_MOST_COLUMNS = 2**15  # whose weights of 16 bits cannot overflow a potential
_MOST_UNITS = 2**16 - 1


class EstimatorLearner(EstimatorWriter):
    """Makes the header of an estimator that learns."""

    title = "a regressor or classifier that learns"
    file = "sdnn_learning_estimator.h"

    def __init__(self, model: Model, name: str) -> None:
        super().__init__(model, name)
        self.networks = (model.network_,)
        if self.pairs.most_columns > _MOST_COLUMNS or self.n_units > _MOST_UNITS:
            raise ValueError(
                f"model must have at most {_MOST_COLUMNS} columns that are not 0 and {_MOST_UNITS}"
                f" units to learn in C, got {self.pairs.most_columns} and {self.n_units}: train"
                " with fewer pairs, and smaller n_pattern_units, n_output_units or"
                " n_units_per_class"
            )

    def defines(self) -> dict[str, object]:
        """Return the macros of the units and of the learning rule."""
        model = self.model
        share = model.correction_share
        values = {
            **super().defines(),
            "CORRECTS_SHARE": int(share != 1.0),
            "SHARE": real_number(share),
            "REFUSES_OUTSIDE": int(model.out_of_range == "error"),
        }
        if not self.is_classifier:
            widens = int(model.out_of_range == "widen")
            return {**values, "WIDENS": widens, "MARGIN": real_number(MARGIN)}
        counts = self.group_size * np.array([FIRING_SHARE, 1 - FIRING_SHARE])
        of_class, of_others = np.minimum(0.5 + counts, self.group_size).astype(int).tolist()
        return {**values, "COUNT_OF_CLASS": of_class, "COUNT_OF_OTHERS": of_others}

    def add_networks(self, tables: Tables) -> dict[str, object]:
        """Add the weights that the estimator begins with; return the macro of the network."""
        (network,) = self.networks
        weights = require_small(network.layer.weights)
        columns = np.ascontiguousarray(weights.T).reshape(-1)
        is_byte = columns.min() >= -128 and columns.max() < 128
        about = "Weights at the beginning, column by column."
        tables.add("int8_t" if is_byte else "int16_t", "first_weights", columns, about)
        tables.add("int32_t", "first_thresholds", network.layer.thresholds)
        return {"N_NETWORKS": 1, "HAS_EXCESSES": 0}

    def ram_bytes(self) -> int:
        """Return the bytes of the struct."""
        n_bytes = 0 if self.is_classifier else 16 * self.model.n_outputs_  # ranges: two doubles
        n_bytes += self.n_units * (4 + 2 * self.code.core.n_columns + 2)  # threshold and weights
        return rounded_up(n_bytes, 4 if self.is_classifier else 8)

    def stack_bytes(self) -> int:
        """Return the bytes of the arrays that learning has on the stack."""
        n_groups = self.n_units // self.group_size
        n_bytes = super().ram_bytes() + rounded_up(7 * self.n_units, 4) + 8 * n_groups
        return n_bytes if self.is_classifier else n_bytes + 16 * n_groups

    def needs(self, flash_bytes: int) -> list[str]:
        """Return comment lines about memory."""
        return [
            f"Flash: {flash_bytes:,} bytes of constants; the code comes to some 4 to 7 kB.",
            f"RAM:   {self.ram_bytes():,} bytes, in one struct that you place, and"
            f" {self.stack_bytes():,} bytes of arrays",
            "       on the stack, with at most 640 bytes for all else there. No heap.",
        ]

    def calls(self) -> list[str]:
        """Return example lines of C that predict and learn."""
        name, macro = self.name, self.name.upper()
        begin = [
            f"static {name}_model model; // everything that it remembers",
            f"{name}_begin(&model);",
        ]
        if self.is_classifier:
            return [
                *begin,
                f"int32_t c = {name}_predict(&model, x); // the label is {name}_classes[c]; or -1",
                f"int is_learned = {name}_learn(&model, x, c); // with the true one",
            ]
        return [
            *begin,
            f"double y[{macro}_N_OUTPUTS];",
            f"int is_predicted = {name}_predict(&model, x, y);",
            f"int is_learned = {name}_learn(&model, x, y); // with the true outputs",
        ]
