"""Bad values of every argument, setting, option and file are refused by name, or work."""

import os

import pytest

from matrices import N_MUTATIONS, ROWS, name_of, sample_cells
from watched_cells import failures

LEAST = {
    "constructor_cells": 300,
    "setting_cells": 300,
    "transition_cells": 150,
    "method_cells": 150,
    "file_cells": 300,
    "loop_cells": 500,
    "command_cells": 40,
    "mutation_cells": N_MUTATIONS,
    "damage_cells": 120,
    "single_input_cells": 32,
    "log_cells": 90,
    "missing_reading_cells": 490,
}
"""Numbers of cells that rows, by their functions, must have at least, so that none is empty."""

LEAST_OF_OTHERS = 700

EVERY = 1 if "SDNN_WEEKLY" in os.environ else 11
"""Every eleventh cell of a row is tried for every change, all of them weekly.

Rows have 13, 14, 24 or 46 bad values for each parameter. Eleven divides none of these numbers, so
that the sample has all of a row's bad values, with different parameters.
"""


@pytest.mark.parametrize("row", ROWS, ids=name_of)
def test_bad_values_are_refused_by_name_or_accepted(row, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("MPLBACKEND", "Agg")
    n_cells, failed = failures(sample_cells, [row], EVERY)
    assert not failed, "\n".join(failed[:20])
    assert n_cells >= LEAST.get(row[0].__name__, LEAST_OF_OTHERS) // EVERY
