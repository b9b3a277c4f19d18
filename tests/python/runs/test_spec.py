"""Specifications of runs: defaults, errors with their key, hashes, and the agents they make."""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

from refusals import refuses
from sdnn.agents import FuzzyQLearning, RBFQLearning, SDNNQLambda, SDNNQLearning, Training
from sdnn.agents.registry import AGENTS, agent_entry, register
from sdnn.approximators import RBFNetworkConfig, SDNNCConfig
from sdnn.reproduction import paper_spec
from sdnn.runs import (
    AgentSpec,
    BudgetSpec,
    ConfigError,
    EnvironmentSpec,
    OutputSpec,
    ProtocolSpec,
    RunSpec,
)

PAPER = "sdnn/PaperAcrobot-v0"
CART_POLE = EnvironmentSpec(id="CartPole-v1")

FULL = RunSpec(
    environment=EnvironmentSpec(
        id="CartPole-v1",
        kwargs={"max_episode_steps": 100},
        ranges={"all": (-3.0, 3.0), "1": (-4.0, 4.0)},
        noise=0.02,
        redundant=2,
    ),
    agent=AgentSpec(name="sdnn-c", preset="robust", warm_up_steps=50),
    learning={"discount": 0.95, "tie_rule": "middle"},
    approximator={"circular": (True, False, False, False, False, False)},
    protocol=ProtocolSpec(evaluate_every=100, evaluation_episodes=3, n_envs=2),
    budget=BudgetSpec(episodes=30, target_return=450.0),
    seed=2**64 - 1,
    output=OutputSpec(checkpoint_every=70, tensorboard=True),
)


@pytest.mark.parametrize(
    "spec", [FULL, RunSpec(environment=CART_POLE), paper_spec(agent="rbf"), paper_spec()]
)
def test_specifications_equal_their_copies_through_json_and_pickle(spec):
    again = RunSpec.from_values(json.loads(json.dumps(spec.values())))
    assert again == spec
    assert hash(again) == hash(spec)
    assert pickle.loads(pickle.dumps(spec)) == spec


def test_replaced_settings_are_checked_and_filled_in_as_new_ones_are():
    spec = RunSpec(environment=CART_POLE)
    for settings, changes in (
        (spec, {"seed": -1}),
        (spec, {"budget": {"steps": 0}}),
        (spec.budget, {"steps": 0}),
        (spec.environment, {"ranges": {"none": (0.0, 1.0)}}),
    ):
        with pytest.raises(ConfigError):
            settings.replace(**changes)
    assert spec.replace(agent="q-lambda").agent == spec.agent
    assert spec.agent.preset == "general"
    with pytest.raises(TypeError, match="sed"):
        spec.replace(sed=1)


def test_missing_settings_have_the_general_defaults():
    spec = RunSpec(environment=CART_POLE)
    assert (spec.agent.preset, spec.label) == ("general", "q-lambda-general")
    assert (spec.budget.episodes, spec.budget.steps) == (None, 200_000)
    assert (spec.protocol.evaluate_every, spec.protocol.evaluation_episodes) == (10_000, 10)
    assert spec.learning == SDNNQLambda.presets["general"].learning
    assert RunSpec.from_values({"environment": "CartPole-v1", "agent": "q-lambda"}) == spec


def test_the_papers_acrobot_has_the_papers_defaults():
    spec = paper_spec()
    assert (spec.agent.preset, spec.label) == ("paper", "sdnn-c")
    assert (spec.budget.episodes, spec.budget.steps) == (15_000, None)
    assert spec.protocol.evaluate_every_episodes == 10
    assert (spec.agent.angle_pairs, spec.agent.inputs) == ("none", "all")
    assert spec.approximator == SDNNCConfig()
    general = paper_spec(agent="q-lambda-general")
    assert general.make_agent(general.make_env()).approximator.n_inputs == 4  # all of the task


def test_the_hash_ignores_seed_and_output_but_no_other_settings():
    spec = RunSpec(environment=CART_POLE)
    assert spec.replace(seed=5).config_hash == spec.config_hash
    assert spec.replace(output=OutputSpec(tensorboard=True)).config_hash == spec.config_hash
    assert FULL.config_hash != spec.config_hash
    robust = paper_spec(agent="sdnn-c-robust")
    # The settings in which the preset "robust" differs from the paper's.
    same_settings = paper_spec(approximator={"n_actions": 61}, learning={"n_steps": 5})
    assert robust.config_hash == same_settings.config_hash
    assert paper_spec(learning={"discount": 1}) == paper_spec(learning={"discount": 1.0})


@pytest.mark.parametrize(
    ("values", "key", "words"),
    [
        ({"sed": 1}, "sed", "unknown key; did you mean seed?"),
        ({"environment": {"noise": 1}}, "environment.id", "must be given"),
        ({"environment": {"id": "A", "ranges": {"0": [1, 1]}}}, "environment.ranges.0", "low <"),
        ({"environment": {"id": "A", "ranges": {"x": [0, 1]}}}, "environment.ranges.x", "a number"),
        ({"environment": 5}, "environment", "must be a table, got 5"),
        ({"agent": "dqn"}, "agent.name", "one of sdnn-c, "),
        ({"agent": {"preset": "best"}}, "agent.preset", "got 'best'"),
        ({"agent": {"name": "rbf", "preset": "paper"}}, "agent.preset", "omitted"),
        ({"agent": {"angles": [-1]}}, "agent.angles[0]", "at least 0"),
        ({"learning": 5}, "learning", "must be a table"),
        ({"budget": {"total_timesteps": 1}}, "budget.total_timesteps", "did you mean steps?"),
        ({"agent": {"gamma": 1}}, "agent.gamma", "did you mean learning.discount?"),
        ({"learning": {"discont": 1}}, "learning.discont", "unknown key; did you mean discount?"),
        ({"learning": {"discount": "x"}}, "learning.discount", "a number, got 'x'"),
        ({"lerning": {"discount": 1}}, "lerning", "possible: learning"),
        ({"approximator": {"n_inputs": 3}}, "approximator.n_inputs", "follows from the obs"),
        (
            {"environment": {"id": PAPER, "kwargs": {"sensors": {"noise": True}}}},
            "environment.kwargs.sensors.noise",
            "a number, got True",
        ),
        ({"budget": {"steps": 5, "episodes": 5}}, "budget.episodes", "together with steps"),
        (
            {"budget": {"episodes": 5}, "protocol": {"evaluate_every_episodes": 10}},
            "budget.episodes",
            "at least evaluate_every_episodes (10)",
        ),
        (
            {"protocol": {"evaluate_every": 0}, "budget": {"target_return": 1}},
            "budget.target_return",
            "needs evaluations",
        ),
        (
            {"protocol": {"evaluate_every": 0}, "output": {"keep_best": True}},
            "output.keep_best",
            "needs evaluations",
        ),
        (
            {"budget": {"steps": 9}, "output": {"keep_best": True}},
            "output.keep_best",
            "at least 10000",
        ),
    ],
)
def test_invalid_specifications_are_refused_with_their_key(values, key, words):
    with pytest.raises(ConfigError) as caught:
        RunSpec.from_values({"environment": "CartPole-v1"} | values)
    assert caught.value.key == key
    assert words in caught.value.problem


def test_the_configuration_of_another_agent_is_refused():
    with pytest.raises(ConfigError) as caught:
        RunSpec(environment=CART_POLE, approximator=RBFNetworkConfig())
    assert caught.value.key == "approximator"


def test_angle_pairs_find_is_refused_with_noise():
    refuses(
        "noise",
        RunSpec,
        environment=CART_POLE.replace(noise=0.1),
        agent=AgentSpec(angle_pairs="find"),
        error=ConfigError,
    )


def test_with_own_units_angle_pairs_can_be_declared_despite_noise():
    environment = EnvironmentSpec(id="Pendulum-v1", noise=0.02, redundant=1, own_units=True)
    spec = RunSpec(environment=environment, agent=AgentSpec(name="rbf", angle_pairs=((0, 1),)))
    assert RunSpec.from_values(spec.values()) == spec
    env = spec.make_env()
    # Cosine, sine and speed of the pendulum, and the mean of the first two.
    np.testing.assert_array_equal(env.observation_space.low, [-1, -1, -8, -1])
    np.testing.assert_array_equal(env.observation_space.high, [1, 1, 8, 1])
    agent = spec.make_agent(env)
    assert agent.scaling is None
    assert agent.approximator.n_inputs == 3  # an angle, its speed, and the redundant one
    with pytest.raises(ConfigError) as caught:
        AgentSpec(angle_pairs=((0, 1, 2),))  # no pair
    assert caught.value.key.startswith("angle_pairs")


@pytest.mark.parametrize("inputs", ["relevant", (1, 3)])
def test_the_setting_inputs_reaches_agent_and_hash_and_unknown_inputs_are_refused(inputs):
    spec = RunSpec(
        environment=CART_POLE, agent=AgentSpec(name="sdnn-c", inputs=inputs, warm_up_steps=50)
    )
    assert RunSpec.from_values(json.loads(json.dumps(spec.values()))) == spec
    env = spec.make_env()
    agent = spec.make_agent(env)
    assert agent.is_warming_up, "it has inputs to choose or scale"
    with_all = spec.replace(agent=spec.agent.replace(inputs="all"))
    assert with_all.config_hash != spec.config_hash
    by_default = spec.replace(agent=AgentSpec(name="sdnn-c", warm_up_steps=50))
    assert by_default.config_hash == with_all.config_hash
    unknown = spec.replace(agent=spec.agent.replace(inputs=(4,)))
    with pytest.raises(ConfigError) as caught:
        unknown.make_agent(env)
    assert caught.value.key == "agent.inputs"


@pytest.mark.parametrize(
    ("preset", "noise", "options", "expected"),
    [
        ("general", 0.0, {}, ("find", "relevant")),
        ("general", 0.1, {}, ("none", "relevant")),
        ("general", 0.0, {"angle_pairs": "none", "inputs": "all"}, ("none", "all")),
        ("paper", 0.0, {}, ("none", "all")),
    ],
)
def test_defaults_of_inputs_and_angle_pairs_follow_from_preset_and_noise(
    preset, noise, options, expected
):
    environment = EnvironmentSpec(id="Pendulum-v1", noise=noise)
    agent = AgentSpec(name="q-lambda", preset=preset, **options)
    spec = RunSpec(environment=environment, agent=agent)
    assert (spec.agent.angle_pairs, spec.agent.inputs) == expected
    assert RunSpec.from_values(spec.values()) == spec
    assert spec.make_agent(spec.make_env()).is_warming_up == (expected != ("none", "all"))


def test_a_registered_agent_may_have_its_training_class():
    class InstantTraining(Training):
        def pieces(self, seconds):
            self.n_steps = self.steps
            yield

    entry = replace(agent_entry("sdnn-c"), id="instant", training=InstantTraining)
    register(entry)
    try:
        spec = RunSpec(environment=CART_POLE, agent=AgentSpec(name="instant"))
        trial = spec.make_trial(0)
        trial.training.run()
        assert isinstance(trial.training, InstantTraining)
        assert trial.finished
        trial.close()
    finally:
        del AGENTS["instant"]


def test_adaptive_ranges_are_fitted_and_exclude_fixed_ones():
    adaptive = AgentSpec(name="sdnn-c", observation_range="adaptive", warm_up_steps=20)
    environment = EnvironmentSpec(id="MountainCar-v0")
    env = environment.make()
    plain = RunSpec(environment=environment, agent="sdnn-c")
    assert not plain.make_agent(env).is_warming_up
    agent = RunSpec(environment=environment, agent=adaptive).make_agent(env)
    assert agent.is_warming_up
    agent.train(env, steps=20)
    low, high = agent.observation_range
    assert (low > env.observation_space.low).all()
    assert (high < env.observation_space.high).all()
    options = environment.replace(ranges={"0": (-1.0, 1.0)})
    with pytest.raises(ConfigError, match="given") as caught:
        RunSpec(environment=options, agent=adaptive).make_agent(env)
    assert caught.value.key == "environment.ranges"


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_warm_up_does_not_narrow_fixed_ranges(noise):
    environment = EnvironmentSpec(id="CartPole-v1", noise=noise)
    options = {str(i): (-100.0, 100.0) for i in range(4)}
    spec = RunSpec(environment=environment.replace(ranges=options), agent="q-lambda")
    env = spec.environment.make()
    agent = spec.make_agent(env)
    agent.train(env, steps=spec.agent.warm_up_steps)
    assert not agent.is_warming_up
    low, high = agent.observation_range
    expected = (0.0, 1.0) if noise else (-100.0, 100.0)  # noise is added to scaled observations
    assert set(zip(low, high, strict=True)) == {expected}


def test_make_agent_returns_the_class_with_its_settings():
    env = CART_POLE.make()
    for name, agent_class in {"sdnn-c": SDNNQLearning, "rbf": RBFQLearning}.items():
        spec = RunSpec(
            environment=CART_POLE,
            agent=AgentSpec(name=name, warm_up_steps=20),
            seed=7,
            learning={"discount": 0.5},
        )
        agent = spec.make_agent(env)
        assert type(agent) is agent_class
        assert agent.seed == 7
        assert agent.learning.discount == 0.5
        assert agent.is_warming_up
    pendulum = EnvironmentSpec(id="Pendulum-v1")
    spec = RunSpec(environment=pendulum, agent=AgentSpec(name="fuzzy"))
    fuzzy = spec.make_agent(pendulum.make())
    assert type(fuzzy) is FuzzyQLearning
    assert fuzzy.n_rules == 9**3  # all combinations of 9 fuzzy sets of 3 observations


@pytest.mark.parametrize(
    ("values", "key", "words"),
    [
        ({"learning": {"discount": 2.0}}, "learning.discount", "in [0, 1]"),
        ({"agent": {"angles": [9]}}, "agent.angles", "got 9"),
        (
            {"agent": "sdnn-c", "approximator": {"n_hidden_units": 10}},
            "approximator.n_active_units",
            "must be in [1, 10]",
        ),
        ({"agent": "fuzzy"}, "environment.id", "action_space must be a Box"),
    ],
)
def test_errors_of_an_agent_are_reported_with_their_setting(values, key, words):
    with pytest.raises(ConfigError) as caught:
        RunSpec.from_values({"environment": "CartPole-v1", **values}).make_agent(CART_POLE.make())
    assert caught.value.key == key
    assert words in caught.value.problem


def test_only_the_papers_protocol_runs_the_compiled_trial():
    spec = paper_spec(budget={"episodes": 20}, seed=3)
    assert spec.is_compiled
    trial = spec.core_trial()
    trial.advance(20)
    assert trial.test_rows()["episode"].tolist() == [10, 20]
    paper = spec.protocol
    for other in (
        spec.replace(protocol=paper.replace(evaluate_every=100, evaluate_every_episodes=None)),
        spec.replace(protocol=paper.replace(evaluation_episodes=2)),
        spec.replace(protocol=paper.replace(seeded_episodes=True)),
        spec.replace(budget=BudgetSpec(steps=20)),
        spec.replace(environment=spec.environment.replace(noise=0.1)),
        spec.replace(agent=spec.agent.replace(angles=(0,))),
        RunSpec(environment=CART_POLE, budget=BudgetSpec(episodes=20)),
    ):
        assert not other.is_compiled
        refuses("trial", other.core_trial)


def test_without_noisy_evaluations_their_sensors_have_no_noise():
    for name, noise in (
        (PAPER, {"kwargs": {"sensors": {"noise": 0.1}}}),
        ("MountainCar-v0", {"noise": 0.1}),
    ):
        environment = EnvironmentSpec(id=name, **noise)
        spec = RunSpec(environment=environment, protocol=ProtocolSpec(noisy_evaluations=False))
        without_noise = EnvironmentSpec(id=name).make().reset(seed=1)[0].tolist()
        assert spec.make_env().reset(seed=1)[0].tolist() != without_noise
        evaluation_env = spec.make_env("evaluation_sensor_noise")
        assert evaluation_env.reset(seed=1)[0].tolist() == without_noise
