"""The progress bar of a training."""

import sys

import gymnasium as gym
import pytest

from sdnn.agents import RBFQLearning


@pytest.mark.parametrize("goal", [{"steps": 200}, {"episodes": 5}], ids=["steps", "episodes"])
def test_train_with_progress_shows_a_bar_on_a_terminal_only(goal, capsys, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    for is_terminal in (False, True):
        monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal)  # noqa: B023
        env, other = (gym.make("Pendulum-v1", max_episode_steps=40) for _ in range(2))
        evaluations = {"evaluate_every": 40, "evaluation_env": other, "evaluation_episodes": 1}
        RBFQLearning(env).train(env, progress=True, **goal, **evaluations)
        output = capsys.readouterr()
        assert output.out == ""
        assert ("learning" in output.err) == is_terminal
        assert (output.err == "") != is_terminal


def test_a_notebook_shows_the_progress_of_long_trainings_only():
    nbclient, nbformat = map(pytest.importorskip, ("nbclient", "nbformat"))
    source = """import gymnasium as gym
from sdnn import agents; from sdnn.training import callbacks
callbacks.SHOWN_AFTER, env = {}, gym.make("Pendulum-v1")
agents.RBFQLearning(env).train(env, 500)"""
    # A cell shows the result, and before it a bar if the training takes longer than some seconds.
    for seconds, n_outputs in ((0.0, 2), (60.0, 1)):
        cell = nbformat.v4.new_code_cell(source.format(seconds))
        notebook = nbformat.v4.new_notebook(cells=[cell])
        nbclient.NotebookClient(notebook, kernel_name="python3").execute()
        assert (len(cell.outputs), "100%" in str(cell.outputs)) == (n_outputs, n_outputs == 2)
