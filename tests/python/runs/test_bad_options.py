"""Bad texts for every option and argument of every command."""

import pytest

import bad_options
from sdnn.cli import main
from watched_cells import failures


@pytest.mark.parametrize("command", bad_options.COMMANDS)
def test_bad_texts_are_told_or_work(monkeypatch, command):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("MPLBACKEND", "Agg")
    n_cells, failed = failures(bad_options.command_cells, command)
    assert failed == []
    assert n_cells >= 40


def test_every_command_has_its_row():
    assert set(main.commands) == set(bad_options.COMMANDS) | bad_options.LEFT_OUT
