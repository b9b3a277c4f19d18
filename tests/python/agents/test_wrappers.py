"""Wrappers with running statistics: exact resuming, and evaluation with the trained statistics."""

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
    env = gym.make("MountainCarContinuous-v0", max_episode_steps=60)
    for wrapper in wrappers:
        env = wrapper(env)
    return env


class CustomMoments:
    def __init__(self):
        self.mean, self.var, self.count = np.zeros(2), np.ones(2), 0.0


class CustomNormalization(gym.ObservationWrapper):
    """A user's wrapper, whose statistics cannot be frozen."""

    def __init__(self, env):
        super().__init__(env)
        self.obs_rms = CustomMoments()

    def observation(self, observation):
        self.obs_rms.count += 1.0
        self.obs_rms.mean = self.obs_rms.mean + (observation - self.obs_rms.mean) / (
            self.obs_rms.count
        )
        return (observation - self.obs_rms.mean).astype(np.float32)


WRAPPERS = {
    "observations": (NormalizeObservation,),
    "rewards": (NormalizeReward,),
    "both": (NormalizeObservation, gym.wrappers.RecordEpisodeStatistics, NormalizeReward),
    "custom": (CustomNormalization,),
}


def agent_for(env):
    return RBFQLearning(
        env.observation_space, env.action_space, seed=1, observation_range=(-2.0, 2.0)
    )


@pytest.mark.parametrize("wrappers", WRAPPERS.values(), ids=WRAPPERS)
# Episodes have 60 steps: at the end of the first, and three times within the second.
@pytest.mark.parametrize("cut", [60, 61, 95, 119])
def test_a_training_with_normalizing_wrappers_resumes_exactly(wrappers, cut, tmp_path):
    options = {"steps": 200, "evaluate_every": 50, "evaluation_episodes": 1}
    env = wrapped(*wrappers)
    whole = Training(agent_for(env), env, evaluation_env=wrapped(*wrappers), **options)
    whole.run()
    env = wrapped(*wrappers)
    cut_training = Training(
        agent_for(env),
        env,
        evaluation_env=wrapped(*wrappers),
        callbacks=[Stop(cut, tmp_path / "training")],
        **options,
    )
    cut_training.run()
    for callbacks in ([Stop(cut + 7, tmp_path / "training")], []):
        resumed = Training.load(
            tmp_path / "training",
            wrapped(*wrappers),
            evaluation_env=wrapped(*wrappers),
            callbacks=callbacks,
        )
        resumed.run()
    assert states_equal(whole.agent, resumed.agent)
    assert whole.evaluations == resumed.evaluations
    assert whole.agent.wrappers == resumed.agent.wrappers != []


def test_a_loaded_agent_is_evaluated_with_the_statistics_of_its_training(tmp_path):
    env = wrapped(NormalizeObservation)
    agent = agent_for(env)
    agent.train(env, steps=300)
    agent.save(tmp_path / "agent")
    returns = [
        evaluate(wrapper, wrapped(NormalizeObservation), 2, seed=5).returns.tolist()
        for wrapper in (agent, load_agent(tmp_path / "agent"))
    ]
    trained = evaluate(agent, env, 2, seed=5).returns.tolist()
    assert returns == [trained, trained]


def test_an_evaluation_does_not_change_the_statistics_of_wrappers():
    for wrappers in WRAPPERS.values():
        env = wrapped(*wrappers)
        agent = agent_for(env)
        agent.train(env, steps=70)
        before = statistics_of(learning_wrappers(env))
        evaluate(agent, env, 1)
        assert statistics_of(learning_wrappers(env)) == before
        flags = [
            getattr(wrapper, "update_running_mean", True) for wrapper in learning_wrappers(env)
        ]
        assert all(flags)


def test_evaluating_without_statistics_of_a_training_warns():
    env = wrapped(NormalizeObservation)
    with pytest.warns(RuntimeWarning, match="NormalizeObservation"):
        evaluate(agent_for(env), env, 1)


def unbounded(env):
    """Return an environment with the bounds of one whose observations are normalized."""
    space = wrapped(NormalizeObservation).observation_space
    return gym.wrappers.TransformObservation(env, lambda x: x, space)


@pytest.mark.parametrize("learns_in", [0, 1])
def test_training_and_evaluation_with_different_wrappers_warn(learns_in):
    envs = [wrapped(NormalizeObservation), unbounded(wrapped())]
    env, other = envs[learns_in], envs[1 - learns_in]
    with pytest.warns(RuntimeWarning, match=r"NormalizeObservation.*wrap both"):
        Training(agent_for(env), env, steps=5, evaluate_every=5, evaluation_env=other)


def test_a_vector_with_normalization_resumes_with_new_episodes_only(tmp_path):
    def envs():
        return gym.vector.SyncVectorEnv([lambda: wrapped(NormalizeObservation)] * 2)

    training = Training(
        SDNNQLearning(
            envs().single_observation_space, envs().single_action_space, warm_up_steps=20
        ),
        envs(),
        steps=90,
        callbacks=[Stop(40, tmp_path / "training")],
    )
    training.run()
    with pytest.raises(UnrepeatedEpisodeError, match=r"NormalizeObservation.*repeat_episodes"):
        Training.load(tmp_path / "training", envs())
    again = envs()
    resumed = Training.load(tmp_path / "training", again, repeat_episodes=False)
    assert statistics_of(learning_wrappers(again)) == resumed.agent.wrappers
    assert resumed.run().n_steps == 90


class Remembers(gym.Wrapper):
    """Counts its steps over all episodes, and adds their parity to observations."""

    n = 0

    def step(self, action):
        self.n += 1
        x, *rest = self.env.step(action)
        return (x + self.n % 2).astype(np.float32), *rest


def test_a_wrapper_with_unknown_state_is_named_when_an_episode_cannot_be_repeated(tmp_path):
    env = wrapped(Remembers)
    training = Training(agent_for(env), env, steps=200, callbacks=[Stop(75, tmp_path / "training")])
    training.run()
    with pytest.raises(UnrepeatedEpisodeError, match=r"Remembers.*repeat_episodes=False"):
        Training.load(tmp_path / "training", wrapped(Remembers, Remembers))
    assert Training.load(tmp_path / "training", wrapped(), repeat_episodes=False)


def test_statistics_for_an_environment_without_the_wrapper_are_refused(tmp_path):
    env = wrapped(NormalizeObservation)
    training = Training(agent_for(env), env, steps=200, callbacks=[Stop(75, tmp_path / "training")])
    training.run()
    with pytest.raises(ValueError, match="NormalizeObservation"):
        Training.load(tmp_path / "training", unbounded(wrapped()))


@pytest.mark.parametrize("learning", [False, True])
def test_headers_in_c_state_how_observations_are_normalized(invoke, tmp_path, learning):
    env = NormalizeReward(NormalizeObservation(gym.make("CartPole-v1")))
    agent = SDNNQLambda(env.observation_space, env.action_space, warm_up_steps=50)
    agent.train(env, steps=100)
    agent.save("agent.safetensors")
    options = ["--learning"] * learning
    printed = invoke("export", "agent.safetensors", "--c-header", "a.h", *options).stdout
    mean, variance = (getattr(env.get_wrapper_attr("obs_rms"), name)[3] for name in ("mean", "var"))
    line = f"3: mean {mean:.9g}, variance {variance:.9g}"
    text = (tmp_path / "a.h").read_text()
    for lines in (printed, text):
        assert line in lines
        assert "the wrapper NormalizeObservation gave" in lines
        assert "NormalizeReward" not in lines
