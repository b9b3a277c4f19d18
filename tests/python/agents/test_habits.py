"""Conventions of Stable-Baselines3, callbacks, and representations of agents and results."""

import importlib
import inspect
import re
from typing import NamedTuple

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn import SDNNRegressor
from sdnn.agents import (
    Callback,
    CheckpointCallback,
    QLambdaConfig,
    SaveBestAgent,
    SDNNActorCritic,
    SDNNQLambda,
    StopTrainingOnNoImprovement,
    StopTrainingOnRewardThreshold,
    Training,
    Transition,
    evaluate,
    learn_from,
    load_agent,
)
from sdnn.runs import AGENTS
from sdnn.support.display import curve_svg


@pytest.fixture(scope="module")
def trained():
    """An agent, its environment, and the result of 1,500 steps; tests add a few steps."""
    env = gym.make("CartPole-v1")
    agent = SDNNQLambda(env, seed=1)
    return agent, env, agent.train(env, steps=1.5e3)


def test_predict_accepts_one_observation_or_a_batch(trained):
    agent, env, _ = trained
    observations = np.stack([env.reset(seed=n)[0] for n in range(5)])
    actions, state = agent.predict(observations, None, np.ones(5, bool), deterministic=True)
    assert state is None
    assert actions.tolist() == [
        agent.act(observation, explore=False) for observation in observations
    ]
    assert agent.predict(observations[0])[0] == actions[0]
    assert agent.predict(observations[0], deterministic=False)[0] in env.action_space
    refuses("deterministic", agent.predict, observations[0], deterministic="yes", error=TypeError)
    refuses("observation", agent.predict, observations[:0])


def test_predict_accepts_batches_of_discrete_and_box_observations():
    lake = gym.make("FrozenLake-v1")
    agent = SDNNQLambda(lake)
    assert agent.predict(np.array([0, 3, 5]))[0].shape == (3,)
    assert agent.predict(3)[0] in lake.action_space
    swing = gym.make("Pendulum-v1")
    agent = SDNNQLambda(swing)
    assert agent.predict(np.zeros((4, 3), np.float32))[0].shape == (4, 1)
    assert agent.predict(np.zeros(3, np.float32))[0].shape == (1,)


@pytest.mark.parametrize("space_class", [gym.spaces.Dict, gym.spaces.Tuple])
def test_predict_accepts_batches_of_dict_and_tuple_observations(space_class):
    is_dict = space_class is gym.spaces.Dict
    box, discrete = gym.spaces.Box(-1, 1, (2,)), gym.spaces.Discrete(3)
    space = space_class({"a": box, "b": discrete} if is_dict else (box, discrete))
    agent = SDNNQLambda(space, gym.spaces.Discrete(9), inputs="all", angle_pairs="none")
    space.seed(1)
    observations = [space.sample() for _ in range(4)]
    for observation in observations:
        agent.learn(Transition(observation, 7, 1.0, observation, False))  # only action 7 pays
    batch = gym.vector.utils.create_empty_array(space, 4)
    batch = gym.vector.utils.concatenate(space, observations, batch)
    assert agent.predict(batch)[0].tolist() == [7] * 4
    assert agent.predict(observations[0])[0] == 7
    of_unequal_lengths = (
        {"a": batch["a"], "b": batch["b"][:3]} if is_dict else (batch[0], batch[1][:3])
    )
    refuses("observation", agent.predict, of_unequal_lengths)


CALLS = {
    SDNNQLambda: {
        "policy": "approximator", "gamma": "learning=QLambdaConfig(discount=...)", "env": "(env)",
        "learning_rate": "QLambdaConfig(learning_rate=...)", "buffer_size": "omit it",
        "learning_starts": "mean warm_up_steps", "verbose": "train(env, progress=...)",
    },
    SDNNQLambda.learn: {"total_timesteps": "train(env, steps=...)"},
    SDNNQLambda.train: {
        "total_timesteps": "mean steps", "callback": "mean callbacks", "seeed": "mean seed",
        "progress_bar": "mean progress",
    },
    Training: {"eval_env": "mean evaluation_env"}, evaluate: {"n_eval_episodes": "mean episodes"},
    learn_from: {"n_epochs": "mean epochs"}, load_agent: {"env": "SDNNQLambda(env)"},
    CheckpointCallback: {"save_freq": "mean every"},
    StopTrainingOnRewardThreshold: {"reward_threshold": "mean mean_return"},
    QLambdaConfig: {"gamma": "mean discount"}, SDNNRegressor: {"epochs": "mean max_iter"},
}  # fmt: skip
"""Arguments of other libraries by function, and the hint that the error must give."""


@pytest.mark.parametrize("function", CALLS, ids=lambda call: call.__qualname__)
def test_arguments_of_other_libraries_are_refused_with_the_right_name(trained, function):
    agent = trained[0]
    for name, hint in CALLS[function].items():
        with pytest.raises(TypeError, match=f"^{name} .*{re.escape(hint)}") as refused:
            function(agent, **{name: 1})
        assert refused.value.argument == name


ATTRIBUTES = {
    "gamma": "learning.discount", "exploration_rate": "epsilon", "num_timesteps": "n_steps",
    "get_env": "train(env, steps=...)", "set_env": "evaluate(agent, env)", "policy": "approximator",
    "evaluate_policy": "evaluate(agent, env", "device": "CPU", "save_replay_buffer": "by itself",
    "logger": "TensorBoard(folder)", "set_parameters": "load_agent", "choose_action": "act",
    "verbose": "a bar shows by itself",
    "fit": "train", "set_random_seed": "seed=1", "n_envs": "n_environments",
}  # fmt: skip
"""Attributes of other libraries' agents, and the hint that the error must give."""

IMPORTS = {
    "PPO": "SDNNQLambda(env)", "evaluate_policy": "evaluate", "EvalCallback": "evaluate_every=",
    "make_vec_env": "gymnasium.make_vec", "VecNormalize": "observation_range", "Monitor": "returns",
    "DummyVecEnv": "gymnasium.make_vec", "BaseCallback": "Callback", "set_random_seed": "seed=1",
    "StopTrainingOnNoModelImprovement": "OnNoImprovement", "ActionMasker": "ActionMasks",
}  # fmt: skip


@pytest.mark.parametrize("name", ATTRIBUTES)
def test_attributes_of_other_libraries_are_refused_with_the_right_name(trained, name):
    with pytest.raises(AttributeError, match=f"^SDNNQLambda has no {name}: ") as refused:
        getattr(trained[0], name)
    assert ATTRIBUTES[name] in str(refused.value)
    assert not hasattr(trained[0], name)


def test_unknown_attributes_have_the_error_of_python_and_raising_ones_their_own(trained):
    with pytest.raises(AttributeError, match="'SDNNQLambda' object has no attribute 'qwerty'"):
        trained[0].qwerty  # noqa: B018
    with pytest.raises(AttributeError, match="learns no values of actions"):
        SDNNActorCritic(trained[1]).q_values  # noqa: B018


@pytest.mark.parametrize("package", ["sdnn", "sdnn.agents"])
def test_imports_of_other_libraries_are_refused_with_the_right_name(package):
    for name, hint in IMPORTS.items():
        with pytest.raises(ImportError, match=f"^{package} has no {name}: .*{re.escape(hint)}"):
            exec(f"from {package} import {name}")
        assert not hasattr(importlib.import_module(package), name)
    with pytest.raises(ImportError, match=f"cannot import name 'qwerty' from '{package}'"):
        exec(f"from {package} import qwerty")


def test_imports_from_the_wrong_package_name_the_right_package():
    for name, package in (("load_agent", "agents"), ("ActionMasks", "environments")):
        with pytest.raises(ImportError, match=f"did you mean from sdnn.{package} import {name}"):
            exec(f"from sdnn import {name}")
    exec("from sdnn import training")  # a package that is not imported yet, or no attribute


def test_train_accepts_positional_steps_and_whole_floats(trained):
    agent, env, result = trained
    assert agent.train(env, 20).n_steps == 20
    assert result.n_steps == 1500  # from 1.5e3
    refuses("steps", agent.train, env, steps=1500.5)


def test_constructors_accept_environments_and_vectors_in_the_place_of_spaces():
    env = gym.make("CartPole-v1")
    envs = gym.make_vec("CartPole-v1", num_envs=2)
    expected = SDNNQLambda(env.observation_space, env.action_space).description()
    for source in (env, envs):
        assert SDNNQLambda(source).description() == expected
    refuses("steps", SDNNQLambda(env).learn, 200, error=TypeError)
    refuses("SDNNQLambda", SDNNQLambda, error=TypeError)
    refuses("action_space", SDNNQLambda, env.observation_space, error=TypeError)
    assert "observation_space" in inspect.signature(SDNNQLambda).parameters


@pytest.mark.filterwarnings("ignore:agent is still warming up")
def test_constructors_train_and_evaluate_accept_ids_and_refuse_unknown_ones():
    agent, other = SDNNQLambda("CartPole-v1", seed=1), SDNNQLambda(gym.make("CartPole-v1"), seed=1)
    assert agent.description() == other.description()
    agent.train("CartPole-v1", steps=300)
    env = gym.make("CartPole-v1")
    other.train(env, steps=300)
    assert evaluate(agent, "CartPole-v1", 2).returns.tolist() == (
        evaluate(other, env, 2).returns.tolist()
    )
    refuses("observation_space", SDNNQLambda, "CartPoll-v1")
    refuses("env", agent.train, "CartPoll-v1", steps=9)
    refuses("CartPole", evaluate, agent, "CartPoll-v1")  # suggests the right id
    refuses("observation_space", SDNNQLambda, "MlpPolicy", "CartPole-v1", error=TypeError)


def test_seed_none_draws_a_different_seed_for_each_agent():
    env = gym.make("CartPole-v1")
    first, second = (SDNNQLambda(env, seed=None) for _ in "ab")
    assert first.seed != second.seed


def test_representations_show_spaces_steps_and_returns_and_escape_html(trained):
    agent, env, result = trained
    evaluation = evaluate(agent, env, episodes=3)
    assert "Discrete(2)" in repr(agent)
    assert "steps 1500" in repr(result)
    assert re.search(r"learned 1,5\d\d steps, last return \d+", repr(agent))
    for shown in (agent, result):
        assert "\n" not in repr(shown)
        assert shown._repr_html_().count("<svg") == 1
    assert "learned" not in repr(SDNNQLambda(env))
    assert f"{evaluation.mean_return:.5g}" in repr(evaluation)
    for shown in (agent, result, evaluation):
        assert shown._repr_html_().count("<tr>") == len(shown._facts())

    class Unescaped(type(evaluation)):
        def _facts(self):
            return {"a": "<b>"}

    assert "&lt;" in Unescaped(**vars(evaluation))._repr_html_()


def test_representations_of_loaded_agents_and_large_spaces_are_a_line(trained, tmp_path):
    agent = trained[0]
    agent.save(tmp_path / "agent.safetensors")
    assert "learned 1,5" in repr(load_agent(tmp_path / "agent.safetensors"))
    box = gym.spaces.Box(-np.ones(40), 1.0 + np.arange(40.0), dtype=np.float64)
    for space in (box, gym.spaces.Dict({name: box for name in "abc"})):
        shown = repr(SDNNQLambda(space, gym.spaces.Discrete(2)))
        assert "\n" not in shown
        assert len(shown) < 150


@pytest.mark.parametrize("name", AGENTS)
def test_an_agent_counts_all_steps_that_it_has_learned(name, tmp_path):
    env = gym.make("Pendulum-v1")
    agent = AGENTS[name].agent(env, seed=1, observation_range="adaptive", warm_up_steps=200)
    assert agent.n_learned == 0
    # Agents that learn on policy only fit ranges to the 200 steps of the warm-up: 150 + 100 - 200
    # are learned. The others learn all steps.
    is_on_policy = name in ("fuzzy", "actor-critic")
    for n_more, n_learned in (
        (150, 0 if is_on_policy else 150),
        (100, 50 if is_on_policy else 250),
    ):
        agent.train(env, steps=n_more)
        assert agent.n_learned == n_learned
        assert ("learned" in repr(agent)) == (n_learned == (50 if is_on_policy else 250))
        agent.save(tmp_path / "agent.safetensors")
        agent = load_agent(tmp_path / "agent.safetensors")
        assert agent.n_learned == n_learned
    assert f"learned {n_learned} steps" in repr(agent)
    observation = env.reset(seed=1)[0]
    agent.learn(Transition(observation, agent.act(observation), 0.0, observation, False))
    assert agent.n_learned == n_learned + 1


def test_small_curves_have_the_means_of_equally_many_returns_but_none_without_finite_returns():
    svg = curve_svg([1.0, 3.0, 5.0, 7.0], n_points=2)
    # Means of the pairs are 2 and 6: from the lower left to the upper right corner of 240 x 48
    # pixels with a margin of 2.
    assert 'points="2.0,50.0 242.0,2.0"' in svg
    assert "4 returns, 2 to 6" in svg
    assert "2.0,50.0" in curve_svg([0.0] * 5), "equal returns are at the lower margin"
    assert curve_svg([1.0, float("inf")]) == curve_svg([]) == ""


class ScriptedEvaluations(Callback):
    """Replaces the mean returns of evaluations."""

    def __init__(self, means):
        self.means = iter(means)

    def on_row(self, training, row):
        if row["kind"] == "evaluation":
            step, _ = training.evaluations[-1]
            training.evaluations[-1] = (step, next(self.means))


def train_with_evaluations(means, *callbacks):
    """Train for 60 steps, with these mean returns of an evaluation after every 10 steps."""
    env = gym.make("CartPole-v1")
    agent = SDNNQLambda(
        env, inputs="all", angle_pairs="none",
        observation_range=(-3.0, 3.0), seed=2,
    )  # fmt: skip
    training = Training(
        agent, env, steps=60, evaluate_every=10, evaluation_episodes=1,
        evaluation_env=gym.make("CartPole-v1"), callbacks=[ScriptedEvaluations(means), *callbacks],
    )  # fmt: skip
    training.run()
    return training


def test_save_best_agent_saves_at_each_better_evaluation(tmp_path):
    path, steps_of_files = tmp_path / "best.safetensors", {}

    class NoteNewFiles(Callback):
        def on_row(self, training, row):
            if row["kind"] == "evaluation":
                steps_of_files.setdefault(path.read_bytes(), training.n_steps)

    means = [1.0, 3.0, 2.0, 3.0, 4.0, 0.0]  # the first, second and fifth exceed all before
    train_with_evaluations(means, SaveBestAgent(path), NoteNewFiles())
    assert list(steps_of_files.values()) == [10, 20, 50]
    assert isinstance(load_agent(path), SDNNQLambda)


class ScriptedReturns(gym.Env):
    """Episodes of one step with these returns."""

    observation_space, action_space = gym.spaces.Box(0, 1, (1,)), gym.spaces.Discrete(2)

    def __init__(self, returns):
        self.returns = iter(returns)

    def reset(self, *, seed=None, options=None):
        return np.zeros(1, np.float32), {}

    def step(self, action):
        return np.zeros(1, np.float32), next(self.returns), True, False, {}


class BestSteps(SaveBestAgent):
    """Notes the steps after which the best agent was saved."""

    def __init__(self, path, episodes):
        super().__init__(path, episodes)
        self.steps = []

    def on_row(self, training, row):
        self.path.unlink(missing_ok=True)
        super().on_row(training, row)
        self.steps += [training.n_steps] if self.path.exists() else []


RETURNS_OF_PAIRS = [1, 3, 4, -1, 2, 3, 0, 5, 9, 8]
"""Their sums in pairs are 4, 3, 5, 5 and 17: better than all before after 2, 6 and 10 episodes."""


class TrainingPart(NamedTuple):
    """Returns of episodes of one step; the callback is only used with a block length."""

    returns: list
    block_length: int | None


@pytest.fixture
def steps_of_saves(tmp_path):
    """Trains in parts, and returns the steps after which `SaveBestAgent` saved the agent."""

    def steps_after_which_the_best_was_saved(*parts):
        path, n_steps, steps = tmp_path / "training.safetensors", 0, []
        for returns, block_length in parts:
            env = ScriptedReturns(returns)
            n_steps += len(returns)
            callback = Callback()
            if block_length is not None:
                callback = BestSteps(tmp_path / "best.safetensors", block_length)
            options = {"steps": n_steps, "callbacks": [callback]}
            if path.exists():
                training = Training.load(path, env, **options)
            else:
                training = Training(SDNNQLambda(env, inputs="all"), env, **options)
            training.run()
            training.save(path)
            steps += callback.steps if block_length is not None else []
        return steps

    return steps_after_which_the_best_was_saved


def test_save_best_agent_saves_after_each_pair_of_episodes_with_a_better_sum(steps_of_saves):
    # Each episode has one step. Sums of the pairs 1, 3; 4, -1; ... are 4, 3, 5, 5 and 17.
    assert steps_of_saves(TrainingPart(RETURNS_OF_PAIRS, block_length=2)) == [2, 6, 10]


def test_save_best_agent_refuses_impossible_lengths_of_blocks(tmp_path):
    for length in (0, 1.5, 10**6 + 1):
        refuses("episodes", SaveBestAgent, tmp_path / "best", length)


@pytest.mark.parametrize("n_first", range(1, 10))
def test_a_resumed_training_continues_its_block_of_episodes(steps_of_saves, n_first):
    first, second = RETURNS_OF_PAIRS[:n_first], RETURNS_OF_PAIRS[n_first:]
    # The whole training saves after 2, 6 and 10 steps, wherever it is divided.
    assert steps_of_saves(
        TrainingPart(first, block_length=2), TrainingPart(second, block_length=2)
    ) == [2, 6, 10]


def test_the_best_block_is_remembered_during_a_training_without_the_callback(steps_of_saves):
    # Only the first and the last of four pairs are better than all before, after 2 and 8 episodes.
    assert steps_of_saves(
        TrainingPart([100, 100], block_length=2),
        TrainingPart([1, 1], block_length=None),
        TrainingPart([2, 2, 101, 101], block_length=2),
    ) == [2, 8]


def test_blocks_of_another_length_are_compared_anew(steps_of_saves):
    # After a block of ten, the first pair is the best one so far, and later the third.
    ten = TrainingPart([100] * 10, block_length=10)
    pairs = TrainingPart([-1, -1, -2, -2, 150, 150], block_length=2)
    assert steps_of_saves(ten, pairs) == [10, 10 + 2, 10 + 6]


def test_two_callbacks_with_blocks_of_the_same_length_save_at_the_same_steps(tmp_path):
    env = ScriptedReturns(RETURNS_OF_PAIRS)
    agent = SDNNQLambda(env, inputs="all")
    callbacks = [BestSteps(tmp_path / name, 2) for name in ("first", "second")]
    agent.train(env, steps=10, callbacks=callbacks)
    assert [callback.steps for callback in callbacks] == [[2, 6, 10]] * 2
    agent.train(ScriptedReturns([-1, -1]), steps=2, callbacks=callbacks)
    assert [callback.steps[-1] for callback in callbacks] == [2, 2], "another training begins anew"


@pytest.mark.parametrize("extreme", [1e300, -1e300])
def test_a_first_block_with_extreme_returns_is_saved(steps_of_saves, extreme):
    extremes, zeros = (TrainingPart([number] * 2, block_length=2) for number in (extreme, 0))
    saves = steps_of_saves(extremes, zeros)
    assert saves == ([2] if extreme > 0 else [2, 4]), "returns of 0 are better than -1e300"


def test_two_evaluations_in_a_row_without_improvement_stop_a_training():
    stop = StopTrainingOnNoImprovement(max_evaluations=2)
    # Evaluations every 10 steps: the third and fourth are no better than the second one.
    assert train_with_evaluations([1.0, 3.0, 2.0, 3.0, 9.0, 9.0], stop).n_steps == 40
    assert train_with_evaluations([1.0, 3.0, 2.0, 4.0, 3.0, 5.0], stop).n_steps == 60
    refuses("max_evaluations", StopTrainingOnNoImprovement, 0)


def test_callbacks_that_compare_evaluations_are_refused_where_there_are_none(trained, tmp_path):
    agent, env, _ = trained
    for callback in (
        SaveBestAgent(tmp_path / "best"),
        StopTrainingOnRewardThreshold(1.0),
        StopTrainingOnNoImprovement(1),
    ):
        n_learned = agent.n_learned
        refuses("evaluate_every", agent.train, env, steps=5, callbacks=[callback])
        assert agent.n_learned == n_learned


@pytest.mark.parametrize("interval", [0, -1, 2.5, None])
def test_step_intervals_below_1_and_fractions_are_refused(trained, interval):
    class WithBadInterval(Callback):
        step_interval = interval

        def on_step(self, training):
            raise AssertionError

    agent, env, _ = trained
    refuses("step_interval", agent.train, env, steps=5, callbacks=[WithBadInterval()])


def test_a_training_calls_methods_replaced_on_the_instance():
    env = gym.make("CartPole-v1")
    agent = SDNNQLambda(env)
    transitions, learn = [], agent.learn
    agent.learn = lambda transition: (transitions.append(transition), learn(transition))
    agent.train(env, steps=5)
    assert len(transitions) == 5


@pytest.mark.parametrize("module", ["sdnn.common", "sdnn.common.env_util"])
def test_importing_modules_of_stable_baselines3_names_those_of_sdnn(module):
    with pytest.raises(ModuleNotFoundError, match=r"sdnn\.agents.*make_vec"):
        importlib.import_module(module)


def test_callbacks_with_methods_of_stable_baselines3_are_refused(trained):
    class Watching(Callback):
        def _on_step(self):
            return False

    agent, env, _ = trained
    error = refuses("_on_step", agent.train, env, steps=5, callbacks=[Watching()], error=TypeError)
    assert "training.stop()" in str(error)
