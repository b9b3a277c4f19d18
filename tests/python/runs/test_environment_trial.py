"""Trials in Gymnasium environments: seeds, noise, rows and hashes."""

import json
from dataclasses import dataclass, replace
from typing import ClassVar

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import FuzzyQLearningConfig
from sdnn.approximators import FuzzyRulesConfig, RBFNetworkConfig, SDNNCConfig
from sdnn.reproduction import (
    AGENTS,
    AgentEntry,
    PlannedTrial,
    ProtocolConfig,
    TrialConfig,
    TrialKey,
)
from sdnn.runs.dask_worker import probe
from sdnn.runs.environment_trial import EnvironmentConfig, EnvironmentTrialConfig
from sdnn.runs.executor import run_to_end

PROTOCOL = ProtocolConfig(n_learning_episodes=6, test_interval=2)


class Counter(gym.Env):
    """Observes how many steps are done, and a random number; rewards 1 a step; ends after 3.

    `made` has those that were made.
    """

    made: ClassVar = []

    def __init__(self, length=3, reward=1.0):
        self.reward = float(reward)
        self.observation_space = gym.spaces.Box(0.0, np.array([10.0, 1.0]), (2,), np.float64)
        self.action_space = gym.spaces.Box(-1.0, 1.0, (1,))
        self.length = length
        self.seeds = []
        self.closed = False
        self.made.append(self)

    def _observation(self):
        return np.array([self._steps, self.np_random.uniform()])

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        assert options is None
        self.seeds.append(seed)
        self._steps = 0
        return self._observation(), {}

    def step(self, action):
        self._steps += 1
        return self._observation(), self.reward, self._steps == self.length, False, {}

    def close(self):
        self.closed = True


@dataclass(frozen=True, kw_only=True)
class Watching:
    n_inputs: int = 2


class Watcher:
    """Remembers what it observes."""

    seen: ClassVar = []

    def __init__(self, observation_space, action_space, *, approximator, learning, seed):
        self.seen.append([])
        assert observation_space.shape == (approximator.n_inputs,)

    def begin_episode(self):
        pass

    def act(self, observation, explore=True):
        self.seen[-1].append(("learning" if explore else "test", *observation))
        return np.zeros(1, np.float32)

    def learn(self, transition):
        pass


@pytest.fixture
def watched(monkeypatch):
    entry = AgentEntry(
        id="watcher", title="", approximator=Watching, learning=Watching, agent=Watcher
    )
    monkeypatch.setitem(AGENTS, "watcher", entry)
    monkeypatch.setitem(
        gym.registry,
        "Counter-v0",
        gym.envs.registration.EnvSpec("Counter-v0", entry_point=Counter, max_episode_steps=50),
    )
    monkeypatch.setattr(Counter, "made", [])
    monkeypatch.setattr(Watcher, "seen", [])

    def _config(**options):
        return EnvironmentTrialConfig(
            agent="watcher",
            approximator=Watching(),
            learning=Watching(),
            environment=EnvironmentConfig(id="Counter-v0", **options),
            protocol=PROTOCOL,
        )

    return _config


def test_rows_are_those_of_the_test_episodes(watched):
    trial = watched(kwargs={"length": 4}).make_trial(1)
    trial.advance(1)
    assert trial.test_rows()["episode"].size == 0
    trial.advance(100)
    assert trial.finished
    rows = trial.test_rows()
    assert rows["episode"].tolist() == [2, 4, 6]
    assert rows["steps"].tolist() == [4, 4, 4]
    assert rows["episode_return"].tolist() == [4.0, 4.0, 4.0]
    assert rows["solved"].tolist() == [True, True, True]
    assert trial.n_decisions == 4 * (6 + 3)
    trial.close()
    assert [env.closed for env in Counter.made] == [True, True]


@pytest.mark.parametrize("reward", ["nan", "inf", 1e308])
def test_a_return_that_is_no_number_ends_the_trial(watched, reward):
    config = watched(kwargs={"reward": reward})
    planned = PlannedTrial(TrialKey("counter", "watcher", 0, 1, config.config_hash), config)
    with pytest.raises(ValueError, match="add up to a finite number"):
        run_to_end(planned, wanted=lambda: True, advanced=lambda _: None)
    assert [env.closed for env in Counter.made] == [True, True]


def test_environments_are_closed_whatever_happens(watched):
    config = watched()
    planned = PlannedTrial(TrialKey("counter", "watcher", 0, 1, config.config_hash), config)
    assert run_to_end(planned, wanted=lambda: False, advanced=lambda _: None) is None
    with pytest.raises(ValueError, match="n_inputs must be"):
        replace(config, approximator=Watching(n_inputs=3)).make_trial(1)
    probe(planned)
    assert [env.closed for env in Counter.made] == [True] * 6


def test_truncated_episodes_are_not_solved(watched):
    trial = watched(kwargs={"max_episode_steps": 2}).make_trial(1)
    trial.advance(6)
    assert trial.test_rows()["steps"].tolist() == [2, 2, 2]
    assert not trial.test_rows()["solved"].any()


def test_both_environments_are_seeded_once_and_apart(watched):
    watched().make_trial(5).advance(6)
    learning, test = (env.seeds for env in Counter.made)
    assert [seed for seed in (*learning[1:], *test[1:]) if seed is not None] == []
    assert learning[0] != test[0]
    assert min(learning[0], test[0]) >= 0
    assert max(learning[0], test[0]) < 2**31
    watched().make_trial(5)
    watched().make_trial(6)
    firsts = [env.seeds[0] for env in Counter.made]
    assert firsts[2:4] == firsts[:2]
    assert len(set(firsts)) == 4


def test_tests_change_nothing_that_is_learned_later(watched):
    frequent = watched(noise=0.1)
    seldom = replace(frequent, protocol=replace(PROTOCOL, test_interval=6))
    for config in (frequent, seldom):
        config.make_trial(3).advance(6)
    learned = [[seen for seen in trial if seen[0] == "learning"] for trial in Watcher.seen]
    assert learned[0] == learned[1]
    assert len(learned[0]) == 18


def test_observations_are_scaled_and_noise_is_drawn_for_each(watched):
    for noise in (0.0, 0.01):
        watched(noise=noise, observation_high=(20.0, 1.0)).make_trial(3).advance(6)
    exact, noisy = (np.array([seen[1:] for seen in trial]) for trial in Watcher.seen)
    assert set(exact[:, 0]) == {0.0, 0.05, 0.1}
    deviations = (noisy - exact)[exact[:, 0] > 0]
    assert len(np.unique(deviations)) == deviations.size
    assert 0.005 < deviations.std() < 0.02


def test_tests_without_noise_have_none(watched):
    config = watched(noise=0.2)
    config.make_trial(3).advance(6)
    quiet = replace(config, protocol=replace(PROTOCOL, noisy_tests=False))
    quiet.make_trial(3).advance(6)
    noisy, tested = Watcher.seen
    assert [seen for seen in noisy if seen[0] == "learning"] == [
        seen for seen in tested if seen[0] == "learning"
    ]
    counted = {seen[1] for seen in tested if seen[0] == "test"}
    assert counted == {0.0, 0.1, 0.2}
    assert not counted >= {seen[1] for seen in noisy if seen[0] == "test"}


@pytest.mark.parametrize(
    ("agent", "approximator", "learning"),
    [
        ("sdnn-c", SDNNCConfig(n_inputs=3), None),
        ("rbf", RBFNetworkConfig(n_inputs=3), None),
        ("fuzzy", FuzzyRulesConfig(n_inputs=3), FuzzyQLearningConfig()),
    ],
)
def test_every_agent_runs_and_the_seed_fixes_the_rows(agent, approximator, learning):
    config = EnvironmentTrialConfig(
        agent=agent,
        approximator=approximator,
        environment=EnvironmentConfig(id="Pendulum-v1", noise=0.02),
        protocol=PROTOCOL,
        **({} if learning is None else {"learning": learning}),
    )
    rows = []
    for seed, pieces in ((1, [6]), (1, [1, 2, 3]), (2, [6])):
        trial = config.make_trial(seed)
        for n in pieces:
            trial.advance(n)
        rows.append(trial.test_rows()["episode_return"].tolist())
    assert rows[0] == rows[1]
    assert rows[0] != rows[2]
    assert not config.is_compiled


def test_the_hash_covers_every_setting():
    config = EnvironmentTrialConfig(
        environment=EnvironmentConfig(id="Pendulum-v1"), approximator=SDNNCConfig(n_inputs=3)
    )
    values = json.loads(config.canonical_json())
    assert values.keys() == {"agent", "approximator", "environment", "learning", "protocol"}
    assert values["environment"] == {
        "id": "Pendulum-v1", "kwargs": {}, "noise": 0, "observation_high": None,
        "observation_low": None,
    }  # fmt: skip
    others = [
        replace(config, environment=replace(config.environment, **change))
        for change in (
            {"id": "Pendulum-v0"}, {"kwargs": {"g": 9.0}}, {"noise": 0.1},
            {"observation_low": (0.0, 0.0, 0.0)}, {"observation_high": (2.0, 2.0, 2.0)},
        )
    ]  # fmt: skip
    others.append(replace(config, protocol=PROTOCOL))
    hashes = {c.config_hash for c in (config, TrialConfig(), *others)}
    assert len(hashes) == len(others) + 2


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"approximator": SDNNCConfig()}, ValueError, "n_inputs must be the number of observed"),
        ({"environment": EnvironmentConfig(id="Nowhere-v0")}, gym.error.Error, "Nowhere"),
        ({"environment": EnvironmentConfig(id="CartPole-v1")}, ValueError, "observation_low"),
        ({"environment": EnvironmentConfig(id="FrozenLake-v1")}, ValueError, "one-dimensional"),
    ],
)
def test_what_does_not_fit_is_refused(change, error, message):
    config = EnvironmentTrialConfig(
        environment=EnvironmentConfig(id="Pendulum-v1"), approximator=SDNNCConfig(n_inputs=3)
    )
    with pytest.raises(error, match=message):
        replace(config, **change).make_trial(1)


def test_agent_and_settings_must_fit():
    environment = EnvironmentConfig(id="Pendulum-v1")
    with pytest.raises(ValueError, match="agent must be one of"):
        EnvironmentTrialConfig(environment=environment, agent="dqn")
    with pytest.raises(TypeError, match="approximator of fuzzy must be a FuzzyRulesConfig"):
        EnvironmentTrialConfig(environment=environment, agent="fuzzy")
