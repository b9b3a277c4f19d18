"""Learning rate and epsilon: schedules of the progress, and rates that are set by hand."""

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn.agents import (
    Callback,
    FuzzyQLearning,
    QLearningConfig,
    RBFQLearning,
    Schedule,
    SDNNQLearning,
    Training,
    Transition,
    load_agent,
)
from sdnn.approximators import RBFNetworkConfig, SDNNCConfig
from stopped_training import check_exact_resume

SMALL = SDNNCConfig(n_pattern_units=20, n_hidden_units=60, n_active_units=20, n_actions=5)
DECREASING = {
    "learning_rate": 0.8,
    "final_learning_rate": 0.05,
    "epsilon": 0.5,
    "final_epsilon": 0.02,
}
TORQUE = gym.spaces.Box(-2.0, 2.0, (1,), dtype=np.float32)
PLANE = gym.spaces.Box(-1.0, 1.0, (2,))
UNBOUNDED = gym.spaces.Box(-np.inf, np.inf, (2,))


def new_agent(space=PLANE, **learning):
    return SDNNQLearning(
        space, TORQUE, approximator=SMALL, learning=QLearningConfig(**learning), warm_up_steps=30
    )


@pytest.mark.parametrize("space", [PLANE, UNBOUNDED], ids=["no warm-up", "warm-up"])
def test_rates_set_by_hand_stay_until_set_to_none_and_are_saved(space, tmp_path):
    agent = new_agent(space, **DECREASING)
    agent.learning_rate, agent.epsilon = 0.25, 0
    agent.progress = 1.0
    agent.save(tmp_path / "agent")
    loaded = load_agent(tmp_path / "agent")
    x = np.zeros(2)
    for copied in (agent, loaded, copy.deepcopy(agent), pickle.loads(pickle.dumps(agent))):
        assert (copied.learning_rate, copied.epsilon) == (0.25, 0.0)
        for _ in range(40):  # more than the warm-up
            copied.learn(Transition(x, copied.act(x), 1.0, x + 0.1, False))
        assert not copied.is_warming_up
        assert (copied.learning_rate, copied.epsilon) == (0.25, 0.0)
        copied.learning_rate = copied.epsilon = None
        final_rates = (DECREASING["final_learning_rate"], DECREASING["final_epsilon"])
        assert (copied.learning_rate, copied.epsilon) == final_rates  # of progress 1


class MultiplyRates(Callback):
    """Decreases the current rates, as user code often does."""

    def on_step(self, training):
        training.agent.epsilon *= 0.97
        training.agent.learning_rate = max(0.1, 0.99 * training.agent.learning_rate)


def schedule():
    return Schedule(
        learning_rate=lambda progress: 0.6 + 0.4 * np.sin(9 * progress),
        epsilon=lambda progress: 1 - progress,
    )


@pytest.mark.parametrize("new_callback", [MultiplyRates, schedule])
@pytest.mark.parametrize("env_id", ["Pendulum-v1", "CartPole-v1"])
def test_a_training_with_rates_set_by_callbacks_resumes_exactly(new_callback, env_id, tmp_path):
    def new_training(*callbacks):
        env = gym.make(env_id)
        agent = SDNNQLearning(env, approximator=SMALL, warm_up_steps=50)
        return Training(agent, env, steps=200, callbacks=[new_callback(), *callbacks])

    stop_steps = (1, 30, 49, 50, 51, 120, 199)  # the warm-up ends after step 50
    options = {"callbacks": [new_callback()]}
    finished = check_exact_resume(
        new_training, lambda: gym.make(env_id), tmp_path / "file", stop_steps, **options
    )
    assert {"agent.learning_rate", "agent.epsilon"} <= finished.agent.state().keys()


def test_a_schedule_sets_the_rates_by_the_progress_before_every_step():
    rates = []

    class NoteRates(Callback):
        def on_start(self, training):
            self.on_step(training)

        def on_step(self, training):
            agent = training.agent
            rates.append((agent.progress, agent.learning_rate, agent.epsilon))

    env = gym.make("Pendulum-v1")
    agent = RBFQLearning(env, approximator=RBFNetworkConfig(n_actions=5))
    agent.train(env, steps=20, callbacks=[schedule(), NoteRates()])
    assert len(rates) == 1 + 20  # at the start and after every step
    for progress, rate, epsilon in rates:
        assert rate == 0.6 + 0.4 * np.sin(9 * progress)
        assert epsilon == 1 - progress


def test_schedules_with_bad_functions_or_unsuitable_agents_are_refused():
    refuses("epsilon", Schedule, epsilon=0.1, error=TypeError)
    env = gym.make("Pendulum-v1")
    agent = FuzzyQLearning(env)
    schedule = Schedule(epsilon=lambda progress: 0.1)
    refuses("agent", agent.train, env, steps=5, callbacks=[schedule], error=TypeError)
    agent = SDNNQLearning(env, approximator=SMALL)
    too_large = Schedule(epsilon=lambda progress: 2.0)
    refuses("epsilon", agent.train, env, steps=5, callbacks=[too_large])
