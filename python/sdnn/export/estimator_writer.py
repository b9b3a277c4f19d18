"""Regressors and classifiers that predict as C headers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdnn.export.coded_inputs import add_inputs, coded_input
from sdnn.export.estimator_text import EstimatorHeader, HeaderText
from sdnn.export.input_pairs import PairTables
from sdnn.export.text import Tables, bits_of, rounded_up, weight_words
from sdnn.export.writer import require_few_weights

if TYPE_CHECKING:
    from sdnn.estimators import SDNNClassifier, SDNNRegressor
    from sdnn.estimators.network import Network

    Model: TypeAlias = SDNNRegressor | SDNNClassifier

_MOST_OF_TWO_BYTES = 32512
_MOST_16_BITS = 2**16 - 1
_EXCESS_BYTES = 8  # of a struct of sdnn_greedy_estimator.h
_NETWORK_BYTES = 20


class EstimatorWriter(HeaderText):
    """Makes the header of an estimator that predicts."""

    file: ClassVar[str] = "sdnn_greedy_estimator.h"
    remedy = (
        "train with the settings of sdnn.export.small_settings(), or with n_averaged_epochs=1, and"
        " smaller n_output_units, n_units_per_class, n_pattern_units or fewer pairs"
    )
    model: Model

    def __init__(self, model: Model, name: str) -> None:
        code = model.network_.input_code
        super().__init__(model, name, [coded_input(i, code.codings[i]) for i in code.used])
        self.networks: tuple[Network, ...] = (*model._earlier, model.network_)
        self.code = code
        self.pairs = PairTables(self.code)
        self.n_units: int = model.network_.n_units
        if self.pairs.m > _MOST_16_BITS or len(self.code.codings) > _MOST_16_BITS:
            raise ValueError(
                f"model must have at most {_MOST_16_BITS} features and n_pattern_units for a C"
                f" header, got {len(self.code.codings)} and {self.pairs.m}"
            )
        weights = len(self.networks) * self.n_units * self.code.core.n_columns
        require_few_weights(weights, "n_averaged_epochs, units")

    def about(self) -> str:
        """Describe the size of the estimator."""
        return f"{self.n_units} units over {self.code.core.n_columns} columns"

    @property
    def group_size(self) -> int:
        """Number of units of an output or a class."""
        each = self.model._n_units_each if self.is_classifier else self.model._counts_of_range
        return int(each)

    def defines(self) -> dict[str, object]:
        """Return the macros of the units."""
        model = self.model
        values: dict[str, object] = {
            "N_FEATURES": len(self.code.codings),
            "N_UNITS": self.n_units,
            "GROUP_SIZE": self.group_size,
            "N_GROUPS": self.n_units // self.group_size,
            "IS_CLASSIFIER": int(self.is_classifier),
        }
        if self.is_classifier:
            is_one_vs_one = int(model._scheme == "one_vs_one")
            return {**values, "N_CLASSES": len(model.classes_), "IS_ONE_VS_ONE": is_one_vs_one}
        counts = {"N_OUTPUTS": model.n_outputs_, "COUNTS_OF_RANGE": model._counts_of_range}
        return {**values, **counts}

    def header(self) -> EstimatorHeader:
        """Make the header."""
        tables = Tables(self.name)
        macros = self.defines() | add_inputs(tables, self.inputs) | self.pairs.add(tables)
        n_bytes = tables.n_bytes
        macros |= self.add_networks(tables)
        weight_bytes = tables.n_bytes - n_bytes
        if not self.is_classifier:
            about = "Lowest and highest outputs: bits of doubles."
            tables.add("uint64_t", "ranges", bits_of(self.model.output_range_), about)
        return EstimatorHeader(
            name=self.name,
            text=self.text(macros, tables),
            flash_bytes=tables.n_bytes,
            weight_bytes=weight_bytes,
            ram_bytes=self.ram_bytes(),
        )

    def add_networks(self, tables: Tables) -> dict[str, object]:
        """Add the weights of all networks to the tables; return the macros of the networks."""
        rows, excesses = [], list[str]()
        for number, network in enumerate(self.networks):
            weights = require_small(network.layer.weights)
            limited, excesses_of_network = self.split(weights)
            words, n_bytes = weight_words(limited)
            thresholds = network.layer.thresholds
            padded = np.pad(thresholds, (0, -len(thresholds) % 4))
            tables.add("uint32_t", f"weights_{number}", words, "Weights, those of four units each.")
            tables.add("int32_t", f"thresholds_{number}", padded)
            tables.add("uint8_t", f"weight_bytes_{number}", n_bytes)
            parts = ("weights", "thresholds", "weight_bytes")
            names = ", ".join(f"{self.name}_{part}_{number}" for part in parts)
            rows.append(f"{{{names}, {len(excesses)}, {len(excesses_of_network)}}},")
            excesses += excesses_of_network
        tables.n_bytes += _EXCESS_BYTES * len(excesses) + _NETWORK_BYTES * len(rows)
        macros = {"N_NETWORKS": len(rows), "NETWORKS": rows, "HAS_EXCESSES": int(bool(excesses))}
        return {**macros, "EXCESSES": in_lines(excesses)} if excesses else macros

    def split(self, weights: NDArray[np.int32]) -> tuple[NDArray[np.int32], list[str]]:
        """Limit the weights of four units to a byte where few exceed it, which takes less flash.

        Returns the weights, and C structs (unit, pair, column of the pair, excess) of the rest.
        """
        m, limited, rows = self.pairs.m, weights.copy(), []
        if max(len(weights), len(self.code.pairs)) > _MOST_16_BITS:
            return limited, []
        for first in range(0, len(weights), 4):
            four = weights[first : first + 4]
            clipped = four.clip(-128, 127)
            excess = four - clipped
            units, columns = np.nonzero(excess)
            # The alternative is a second byte for each of the four units' weights.
            if _EXCESS_BYTES * len(units) < 4 * weights.shape[1]:
                limited[first : first + 4] = clipped
                places = zip(units.tolist(), columns.tolist(), strict=True)
                rows += [
                    f"{{{first + unit},{column // m},{column % m},{excess[unit, column]}}},"
                    for unit, column in places
                ]
        return limited, rows

    def ram_bytes(self) -> int:
        """Return the bytes of the arrays on the stack."""
        column_bytes = 2 if self.code.core.n_columns <= 2**16 else 4
        n_groups, counts_units = self.n_units // self.group_size, self.group_size > 1
        n_bytes = rounded_up(column_bytes * self.pairs.most_columns, 4) + 8
        n_bytes += (
            4 * len(self.inputs) + (4 if counts_units or not self.is_classifier else 8) * n_groups
        )
        if self.is_classifier:
            n_bytes += (
                8 * len(self.model.classes_) * (3 if self.model._scheme == "one_vs_one" else 1)
            )
        return n_bytes


def require_small(weights: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return weights; ValueError if they need more than 16 bits."""
    largest = max(-int(weights.min()), int(weights.max()))
    if largest > _MOST_OF_TWO_BYTES:
        raise ValueError(
            f"model must have weights up to {_MOST_OF_TWO_BYTES} for a C header, got {largest}:"
            " train with a smaller max_iter"
        )
    return weights


def in_lines(rows: Iterable[str]) -> list[str]:
    """Join rows of C, five a line.

    >>> in_lines(["{1,2},"] * 3)
    ['{1,2},{1,2},{1,2},']
    """
    row_list = list(rows)
    return ["".join(row_list[begin : begin + 5]) for begin in range(0, len(row_list), 5)]
