"""Bad values of every argument, setting and file: refused by name, or taken and at work."""

import pytest

import bad_inputs
from watched_cells import failures, faulty_cells

AGENTS = [kind.__name__ for kind in bad_inputs.SETTINGS]
ROWS = [
    *((bad_inputs.constructor_cells, name) for name in AGENTS),
    *((bad_inputs.setting_cells, name) for name in AGENTS),
    *((bad_inputs.transition_cells, kind) for kind in bad_inputs.KINDS),
    *((bad_inputs.method_cells, kind) for kind in bad_inputs.KINDS),
    *((bad_inputs.file_cells, kind) for kind in AGENTS),
    (bad_inputs.loop_cells,),
]
LEAST = {
    "constructor_cells": 300,
    "setting_cells": 300,
    "transition_cells": 150,
    "method_cells": 150,
    "file_cells": 300,
    "loop_cells": 500,
}
"""Cells that a row must have, so that none is empty."""


@pytest.mark.parametrize("row", ROWS, ids=lambda row: "-".join([row[0].__name__, *row[1:]]))
def test_bad_values_are_refused_by_name_or_work(row):
    make_cells, *arguments = row
    n_cells, failed = failures(make_cells, *arguments)
    assert failed == []
    assert n_cells >= LEAST[make_cells.__name__]


def test_crashes_and_hangs_are_failed_cells(monkeypatch):
    monkeypatch.setattr("watched_cells.HANG_SECONDS", 5.0)
    n_cells, failed = failures(faulty_cells)
    assert n_cells == 7
    assert failed[:2] == ["wrong: was wrong", "raising: ZeroDivisionError: division by zero"]
    assert failed[2] == "hanging: hangs for more than 5.0 s"
    assert failed[3].startswith("crashing: ended the process with exit code -6")
    assert failed[4].startswith("eating: MemoryError")
    assert failed[5:] == ["last: was last"]


def test_a_new_parameter_is_covered_by_itself():
    cells = [name for name, _ in bad_inputs.constructor_cells("SDNNQLearning")]
    for parameter in bad_inputs.parameters_of(bad_inputs.SDNNQLearning.__init__):
        assert sum(f"({parameter}=" in name for name in cells) >= len(bad_inputs.BAD)
