"""The line of progress of a training."""

from io import StringIO

import gymnasium as gym
import pytest
from rich.console import Console

from sdnn.agents import RBFQLearning, Training
from sdnn.training.callbacks import ProgressBarCallback


@pytest.mark.parametrize("is_terminal", [True, False])
@pytest.mark.parametrize("goal", [{"steps": 200}, {"episodes": 5}])
def test_a_line_on_a_terminal_and_nothing_elsewhere(is_terminal, goal):
    env = gym.make("Pendulum-v1", max_episode_steps=40)
    agent = RBFQLearning(env.observation_space, env.action_space)
    text = StringIO()
    console = Console(file=text, force_terminal=is_terminal, width=120)
    callbacks = [ProgressBarCallback("Drifting", seconds=0.0, console=console)]
    training = Training(
        agent,
        env,
        callbacks=callbacks,
        evaluate_every=40,
        evaluation_env=gym.make("Pendulum-v1", max_episode_steps=40),
        evaluation_episodes=1,
        **goal,
    )
    training.run()
    assert ("Drifting" in text.getvalue()) == is_terminal
    if not is_terminal:
        assert text.getvalue() == ""


def test_train_shows_progress_on_request(capsys):
    env = gym.make("Pendulum-v1", max_episode_steps=40)
    agent = RBFQLearning(env.observation_space, env.action_space)
    assert agent.train(env, steps=100, progress=True).n_steps == 100
    assert capsys.readouterr().out == ""


def test_a_notebook_shows_it_where_a_training_is_long():
    nbclient, nbformat = map(pytest.importorskip, ("nbclient", "nbformat"))
    source = """import gymnasium as gym
from sdnn import agents; from sdnn.training import callbacks
callbacks.SHOWN_AFTER, env = {}, gym.make("Pendulum-v1")
agents.RBFQLearning(env).train(env, 500)"""
    for limit, n_outputs in ((0.0, 2), (60.0, 1)):
        cell = nbformat.v4.new_code_cell(source.format(limit))
        notebook = nbformat.v4.new_notebook(cells=[cell])
        nbclient.NotebookClient(notebook, kernel_name="python3").execute()
        assert (len(cell.outputs), "100%" in str(cell.outputs)) == (n_outputs, n_outputs == 2)
