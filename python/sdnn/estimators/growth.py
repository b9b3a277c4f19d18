"""Inputs and categories that are added to a trained network, whose predictions stay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.coding import Coding
from sdnn.estimators.base import BaseSDNN
from sdnn.estimators.columns import PAIR_BUDGET, Pairs
from sdnn.estimators.network import InputCode, Network, require_memory
from sdnn.estimators.network_settings import settings_of

Table = NDArray[np.int8]


def pairs_of_new(n_before: int, n_new: int, random: np.random.RandomState) -> Pairs:
    """Return the pairs that new inputs form; beyond the budget, a random share of them.

    >>> pairs_of_new(2, 1, np.random.RandomState(0))
    [(2, 0), (0, 2), (2, 1), (1, 2)]
    """
    pairs: Pairs = []
    for new in range(n_before, n_before + n_new):
        others = np.arange(new)  # each pairs with the new input in both orders
        if (new + 1) * new > PAIR_BUDGET:
            others = random.permutation(others)[: max(1, PAIR_BUDGET // (2 * (new + 1)))]
        for other in np.sort(others).tolist():
            pairs += [(new, other), (other, new)]
    return pairs


def grow(
    model: BaseSDNN, new: Mapping[str, Coding], changed: Mapping[int, Coding], most_columns: int
) -> bool:
    """Add new inputs to a trained model, and give some inputs codings with more categories.

    The new weights are 0, so that predictions stay as they are. All codings are fitted; each one
    in ``changed`` has a pattern for missing values, its last. Return False, and change nothing, if
    the code would have more columns than ``most_columns``.
    """
    network, before = model.network_, model.network_.input_code
    n_before, n_units = len(before.codings), before.core.n_units
    # Each growth adds patterns, so that their number gives every growth another seed, of 32 bits.
    n_patterns = sum(coding.size for coding in before.codings)
    random = np.random.RandomState((model._weight_seed + n_patterns) % 2**32)
    added = pairs_of_new(n_before, len(new), random)
    pairs = [*before.pairs, *added]
    if len(pairs) * n_units > most_columns:
        return False
    codings = [changed.get(index, coding) for index, coding in enumerate(before.codings)]
    codings += new.values()
    require_memory(model.memory_limit, network.n_units, 1, n_units, codings, pairs)
    code = grown_code(before, codings, added, random)
    weights = np.zeros((network.n_units, code.core.n_columns), dtype=np.int32)
    weights[:, : before.core.n_columns] = network.layer.weights
    names = [*model.feature_names_in_.tolist(), *new]
    work = model._copy_to_train()
    thresholds = network.layer.thresholds
    work.network_ = Network(code, network.n_units, weights=weights, thresholds=thresholds)
    work._earlier = ()
    work.feature_names_in_ = np.array(names, dtype=object)
    work.n_features_in_ = len(names)
    work.coding = [(coding, [name]) for coding, name in zip(codings, names, strict=True)]
    work._begun_with = settings_of(work)
    model.__dict__ = work.__dict__
    return True


def grown_code(
    before: InputCode, codings: Sequence[Coding], added: Pairs, random: np.random.RandomState
) -> InputCode:
    """Return a code with the columns of an earlier one, and then those of added pairs.

    ``codings`` are those of the earlier inputs, some with more categories, and then of new inputs.
    """
    n_before, n_units = len(before.codings), before.core.n_units
    tables: dict[int, Table] = {}  # by `id` of the old table, which several pairs may share

    def lengthened(table: Table, index: int) -> Table:
        """Return a table with random patterns before the last one, which is for missing values."""
        n_new = codings[index].size - len(table)
        if n_new and id(table) not in tables:
            drawn = _core.symbol_patterns(n_new, n_units, int(random.randint(2**31 - 1)))
            tables[id(table)] = np.vstack([table[:-1], drawn, table[-1:]])
        return tables.get(id(table), table)

    modified = [
        lengthened(table, mu) for (mu, _), table in zip(before.pairs, before.modified, strict=True)
    ]
    modifiers = [
        np.ones((codings[nu].size, n_units), np.int8) if mu == nu else lengthened(table, nu)
        for (mu, nu), table in zip(before.pairs, before.modifiers, strict=True)
    ]
    # New pairs use the table of an earlier input as modified; only if it has none, as a modifier.
    patterns = {nu: table for (_, nu), table in zip(before.pairs, modifiers, strict=True)}
    patterns |= {mu: table for (mu, _), table in zip(before.pairs, modified, strict=True)}
    for index in range(n_before, len(codings)):
        patterns[index] = codings[index].patterns(n_units, int(random.randint(2**31 - 1)))
    for mu, nu in added:
        modified.append(patterns[mu])
        modifiers.append(np.ascontiguousarray(patterns[nu][:, random.permutation(n_units)]))
    return InputCode(codings, [*before.pairs, *added], modified, modifiers)
