"""Bad values of every argument, setting, option and file are refused by name, or work.

A cell of a matrix gives one bad value to one parameter. Here a sample of the cells is run;
``nox -s robustness`` runs more, ``nox -s robustness-weekly`` all.
"""

import pytest

import bad_inputs
import bad_options
import bad_values
import core_cells
from matrices import MATRICES, sample_cells
from sdnn.cli import main
from watched_cells import failures, faulty_cells

STRIDES = {"agents": 41, "core": 41, "classes": 41, "commands": 29, "files": 47}
"""Distances between the cells that are run. They are primes, so that all bad values are sampled."""


@pytest.mark.parametrize("matrix", MATRICES)
def test_a_sample_of_bad_values_is_refused_by_name_or_accepted(matrix, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("MPLBACKEND", "Agg")
    n_cells, failed = failures(sample_cells, MATRICES[matrix], STRIDES[matrix])
    assert failed == []
    assert n_cells >= 40


def test_crashes_and_hangs_are_failed_cells(monkeypatch):
    monkeypatch.setattr("watched_cells.HANG_SECONDS", 5.0)
    n_cells, failed = failures(faulty_cells)
    assert n_cells == 7  # the first works; the others are wrong, raise, hang, crash, and so on
    assert failed[:2] == ["wrong: was wrong", "raising: ZeroDivisionError: division by zero"]
    assert failed[2] == "hanging: hangs for more than 5.0 s"
    assert failed[3].startswith("crashing: ended the process with exit code -6")  # SIGABRT
    assert failed[4].startswith("eating: MemoryError")
    assert failed[5:] == ["last: was last"]


def test_every_constructor_parameter_has_cells_of_the_matrix():
    cells = [name for name, _ in bad_inputs.constructor_cells("SDNNQLearning")]
    for parameter in bad_values.parameters_of(bad_inputs.SDNNQLearning.__init__):
        assert sum(f"({parameter}=" in name for name in cells) >= len(bad_values.BAD)


def test_every_command_has_bad_options_that_are_tested():
    assert set(main.commands) == set(bad_options.COMMANDS) | bad_options.LEFT_OUT


def test_every_class_of_the_core_has_valid_arguments_in_the_matrix():
    configs = {cls.__name__ for cls in core_cells.CLASSES if cls.__name__.endswith("Config")}
    classes = {cls.__name__ for cls in core_cells.CLASSES}
    assert classes - configs <= set(core_cells.GOOD)
    for name in core_cells.GOOD:
        core_cells.valid_object(name)
