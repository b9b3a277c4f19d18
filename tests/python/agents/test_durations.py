"""Transitions of unequal duration: discounts, traces, and where durations come from."""

import json

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn import _core
from sdnn.agents import (
    ActorCriticConfig,
    FuzzyQLearning,
    FuzzyQLearningConfig,
    QLambdaConfig,
    QLearningConfig,
    RBFQLearning,
    SDNNActorCritic,
    SDNNQLambda,
    SDNNQLearning,
    Training,
    Transition,
    UnusableStepError,
    imitate,
    learn_from,
    load_agent,
)
from sdnn.approximators import FuzzyRulesConfig, LinearSDNNConfig, RBFNetworkConfig, SDNNCConfig
from stopped_training import check_exact_resume, states_equal

UNIT = gym.spaces.Box(0.0, 1.0, (1,), np.float64)
NEAR_OR_FAR = gym.spaces.Discrete(2)
BAD_DURATIONS = [
    0, 0.0, -1.0, np.nan, np.inf, -np.inf, 1e-9, 0.0009, 1e6 + 1, 1e300, 10**400, "1", None, True,
    np.array([1.0, 2.0]),
]  # fmt: skip
"""Durations must be numbers from 0.001 to 1e6."""


class Courier(gym.Env):
    """Jobs without end: a near one pays 1 and takes 1 step, a far one pays 2 and takes 5 steps.

    With gamma = 0.9, near jobs are worth 1 / (1 - 0.9) = 10, and far ones 2 / (1 - 0.9^5) = 4.88.
    A far job and then near ones: 2 + 0.9^5 * 10 = 7.90. Without durations, far jobs seem to be
    worth 2 / (1 - 0.9) = 20, and a near one before them 1 + 0.9 * 20 = 19.
    """

    def __init__(self, has_durations=True, actions=NEAR_OR_FAR):
        self.observation_space, self.action_space = UNIT, actions
        self.metadata = {"durations": has_durations}

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.n = 0
        return np.array([0.5]), {}

    def step(self, action):
        self.n += 1
        is_far = float(np.ravel(action)[0]) > 0
        info = {"dt": 5 if is_far else 1}
        return np.array([0.5]), 2.0 if is_far else 1.0, False, self.n == 50, info


def policy(**settings):
    return {"discount": 0.9, "epsilon": 0.3} | settings


AGENTS = {
    SDNNQLambda: (
        LinearSDNNConfig(averaging_interval=0),
        QLambdaConfig(**policy(final_learning_rate=0.02, schedule_steps=500, final_epsilon=0.3)),
    ),
    SDNNActorCritic: (LinearSDNNConfig(), ActorCriticConfig(discount=0.9)),
    SDNNQLearning: (
        SDNNCConfig(n_hidden_units=400, n_active_units=200, n_pattern_units=20),
        QLearningConfig(**policy(n_greedy_steps=0, learning_rate=0.3, value_range="adaptive")),
    ),
    RBFQLearning: (RBFNetworkConfig(n_actions=2), QLearningConfig(**policy(n_greedy_steps=0))),
    FuzzyQLearning: (
        FuzzyRulesConfig(n_actions=2, n_sets=2),
        FuzzyQLearningConfig(**policy(n_greedy_steps=0)),
    ),
}


def couriers(agent_class, **options):
    is_fuzzy = agent_class is FuzzyQLearning
    actions = gym.spaces.Box(-1.0, 1.0, (1,)) if is_fuzzy else NEAR_OR_FAR
    approximator, learning = AGENTS[agent_class]
    if agent_class in (SDNNQLambda, SDNNActorCritic):
        options = {"inputs": "all", "angle_pairs": "none"} | options
    options = {"observation_range": (0.0, 1.0)} | options
    agent = agent_class(
        UNIT, actions, approximator=approximator, learning=learning, seed=1, **options
    )
    return agent, lambda has_durations: Courier(has_durations, actions)


@pytest.mark.parametrize("agent_class", AGENTS)
def test_a_long_action_with_the_higher_reward_is_chosen_only_without_durations(agent_class):
    chosen = {}
    for has_durations in (False, True):
        agent, courier = couriers(agent_class)
        agent.train(courier(has_durations), steps=4000, seed=1)
        chosen[has_durations] = float(np.ravel(agent.act([0.5], explore=False))[0]) > 0
    assert chosen == {False: True, True: False}


def test_values_are_those_of_a_semi_markov_process():
    # The docstring of `Courier` derives the expected values of a near and of a far job.
    agent, courier = couriers(SDNNQLambda)
    agent.train(courier(True), steps=20_000, seed=1)
    np.testing.assert_allclose(agent.q_values([0.5]), [10.0, 2 + 0.9**5 * 10], rtol=0.03)
    agent, courier = couriers(SDNNQLambda)
    agent.train(courier(False), steps=20_000, seed=1)
    np.testing.assert_allclose(agent.q_values([0.5]), [19.0, 20.0], rtol=0.03)


def random_steps(seed, n, agent_class=SDNNQLambda):
    """Yield transitions of episodes, half of them usual steps."""
    rng = np.random.default_rng(seed)
    observation = rng.random(1)
    for _ in range(n):
        action = int(rng.integers(2))
        next_observation, ends = rng.random(1), bool(rng.random() < 0.1)
        dt = float(rng.choice([1.0, rng.uniform(0.1, 9.0)]))
        yield Transition(observation, action, float(rng.normal()), next_observation, ends, None, dt)
        observation = rng.random(1) if ends else next_observation


OFF_POLICY = [agent_class for agent_class in AGENTS if agent_class is not FuzzyQLearning]
OPTIONS = {
    "sarsa": {"learning": QLambdaConfig(bootstrap="sarsa", discount=0.9)},
    "n steps": {"learning": QLearningConfig(n_steps=4, value_range="adaptive", discount=0.8)},
}


def agents():
    for agent_class in OFF_POLICY:
        yield agent_class.__name__, lambda agent_class=agent_class: couriers(agent_class)[0]
    yield "sarsa", lambda: SDNNQLambda(UNIT, NEAR_OR_FAR, seed=1, **OPTIONS["sarsa"])
    yield ("n steps", lambda: SDNNQLearning(UNIT, NEAR_OR_FAR, seed=1, **OPTIONS["n steps"]))


MAKERS = dict(agents())


@pytest.mark.parametrize("name", MAKERS)
def test_durations_of_1_change_nothing_and_are_not_saved(name):
    agent, same, other = MAKERS[name](), MAKERS[name](), MAKERS[name]()
    for transition in random_steps(1, 60):
        agent.learn(Transition(*transition[:5]))
        same.learn(transition._replace(dt=1.0))
        other.learn(transition)
    assert states_equal(agent, same)
    assert not any("dt" in part for part in agent.state())
    is_equal = [
        np.array_equal(array, other.state().get(part)) for part, array in agent.state().items()
    ]
    assert not all(is_equal), "other durations change something"


@pytest.mark.parametrize("name", MAKERS)
def test_a_saved_agent_continues_with_the_same_bits_after_transitions_of_any_duration(
    name, tmp_path
):
    agent, same = MAKERS[name](), MAKERS[name]()
    for t, transition in enumerate(random_steps(2, 80)):
        agent.learn(transition)
        same.learn(transition)
        if t % 9 == 4:
            same.save(tmp_path / "agent.safetensors")
            same = load_agent(tmp_path / "agent.safetensors")
    assert states_equal(agent, same)


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNQLearning])
def test_a_warm_up_keeps_durations_and_learns_them_when_it_is_over(agent_class, tmp_path):
    def warming_up(steps):
        unknown = gym.spaces.Box(-np.inf, np.inf, (1,), np.float64)
        agent = agent_class(
            unknown, NEAR_OR_FAR, seed=1, warm_up_steps=30, inputs="all",
            observation_range="adaptive",
        )  # fmt: skip
        for t, transition in enumerate(steps):
            agent.learn(transition)
            if t == 20:
                assert agent.is_warming_up
                agent.save(tmp_path / "agent.safetensors")
                agent = load_agent(tmp_path / "agent.safetensors")
        return agent

    steps = list(random_steps(3, 31))
    usual = [transition._replace(dt=1.0) for transition in steps]
    agent = warming_up(steps[:30])
    assert not agent.is_warming_up
    later = agent_class(
        UNIT, NEAR_OR_FAR, seed=1, inputs="all",
        observation_range=tuple(bound.item() for bound in agent.observation_range),
    )  # fmt: skip
    for transition in steps[:30]:
        later.learn(transition)
    np.testing.assert_array_equal(agent.networks[0].weights(), later.networks[0].weights())
    assert not states_equal(warming_up(steps), warming_up([*usual[:30], steps[30]]))


@pytest.mark.parametrize("agent_class", AGENTS)
def test_trainings_with_durations_resume_exactly(agent_class, tmp_path):
    class Random(Courier):
        def step(self, action):
            *outcome, _ = super().step(action)
            return *outcome, {"dt": self.np_random.uniform(0.1, 9.0)}

    def new_training(*callbacks):
        agent, courier = couriers(agent_class, observation_range=None, warm_up_steps=20)
        env = Random(True, courier(True).action_space)
        return Training(agent, env, steps=120, seed=1, callbacks=callbacks)

    path = tmp_path / "training.safetensors"
    check_exact_resume(new_training, lambda: new_training().env, path, [7, 33, 70])


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP", "DISABLED"])
@pytest.mark.parametrize("vector_class", [gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv])
def test_vectors_have_a_duration_for_each_environment(mode, vector_class):
    def trained(vector_class, mode, has_durations=True):
        agent, courier = couriers(SDNNQLambda)
        envs = vector_class(
            [lambda: courier(has_durations)] * 2, autoreset_mode=gym.vector.AutoresetMode[mode]
        )
        agent.train(envs, steps=300, seed=1)
        envs.close()
        return agent

    agent = trained(gym.vector.SyncVectorEnv, "NEXT_STEP")
    assert states_equal(trained(vector_class, mode), agent)
    assert not states_equal(trained(vector_class, mode, has_durations=False), agent)


def test_durations_are_learned_from_a_vector_that_resets_its_environments_itself(monkeypatch):
    monkeypatch.setattr("sdnn.training.vectors._resets_each", lambda env: False)

    class Opaque(gym.vector.SyncVectorEnv):
        """A vector whose environments are not stepped one by one."""

    def trained(has_durations, mode):
        agent, courier = couriers(SDNNQLambda)
        modes = gym.vector.AutoresetMode
        agent.train(
            Opaque([lambda: courier(has_durations)] * 2, autoreset_mode=modes[mode]), steps=300
        )
        return agent

    for mode in ("NEXT_STEP", "SAME_STEP"):
        assert not states_equal(trained(True, mode), trained(False, mode))
    assert states_equal(trained(True, "NEXT_STEP"), trained(True, "SAME_STEP"))


@pytest.mark.parametrize("name", ["dt", "dts"])
def test_logs_of_every_form_have_durations(name, tmp_path):
    steps = list(random_steps(4, 40))
    agent = couriers(SDNNQLambda)[0]
    learn_from(agent, steps)
    columns = ("observations", "actions", "rewards", "next_observations", "terminations")
    arrays = {
        column: np.array(values)
        for column, values in zip(
            columns, zip(*(step[:5] for step in steps), strict=True), strict=True
        )
    }
    arrays[name] = np.array([step.dt for step in steps])
    table = tmp_path / "log.csv"
    with table.open("w") as file:
        print(f"observation_0,action,reward,next_observation_0,terminated,{name}", file=file)
        for step in steps:
            numbers = (step.observation[0], step.action, step.reward, step.next_observation[0])
            print(*map(repr, map(float, numbers)), step.terminated, step.dt, sep=",", file=file)
    lines = tmp_path / "log.jsonl"
    with lines.open("w") as file:
        for step in steps:
            row = {key: np.asarray(value).tolist() for key, value in step._asdict().items()}
            row[name] = row.pop("dt")
            print(json.dumps(row), file=file)
    for log in (arrays, lines, table):
        other = couriers(SDNNQLambda)[0]
        learn_from(other, log)
        assert states_equal(agent, other)


@pytest.mark.parametrize("dt", [2.5, np.float32(2.5), np.array(2.5), np.array([2.5])])
def test_durations_may_be_arrays_of_one_number(dt):
    agents = [couriers(SDNNQLambda)[0] for _ in range(2)]
    for agent, duration in zip(agents, (2.5, dt), strict=True):
        for _ in range(2):
            agent.learn(Transition([0.5], 0, 1.0, [0.5], False, None, duration))
    assert states_equal(*agents)


def test_imitated_returns_are_discounted_by_durations():
    agent = couriers(SDNNQLambda)[0]
    steps = [
        Transition([0.0], 0, 4.0, [1.0], False, None, 3.0),
        Transition([1.0], 0, 8.0, [0.0], True),
    ]
    imitate(agent, steps, epochs=200)
    # The first step takes 3.0, so that the second reward, 8, is discounted by 0.9^3.
    assert agent.q_values([0.0]).max() == pytest.approx(4 + 0.9**3 * 8, rel=0.02)


@pytest.mark.parametrize("dt", BAD_DURATIONS)
@pytest.mark.parametrize("agent_class", AGENTS)
def test_impossible_durations_are_refused_and_change_nothing(agent_class, dt):
    agent, courier = couriers(agent_class)
    action = agent.act([0.5])
    before = agent.state()
    transition = Transition([0.5], action, 1.0, [0.5], False, None, dt)
    for call in (agent.learn, agent.check):
        refuses("dt", call, transition)
    if agent_class is not FuzzyQLearning:
        message = "dataset, episode 0, transition 1: dt must be"
        with pytest.raises((TypeError, ValueError), match=message):
            learn_from(agent, [Transition([0.5], action, 1.0, [0.5], False), transition])
    assert all(np.array_equal(values, agent.state()[name]) for name, values in before.items())

    class BadThirdStep(Courier):
        def step(self, action):
            *outcome, info = super().step(action)
            return *outcome, info | ({"dt": dt} if self.n == 3 else {})

    env = BadThirdStep(True, courier(True).action_space)
    with pytest.raises(UnusableStepError, match=r"step 3 of episode 0\): dt must be"):
        agent.train(env, steps=10)
    with pytest.raises(UnusableStepError, match=r"\bdt\b"):
        agent.train(gym.vector.SyncVectorEnv([lambda: env]), steps=10)


def test_an_environment_that_announces_durations_must_give_them():
    class Silent(Courier):
        def step(self, action):
            return *super().step(action)[:4], {}

    agent = couriers(SDNNQLambda)[0]
    with pytest.raises(UnusableStepError, match="info must have 'dt'"):
        agent.train(Silent(), steps=10)
    for vector_class in (gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv):
        with pytest.raises(
            UnusableStepError, match=r"\bdt\b.*environment 1\b|environment 1: .*'dt'"
        ):
            agent.train(vector_class([Courier, Silent]), steps=10)


def test_values_are_finite_at_the_shortest_and_longest_duration_and_any_discount():
    for discount in (0.0, 1e-300, 0.5, 1.0):
        for dt in (0.001, 1e6):
            agent = SDNNQLambda(UNIT, NEAR_OR_FAR, learning=QLambdaConfig(discount=discount))
            for _ in range(50):
                agent.learn(Transition([0.5], 0, 1.0, [0.5], False, None, dt))
            assert np.isfinite(agent.q_values([0.5])).all()


def test_a_fuzzy_agent_is_saved_after_many_transitions_of_the_shortest_duration(tmp_path):
    agent = FuzzyQLearning(
        UNIT,
        gym.spaces.Box(-1.0, 1.0, (1,)),
        approximator=FuzzyRulesConfig(n_actions=21),
        learning=FuzzyQLearningConfig(
            trace_decay=0.99, discount=0.5, epsilon=1.0, n_greedy_steps=0
        ),
        seed=1,
    )
    rng = np.random.default_rng(1)
    for _ in range(500):
        observation = rng.random(1)
        action = agent.act(observation)
        agent.learn(Transition(observation, action, 0.0, rng.random(1), False, None, 0.001))
    agent.save(tmp_path / "agent.safetensors")
    assert states_equal(load_agent(tmp_path / "agent.safetensors"), agent)


def test_powers_are_those_of_repeated_products():
    for discount in (0.0, 0.3, 0.9, 0.999, 1.0):
        for dt in (1, 2, 7, 40):
            assert _core.power(discount, dt) == pytest.approx(np.prod([discount] * dt), rel=1e-14)
