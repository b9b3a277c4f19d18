"""Wrappers with running statistics: exact resuming, and evaluation with the trained statistics."""

from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import NormalizeObservation, NormalizeReward

from sdnn.agents import (
    RBFQLearning,
    SDNNQLambda,
    SDNNQLearning,
    Training,
    UnrepeatedEpisodeError,
    evaluate,
    load_agent,
)
from sdnn.training.files import learning_wrappers, statistics_of
from stopped_training import Stop, states_equal


def wrapped(*wrappers):
    """Return MountainCarContinuous with episodes of 60 steps in these wrappers."""
    env = gym.make("MountainCarContinuous-v0", max_episode_steps=60)
    for wrapper in wrappers:
        env = wrapper(env)
    return env


class CustomNormalization(gym.ObservationWrapper):
    """A user's wrapper, whose statistics cannot be frozen."""

    def __init__(self, env):
        super().__init__(env)
        self.obs_rms = SimpleNamespace(mean=np.zeros(2), var=np.ones(2), count=0.0)

    def observation(self, observation):
        moments = self.obs_rms
        moments.count += 1.0
        moments.mean = moments.mean + (observation - moments.mean) / moments.count
        return (observation - moments.mean).astype(np.float32)


WRAPPERS = {
    "observations": (NormalizeObservation,),
    "rewards": (NormalizeReward,),
    "both": (NormalizeObservation, gym.wrappers.RecordEpisodeStatistics, NormalizeReward),
    "custom": (CustomNormalization,),
}


def agent_for(env):
    return RBFQLearning(env, seed=1, observation_range=(-2.0, 2.0))


@pytest.mark.parametrize("wrappers", WRAPPERS.values(), ids=WRAPPERS)
# Episodes have 60 steps: at the end of the first, and three times within the second.
@pytest.mark.parametrize("stop_step", [60, 61, 95, 119])
def test_a_training_with_normalizing_wrappers_resumes_exactly(wrappers, stop_step, tmp_path):
    path = tmp_path / "training"

    def new_training(*callbacks):
        env, evaluation_env = wrapped(*wrappers), wrapped(*wrappers)
        return Training(
            agent_for(env), env, steps=200, evaluate_every=50, evaluation_episodes=1,
            evaluation_env=evaluation_env, callbacks=callbacks,
        )  # fmt: skip

    expected = new_training()
    expected.run()
    new_training(Stop(stop_step, path)).run()
    for callbacks in ([Stop(stop_step + 7, path)], []):
        options = {"evaluation_env": wrapped(*wrappers), "callbacks": callbacks}
        resumed = Training.load(path, wrapped(*wrappers), **options)
        resumed.run()
    assert states_equal(expected.agent, resumed.agent)
    assert expected.evaluations == resumed.evaluations
    assert expected.agent.wrappers == resumed.agent.wrappers != []


def test_a_loaded_agent_is_evaluated_with_the_statistics_of_its_training(tmp_path):
    env = wrapped(NormalizeObservation)
    agent = agent_for(env)
    agent.train(env, steps=300)
    agent.save(tmp_path / "agent")
    expected = evaluate(agent, env, 2, seed=5).returns.tolist()
    for saved in (agent, load_agent(tmp_path / "agent")):
        new_env = wrapped(NormalizeObservation)
        assert evaluate(saved, new_env, 2, seed=5).returns.tolist() == expected


def test_an_evaluation_does_not_change_the_statistics_of_wrappers():
    for wrappers in WRAPPERS.values():
        env = wrapped(*wrappers)
        agent = agent_for(env)
        agent.train(env, steps=70)
        before = statistics_of(learning_wrappers(env))
        evaluate(agent, env, 1)
        assert statistics_of(learning_wrappers(env)) == before
        for wrapper in learning_wrappers(env):
            assert getattr(wrapper, "update_running_mean", True), "a training still changes them"


def test_evaluating_without_statistics_of_a_training_warns():
    env = wrapped(NormalizeObservation)
    with pytest.warns(RuntimeWarning, match="NormalizeObservation"):
        evaluate(agent_for(env), env, 1)


def unbounded(env):
    """Return an environment with the bounds of one whose observations are normalized."""
    space = wrapped(NormalizeObservation).observation_space
    return gym.wrappers.TransformObservation(env, lambda x: x, space)


def test_training_and_evaluation_with_different_wrappers_warn():
    normalized, other = wrapped(NormalizeObservation), unbounded(wrapped())
    for env, evaluation_env in ((normalized, other), (other, normalized)):
        with pytest.warns(RuntimeWarning, match=r"NormalizeObservation.*wrap both"):
            Training(agent_for(env), env, steps=5, evaluate_every=5, evaluation_env=evaluation_env)


def test_a_vector_with_normalization_resumes_with_new_episodes_only(tmp_path):
    def new_envs():
        return gym.vector.SyncVectorEnv([lambda: wrapped(NormalizeObservation)] * 2)

    agent = SDNNQLearning(new_envs(), warm_up_steps=20)
    Training(agent, new_envs(), steps=90, callbacks=[Stop(40, tmp_path / "training")]).run()
    with pytest.raises(UnrepeatedEpisodeError, match=r"NormalizeObservation.*repeat_episodes"):
        Training.load(tmp_path / "training", new_envs())
    envs = new_envs()
    resumed = Training.load(tmp_path / "training", envs, repeat_episodes=False)
    assert statistics_of(learning_wrappers(envs)) == resumed.agent.wrappers
    assert resumed.run().n_steps == 90


class AddsParity(gym.Wrapper):
    """Counts its steps over all episodes, and adds their parity to observations."""

    n_steps = 0

    def step(self, action):
        self.n_steps += 1
        observation, *others = self.env.step(action)
        return (observation + self.n_steps % 2).astype(np.float32), *others


def test_a_wrapper_with_unknown_state_is_named_when_an_episode_cannot_be_repeated(tmp_path):
    env = wrapped(AddsParity)
    training = Training(agent_for(env), env, steps=200, callbacks=[Stop(75, tmp_path / "training")])
    training.run()
    # The second wrapper changes the observations of the episode that is repeated.
    with pytest.raises(UnrepeatedEpisodeError, match=r"AddsParity.*repeat_episodes=False"):
        Training.load(tmp_path / "training", wrapped(AddsParity, AddsParity))
    assert Training.load(tmp_path / "training", wrapped(), repeat_episodes=False)


def test_statistics_for_an_environment_without_the_wrapper_are_refused(tmp_path):
    env = wrapped(NormalizeObservation)
    training = Training(agent_for(env), env, steps=200, callbacks=[Stop(75, tmp_path / "training")])
    training.run()
    with pytest.raises(ValueError, match="NormalizeObservation"):
        Training.load(tmp_path / "training", unbounded(wrapped()))


@pytest.mark.parametrize("learning", [False, True])
def test_an_export_prints_and_writes_how_observations_are_normalized(invoke, tmp_path, learning):
    env = NormalizeReward(NormalizeObservation(gym.make("CartPole-v1")))
    agent = SDNNQLambda(env.observation_space, env.action_space, warm_up_steps=50)
    agent.train(env, steps=100)
    agent.save("agent.safetensors")
    options = ["--learning"] if learning else []
    printed = invoke("export", "agent.safetensors", "--c-header", "a.h", *options).stdout
    statistics = env.get_wrapper_attr("obs_rms")
    line = f"3: mean {statistics.mean[3]:.9g}, variance {statistics.var[3]:.9g}"  # of variable 3
    for text in (printed, (tmp_path / "a.h").read_text()):
        assert line in text
        assert "the wrapper NormalizeObservation gave" in text
        assert "NormalizeReward" not in text
