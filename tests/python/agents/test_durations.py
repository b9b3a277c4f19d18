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


EXPLORING = {"discount": 0.9, "epsilon": 0.3}
AGENTS = {
    SDNNQLambda: (
        LinearSDNNConfig(averaging_interval=0),
        QLambdaConfig(**EXPLORING, final_learning_rate=0.02, schedule_steps=500, final_epsilon=0.3),
    ),
    SDNNActorCritic: (LinearSDNNConfig(), ActorCriticConfig(discount=0.9)),
    SDNNQLearning: (
        SDNNCConfig(n_hidden_units=400, n_active_units=200, n_pattern_units=20),
        QLearningConfig(**EXPLORING, n_greedy_steps=0, learning_rate=0.3, value_range="adaptive"),
    ),
    RBFQLearning: (RBFNetworkConfig(n_actions=2), QLearningConfig(**EXPLORING, n_greedy_steps=0)),
    FuzzyQLearning: (
        FuzzyRulesConfig(n_actions=2, n_sets=2),
        FuzzyQLearningConfig(**EXPLORING, n_greedy_steps=0),
    ),
}
"""Approximator and learning rule of each class of agents."""


def agent_and_courier(agent_class, **options):
    """Return an agent, and a function that makes its environment, with durations or without."""
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
    chooses_far = {}
    for has_durations in (False, True):
        agent, courier = agent_and_courier(agent_class)
        agent.train(courier(has_durations), steps=4000, seed=1)
        chooses_far[has_durations] = float(np.ravel(agent.act([0.5], explore=False))[0]) > 0
    assert chooses_far == {False: True, True: False}


def test_values_are_those_of_a_semi_markov_process():
    # The docstring of `Courier` derives the expected values of a near and of a far job.
    for has_durations, near, far in ((True, 10.0, 2 + 0.9**5 * 10), (False, 19.0, 20.0)):
        agent, courier = agent_and_courier(SDNNQLambda)
        agent.train(courier(has_durations), steps=20_000, seed=1)
        np.testing.assert_allclose(agent.q_values([0.5]), [near, far], rtol=0.03)


def random_steps(seed, n_steps):
    """Yield transitions of episodes, half of which have a duration of 1."""
    rng = np.random.default_rng(seed)
    observation = rng.random(1)
    for _ in range(n_steps):
        action = int(rng.integers(2))
        next_observation, ends = rng.random(1), bool(rng.random() < 0.1)
        dt = float(rng.choice([1.0, rng.uniform(0.1, 9.0)]))
        yield Transition(observation, action, float(rng.normal()), next_observation, ends, None, dt)
        observation = rng.random(1) if ends else next_observation


NEW_AGENTS = {
    agent_class.__name__: lambda agent_class=agent_class: agent_and_courier(agent_class)[0]
    for agent_class in AGENTS
    if agent_class is not FuzzyQLearning  # which learns only its own actions
} | {
    "Sarsa": lambda: SDNNQLambda(
        UNIT, NEAR_OR_FAR, seed=1, learning=QLambdaConfig(bootstrap="sarsa", discount=0.9)
    ),
    "4-step returns": lambda: SDNNQLearning(
        UNIT, NEAR_OR_FAR, seed=1,
        learning=QLearningConfig(n_steps=4, value_range="adaptive", discount=0.8),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", NEW_AGENTS)
def test_durations_of_1_change_nothing_and_are_not_saved(name):
    without_durations, with_1, with_durations = (NEW_AGENTS[name]() for _ in range(3))
    for transition in random_steps(seed=1, n_steps=60):
        without_durations.learn(Transition(*transition[:5]))
        with_1.learn(transition._replace(dt=1.0))
        with_durations.learn(transition)
    assert states_equal(without_durations, with_1)
    state, other_state = without_durations.state(), with_durations.state()
    assert not any("dt" in part for part in state)
    is_equal = [np.array_equal(array, other_state.get(part)) for part, array in state.items()]
    assert not all(is_equal), "other durations change something"


@pytest.mark.parametrize("name", NEW_AGENTS)
def test_an_agent_saved_between_transitions_of_any_duration_continues_with_the_same_bits(
    name, tmp_path
):
    agent, resumed = NEW_AGENTS[name](), NEW_AGENTS[name]()
    for t, transition in enumerate(random_steps(seed=2, n_steps=80)):
        agent.learn(transition)
        resumed.learn(transition)
        if t % 9 == 4:  # at various steps of episodes
            resumed.save(tmp_path / "agent.safetensors")
            resumed = load_agent(tmp_path / "agent.safetensors")
    assert states_equal(agent, resumed)


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNQLearning])
def test_a_warm_up_keeps_durations_and_learns_them_when_it_is_over(agent_class, tmp_path):
    def after_a_warm_up_of_30(steps):
        unbounded = gym.spaces.Box(-np.inf, np.inf, (1,), np.float64)
        agent = agent_class(
            unbounded, NEAR_OR_FAR, seed=1, warm_up_steps=30, inputs="all",
            observation_range="adaptive",
        )  # fmt: skip
        for t, transition in enumerate(steps):
            agent.learn(transition)
            if t == 20:
                assert agent.is_warming_up
                agent.save(tmp_path / "agent.safetensors")
                agent = load_agent(tmp_path / "agent.safetensors")
        return agent

    steps = list(random_steps(seed=3, n_steps=31))
    agent = after_a_warm_up_of_30(steps[:30])
    assert not agent.is_warming_up
    without_warm_up = agent_class(
        UNIT, NEAR_OR_FAR, seed=1, inputs="all",
        observation_range=tuple(bound.item() for bound in agent.observation_range),
    )  # fmt: skip
    for transition in steps[:30]:
        without_warm_up.learn(transition)
    weights = without_warm_up.networks[0].weights()
    np.testing.assert_array_equal(agent.networks[0].weights(), weights)
    all_of_1 = [transition._replace(dt=1.0) for transition in steps[:30]]
    other = after_a_warm_up_of_30([*all_of_1, steps[30]])
    assert not states_equal(after_a_warm_up_of_30(steps), other)


@pytest.mark.parametrize("agent_class", AGENTS)
def test_trainings_with_durations_resume_exactly(agent_class, tmp_path):
    class RandomDurations(Courier):
        def step(self, action):
            *outcome, _ = super().step(action)
            return *outcome, {"dt": self.np_random.uniform(0.1, 9.0)}

    def new_training(*callbacks):
        agent, courier = agent_and_courier(agent_class, observation_range=None, warm_up_steps=20)
        env = RandomDurations(True, courier(True).action_space)
        return Training(agent, env, steps=120, seed=1, callbacks=callbacks)

    path = tmp_path / "training.safetensors"
    check_exact_resume(new_training, lambda: new_training().env, path, [7, 33, 70])


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP", "DISABLED"])
@pytest.mark.parametrize("vector_class", [gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv])
def test_durations_are_learned_alike_from_all_vectors_and_autoreset_modes(mode, vector_class):
    def trained(vector_class, mode, has_durations=True):
        agent, courier = agent_and_courier(SDNNQLambda)
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
    # Without this, the training would reset each environment of a SyncVectorEnv itself.
    monkeypatch.setattr("sdnn.training.vectors._resets_each", lambda env: False)

    class OtherVectorEnv(gym.vector.SyncVectorEnv):
        """A vector of an unknown class, whose environments are not stepped one by one."""

    def trained(has_durations, mode):
        agent, courier = agent_and_courier(SDNNQLambda)
        autoreset_mode = gym.vector.AutoresetMode[mode]
        makers = [lambda: courier(has_durations)] * 2
        agent.train(OtherVectorEnv(makers, autoreset_mode=autoreset_mode), steps=300)
        return agent

    for mode in ("NEXT_STEP", "SAME_STEP"):
        assert not states_equal(trained(True, mode), trained(False, mode))
    assert states_equal(trained(True, "NEXT_STEP"), trained(True, "SAME_STEP"))


@pytest.mark.parametrize("name", ["dt", "dts"])
def test_arrays_lines_and_tables_with_durations_are_learned_like_their_transitions(name, tmp_path):
    steps = list(random_steps(seed=4, n_steps=40))
    agent = agent_and_courier(SDNNQLambda)[0]
    learn_from(agent, steps)
    observations, actions, rewards, next_observations, terminations, _, durations = map(
        np.array, zip(*steps, strict=True)
    )
    arrays = {
        "observations": observations, "actions": actions, "rewards": rewards,
        "next_observations": next_observations, "terminations": terminations, name: durations,
    }  # fmt: skip
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
        other = agent_and_courier(SDNNQLambda)[0]
        learn_from(other, log)
        assert states_equal(agent, other)


@pytest.mark.parametrize("dt", [2.5, np.float32(2.5), np.array(2.5), np.array([2.5])])
def test_durations_may_be_arrays_of_one_number(dt):
    agents = [agent_and_courier(SDNNQLambda)[0] for _ in range(2)]
    for agent, duration in zip(agents, (2.5, dt), strict=True):
        for _ in range(2):
            agent.learn(Transition([0.5], 0, 1.0, [0.5], False, None, duration))
    assert states_equal(*agents)


def test_returns_of_imitated_episodes_are_discounted_by_durations():
    agent = agent_and_courier(SDNNQLambda)[0]
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
    agent, courier = agent_and_courier(agent_class)
    action = agent.act([0.5])
    before = agent.state()
    transition = Transition([0.5], action, 1.0, [0.5], False, None, dt)
    for call in (agent.learn, agent.check):
        refuses("dt", call, transition)
    if agent_class is not FuzzyQLearning:  # which learns from no log
        message = "dataset, episode 0, transition 1: dt must be"
        with pytest.raises((TypeError, ValueError), match=message):
            learn_from(agent, [Transition([0.5], action, 1.0, [0.5], False), transition])
    after = agent.state()
    assert all(np.array_equal(values, after[name]) for name, values in before.items())

    class BadThirdStep(Courier):
        def step(self, action):
            *outcome, info = super().step(action)
            return *outcome, info | ({"dt": dt} if self.n == 3 else {})

    env = BadThirdStep(True, courier(True).action_space)
    with pytest.raises(UnusableStepError, match=r"step 3 of episode 0\): dt must be"):
        agent.train(env, steps=10)
    with pytest.raises(UnusableStepError, match=r"\bdt\b"):
        agent.train(gym.vector.SyncVectorEnv([lambda: env]), steps=10)


class Misnaming(Courier):
    """Announces durations, but returns them under another key."""

    def step(self, action):
        *outcome, info = super().step(action)
        return *outcome, {"duration": info["dt"], "job": 1}


def test_an_error_about_a_missing_duration_names_the_keys_of_the_info():
    agent = agent_and_courier(SDNNQLambda)[0]
    keys = r"got \['duration', 'job'\]"
    with pytest.raises(UnusableStepError, match=f"info must have 'dt'.*{keys}"):
        agent.train(Misnaming(), steps=10)


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP", "DISABLED"])
@pytest.mark.parametrize("vector_class", [gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv])
def test_an_error_about_a_missing_duration_names_the_environment_of_a_vector(vector_class, mode):
    agent = agent_and_courier(SDNNQLambda)[0]
    envs = vector_class([Courier, Misnaming], autoreset_mode=gym.vector.AutoresetMode[mode])
    message = r"environment 1\b.* must have 'dt'.*got \['duration', 'job'\]"
    with pytest.raises(UnusableStepError, match=message):
        agent.train(envs, steps=10)
    envs.close()


@pytest.mark.parametrize(
    "vector_class", [None, gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv]
)
def test_a_duration_of_nan_is_an_unusable_step_for_learners_in_python_too(vector_class):
    class Learner:
        n_environments = 1

        def begin_episode(self):
            pass

        def act(self, observation, explore=True):
            return 0

        def learn(self, transition):
            raise AssertionError("a step was learned")

    class Timeless(Courier):
        def step(self, action):
            *outcome, info = super().step(action)
            return *outcome, info | {"dt": np.nan}

    env = Timeless() if vector_class is None else vector_class([Timeless])
    with pytest.raises(UnusableStepError, match="dt must be finite"):
        Training(Learner(), env, steps=10).run()
    env.close()


@pytest.mark.parametrize("vector_class", [gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv])
def test_the_metadata_of_a_vectors_first_environment_decide_for_all(vector_class):
    agent = agent_and_courier(SDNNQLambda)[0]
    envs = vector_class([Courier, lambda: Courier(has_durations=False)])
    assert agent.train(envs, steps=10).n_steps == 10
    envs.close()


def test_a_missing_duration_of_an_episodes_last_step_is_looked_for_in_its_final_info(monkeypatch):
    # The vector resets itself: at the end of an episode, after 50 steps, its info is that of the
    # reset, which has no job, and that of the last step is in "final_info".
    monkeypatch.setattr("sdnn.training.vectors._resets_each", lambda env: False)

    class ForgettingTheLast(Courier):
        def step(self, action):
            *outcome, info = super().step(action)
            return *outcome, {"job": 1} if self.n == 50 else info

    agent = agent_and_courier(SDNNQLambda)[0]
    envs = gym.vector.AsyncVectorEnv(
        [ForgettingTheLast], autoreset_mode=gym.vector.AutoresetMode.SAME_STEP
    )
    with pytest.raises(UnusableStepError, match=r"step 50\b.*got \['job'\]"):
        agent.train(envs, steps=60)
    envs.close()


def test_values_are_finite_at_the_shortest_and_longest_duration_and_any_discount():
    for discount in (0.0, 1e-300, 0.5, 1.0):
        for dt in (0.001, 1e6):
            agent = SDNNQLambda(UNIT, NEAR_OR_FAR, learning=QLambdaConfig(discount=discount))
            for _ in range(50):
                agent.learn(Transition([0.5], 0, 1.0, [0.5], False, None, dt))
            assert np.isfinite(agent.q_values([0.5])).all()


def test_a_fuzzy_agent_is_saved_after_many_transitions_of_the_shortest_duration(tmp_path):
    # Traces decay by only 0.99 * 0.5^0.001 in each transition, so that many are saved.
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


def test_a_whole_power_of_a_discount_is_its_repeated_product():
    for discount in (0.0, 0.3, 0.9, 0.999, 1.0):
        for dt in (1, 2, 7, 40):
            assert _core.power(discount, dt) == pytest.approx(np.prod([discount] * dt), rel=1e-14)
