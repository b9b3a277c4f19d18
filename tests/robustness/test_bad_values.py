"""Bad values of every argument, setting, option and file: refused by name, or taken and at work."""

import pytest

from matrices import N_MUTATIONS, ROWS, name_of
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
"""Cells that a row must have, so that none is empty; others 700."""


@pytest.mark.parametrize("row", ROWS, ids=name_of)
def test_all_bad_values_are_refused_by_name_or_accepted(row, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("MPLBACKEND", "Agg")
    make_cells, *arguments = row
    n_cells, failed = failures(make_cells, *arguments)
    assert not failed, "\n".join(failed[:20])
    assert n_cells >= LEAST.get(make_cells.__name__, 700)
