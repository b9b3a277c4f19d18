import json

import pytest

from sdnn.agents import PRESETS, FuzzyQLearning, RBFQLearning, SDNNQLearning
from sdnn.runs import ConfigError, EnvironmentSpec, RunConfig
from sdnn.runs.config import AGENTS

CART_POLE = EnvironmentSpec(id="CartPole-v1")

FULL = RunConfig(
    environment=EnvironmentSpec(
        id="CartPole-v1",
        kwargs={"max_episode_steps": 100},
        ranges={"all": (-3.0, 3.0), "1": (-4.0, 4.0)},
        noise=0.02,
        redundant=2,
    ),
    agent="sdnn-c",
    preset="robust",
    settings={
        "learning": {"discount": 0.95, "tie_rule": "middle"},
        "approximator": {"circular": (True, False, False, False, False, False)},
        "agent": {"warm_up_steps": 50},
    },
    episodes=30,
    seed=2**64 - 1,
    evaluate_every=100,
    evaluation_episodes=3,
    checkpoint_every=70,
    target_return=450.0,
    tensorboard=True,
)


def test_a_configuration_survives_json_and_a_file(tmp_path):
    values = json.loads(json.dumps(FULL.values()))
    assert RunConfig.from_values(values) == FULL
    assert RunConfig.from_values(FULL.values()) == FULL
    path = tmp_path / "config.json"
    path.write_text(json.dumps(values))
    assert RunConfig.read(path) == FULL


def test_defaults():
    config = RunConfig(environment=CART_POLE)
    assert (config.agent, config.preset, config.steps, config.episodes) == (
        "sdnn-c", "general", 200_000, None,
    )  # fmt: skip
    assert RunConfig(environment=CART_POLE, episodes=5).steps is None
    assert RunConfig(environment=CART_POLE, agent="rbf").preset is None
    assert RunConfig.from_values({"environment": "CartPole-v1"}) == config


def test_toml(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('environment = "Pendulum-v1"\nsteps = 5\n[settings]\nlearning.discount = 1\n')
    config = RunConfig.read(path)
    assert config.environment.id == "Pendulum-v1"
    assert config.settings == {"learning": {"discount": 1.0}}
    assert RunConfig.read(path, "Acrobot-v1").environment.id == "Acrobot-v1"


@pytest.mark.parametrize(
    ("text", "place", "key", "words"),
    [
        ("steps = 5\n", "", "environment", "must be given"),
        ('environment = "A"\nstep = 5\n', ":2", "step", "unknown key; possible: steps"),
        ('environment = "A"\nsteps = "x"\n', ":2", "steps", "whole number, got 'x'"),
        ('environment = "A"\nsteps = 0\n', ":2", "steps", "in [1, "),
        ('[environment]\nid = "A"\nnoise = -1\n', ":3", "environment.noise", "at least 0"),
        ('[environment]\nid = "A"\nranges.0 = [1, 1]\n', ":3", "environment.ranges.0", "low <"),
        ('[environment]\nid = "A"\nranges.x = [0, 1]\n', ":3", "environment.ranges.x", "a number"),
        ('[environment]\nnoise = 1\n', ":1", "environment.id", "must be given"),
        (
            'environment = "A"\n[settings.learning]\ndiscont = 1\n',
            ":3",
            "settings.learning.discont",
            "unknown setting; possible: discount",
        ),
        (
            'environment = "A"\n[settings]\nlerning.discount = 1\n',
            ":3",
            "settings.lerning",
            "possible: learning",
        ),
        (
            'environment = "A"\n[settings.approximator]\nn_inputs = 3\n',
            ":3",
            "settings.approximator.n_inputs",
            "follows from the observations",
        ),
        ('environment = "A"\nagent = "dqn"\n', ":2", "agent", "one of 'sdnn-c', 'rbf', 'fuzzy'"),
        ('environment = "A"\npreset = "best"\n', ":2", "preset", "got 'best'"),
        ('environment = "A"\nformat = "sdnn-run-9"\n', ":2", "format", "another version"),
        ('environment = "A"\nformat = "cake"\n', ":2", "format", "must be sdnn-run-2"),
    ],
)  # fmt: skip
def test_errors_name_file_line_and_key(tmp_path, text, place, key, words):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        RunConfig.read(path)
    assert caught.value.key == key
    assert str(caught.value).startswith(f"{path}{place}: {key}: ")
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.toml", "steps = x\n", "a.toml:1: must be TOML"),
        ("a.json", "{", "a.json: must be JSON"),
        ("a.json", "[]", "a.json: must hold a table"),
        ("a.json", '{"environment": 5}', "a.json: environment: must be a table, got 5"),
        ("a.json", '{"environment": "A", "settings": 5}', "settings: must be a table, got 5"),
        ("missing.json", None, "missing.json: No such file"),
    ],
)
def test_damaged_files(tmp_path, name, text, words):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(ConfigError) as caught:
        RunConfig.read(tmp_path / name)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"steps": 5, "episodes": 5}, "episodes"),
        ({"agent": "rbf", "preset": "general"}, "preset"),
        ({"seed": -1}, "seed"),
        ({"seed": 2**64}, "seed"),
        ({"evaluate_every": 0, "target_return": 1.0}, "target_return"),
        ({"evaluation_episodes": 0}, "evaluation_episodes"),
        ({"checkpoint_every": 0}, "checkpoint_every"),
        ({"settings": {"learning": 5}}, "settings.learning"),
    ],
)
def test_values_that_do_not_fit(changes, key):
    with pytest.raises(ConfigError) as caught:
        RunConfig(environment=CART_POLE, **changes)
    assert caught.value.key == key


def test_angle_pairs_are_not_found_in_scaled_observations():
    with pytest.raises(ConfigError, match="not together with noise"):
        RunConfig(environment=CART_POLE.replace(redundant=1), angle_pairs="find")


def test_ranges_are_given_or_seen():
    settings = {"agent": {"observation_range": "seen", "warm_up_steps": 20}}
    environment = EnvironmentSpec(id="MountainCar-v0")
    env = environment.make()
    assert not RunConfig(environment=environment).make_agent(env).is_warming_up
    agent = RunConfig(environment=environment, settings=settings).make_agent(env)
    assert agent.is_warming_up
    agent.train(env, steps=20)
    low, high = agent.observation_range
    assert (low > env.observation_space.low).all()
    assert (high < env.observation_space.high).all()
    given = environment.replace(ranges={"0": (-1.0, 1.0)})
    with pytest.raises(ConfigError, match="not be given together") as caught:
        RunConfig(environment=given, settings=settings).make_agent(env)
    assert caught.value.key == "environment.ranges"


def test_agents_are_made_with_preset_and_settings():
    env = CART_POLE.make()
    kinds = {"sdnn-c": SDNNQLearning, "rbf": RBFQLearning}
    for name, kind in kinds.items():
        config = RunConfig(
            environment=CART_POLE,
            agent=name,
            seed=7,
            settings={"learning": {"discount": 0.5}, "agent": {"warm_up_steps": 20}},
        )
        agent = config.make_agent(env)
        assert type(agent) is kind
        assert agent.seed == 7
        assert agent.learning.discount == 0.5
        assert agent.is_warming_up
    robust = RunConfig(environment=CART_POLE, preset="robust").make_agent(env)
    assert robust.learning == PRESETS["robust"].learning
    pendulum = EnvironmentSpec(id="Pendulum-v1")
    fuzzy = RunConfig(environment=pendulum, agent="fuzzy").make_agent(pendulum.make())
    assert type(fuzzy) is FuzzyQLearning
    assert fuzzy.n_rules == 9**3
    assert set(AGENTS) == {*kinds, "fuzzy"}


def test_ranges_end_the_warm_up_before_it_begins():
    environment = CART_POLE.replace(ranges={"1": (-4, 4), "3": (-4, 4)})
    config = RunConfig(environment=environment)
    assert not config.make_agent(environment.make()).is_warming_up
    half = CART_POLE.replace(ranges={"1": (-4, 4)})
    assert RunConfig(environment=half).make_agent(half.make()).is_warming_up


@pytest.mark.parametrize(
    ("environment", "changes", "key", "words"),
    [
        ("CartPole-v1", {"settings": {"learning": {"discount": 2.0}}},
         "settings.learning.discount", "discount must be in"),
        ("CartPole-v1", {"settings": {"agent": {"angles": [9]}}},
         "settings.agent.angles", "angles must be variables"),
        ("CartPole-v1", {"settings": {"approximator": {"n_hidden_units": 10}}},
         "settings.approximator.n_active_units", "n_active_units must be in"),
        ("CartPole-v1", {"agent": "fuzzy"}, "environment.id", "action_space must be a Box"),
    ],
)  # fmt: skip
def test_what_only_the_agent_knows_names_the_setting(environment, changes, key, words):
    task = EnvironmentSpec(id=environment)
    config = RunConfig(environment=task, **changes)
    with pytest.raises(ConfigError, match=words) as caught:
        config.make_agent(task.make())
    assert caught.value.key == key
