"""The loop over an environment: its rows, its ends, and going on exactly."""

import copy
import functools
import json
import re
import tracemalloc
from decimal import Decimal

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn.agents import (
    Callback,
    CheckpointCallback,
    FuzzyQLearning,
    JSONLines,
    QLearningConfig,
    RBFQLearning,
    SDNNQLearning,
    StopTrainingOnRewardThreshold,
    Training,
    Transition,
    UnrepeatedEpisodeError,
    UnusableStepError,
    evaluate,
    load_agent,
)
from sdnn.approximators import SDNNCConfig
from sdnn.support.files import read_file, write_file
from stopped_training import Stop, check_exact_resume, states_equal

SMALL = SDNNCConfig(n_pattern_units=20, n_hidden_units=60, n_active_units=20, n_actions=5)
KINDS = {
    "sdnn": (SDNNQLearning, {"approximator": SMALL}),
    "rbf": (RBFQLearning, {}),
    "fuzzy": (FuzzyQLearning, {}),
}


class Corridor(gym.Env):
    """Five cells; the right end terminates with 1, every step costs 0.1, eight steps truncate."""

    observation_space = gym.spaces.Box(0.0, 4.0, (1,), dtype=np.float64)
    action_space = gym.spaces.Discrete(2)

    def __init__(self, is_random=False):
        self._is_random = is_random
        self.seeds = []

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.seeds.append(seed)
        self._at, self._steps = int(self.np_random.integers(2)), 0
        return self._seen(), {}

    def step(self, action):
        self._at = max(0, self._at + (1 if action else -1))
        self._steps += 1
        ends = self._at == 4
        return self._seen(), 1.0 if ends else -0.1, ends, self._steps == 8, {}

    def _seen(self):
        shift = np.random.default_rng().uniform(0, 0.1) if self._is_random else 0.0
        return np.array([self._at + shift])


class Careless(gym.Env):
    """A point on a line, drawn to the middle; tells its own array, and changes the action it gets.

    With ``is_careful`` neither.
    """

    observation_space = gym.spaces.Box(-1.0, 1.0, (2,), dtype=np.float64)
    action_space = gym.spaces.Box(-1.0, 1.0, (1,), dtype=np.float64)

    def __init__(self, is_careful=False):
        self._is_careful = is_careful
        self._state = np.zeros(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._state[:] = self.np_random.uniform(-1.0, 1.0, 2)
        self._steps = 0
        return self._seen(), {}

    def step(self, action):
        force = action.copy() if self._is_careful else action
        force *= 0.1
        self._state[:] = np.clip(self._state + np.append(force, 0.0), -1.0, 1.0)
        self._steps += 1
        reward = np.array([-abs(self._state[0])])
        return self._seen(), reward, np.bool_(False), self._steps == 20, {}

    def _seen(self):
        return self._state.copy() if self._is_careful else self._state


def corridor_agent(**options):
    env = Corridor()
    return SDNNQLearning(
        env.observation_space, env.action_space, approximator=SMALL, seed=1, **options
    )


@pytest.mark.parametrize("kind", KINDS)
def test_environments_that_reuse_their_arrays_do_not_change_learning(kind):
    make, options = KINDS[kind]
    agents = []
    for is_careful in (True, False):
        env = Careless(is_careful)
        agents.append(make(env.observation_space, env.action_space, seed=3, **options))
        agents[-1].train(env, steps=300, evaluate_every=100, evaluation_env=Careless(is_careful))
    assert states_equal(*agents)


def test_an_environment_that_does_not_fit_is_refused():
    agent = corridor_agent()
    env = Corridor()
    refuses("evaluation_env", agent.train, env, steps=10, evaluate_every=5, evaluation_env=env)
    for name, space in (
        ("observation_space", gym.spaces.Box(0.0, 4.0, (2,), dtype=np.float64)),
        ("action_space", gym.spaces.Discrete(3)),
    ):
        other = Corridor()
        setattr(other, name, space)
        refuses("env", agent.train, other, steps=10)
        refuses("env", evaluate, agent, other)


def test_an_evaluation_that_seems_not_to_end_is_warned_of():
    class Endless(Corridor):
        def step(self, action):
            self._steps += 1
            return np.zeros(1), 0.0, self._steps == 100_001, False, {}

    class Stays:
        def act(self, observation, explore=True):
            return 0

    with pytest.warns(RuntimeWarning, match="max_episode_steps"):
        assert evaluate(Stays(), Endless(), 1).lengths.tolist() == [100_001]


@pytest.mark.parametrize("reward", [np.float32(1), np.array([1]), Decimal(1), True, np.array(1.0)])
def test_rewards_of_other_kinds_are_numbers_too(reward):
    class Kind(Corridor):
        def step(self, action):
            return super().step(action)[0], reward, False, self._steps == 8, {}

    assert corridor_agent().train(Kind(), episodes=2).returns.tolist() == [8.0, 8.0]
    assert evaluate(corridor_agent(), Kind(), 1).mean_return == 8.0


class Broken(Corridor):
    """Gives something else at a step, or by its second reset, than a corridor does."""

    def __init__(self, at=11, **given):
        super().__init__()
        self._at_step, self._given, self._n_steps, self._n_resets = at, given, 0, 0

    def reset(self, *, seed=None, options=None):
        seen, told = super().reset(seed=seed)
        self._n_resets += 1
        return (self._given.get("first", seen) if self._n_resets == 2 else seen), told

    def step(self, action):
        seen, *_ = super().step(0)
        self._n_steps += 1
        given = self._given if self._n_steps == self._at_step else {}
        return given.get("seen", seen), given.get("reward", 1.0), False, self._steps == 8, {}


BROKEN = [
    ({"reward": np.nan}, "step 3", "got nan"),
    ({"seen": np.array([np.nan])}, "step 3", "observation[0] must be finite"),
    ({"seen": np.zeros(2)}, "step 3", "observation"),
    ({"first": np.array([np.nan])}, "the reset", "observation[0] must be finite"),
]


@pytest.mark.parametrize(("given", "where", "problem"), BROKEN)
def test_unusable_steps_are_reported_with_step_and_episode(given, where, problem):
    with pytest.raises(UnusableStepError, match=re.escape(problem)) as told:
        corridor_agent().train(Broken(**given), steps=40)
    step = 9 if where == "the reset" else 11
    assert f"in step {step} ({where} of episode 1): " in str(told.value)
    with pytest.raises(UnusableStepError, match=re.escape(problem)) as told:
        evaluate(corridor_agent(), Broken(**given))
    assert f"in {where} of greedy episode 1: " in str(told.value)


def test_unusable_steps_of_a_vector_name_the_environment():
    envs = gym.vector.SyncVectorEnv([Corridor, lambda: Broken(reward=np.nan)])
    with pytest.raises(UnusableStepError, match=r"environment 1\b.*\breward\b"):
        corridor_agent().train(envs, steps=40)


def test_a_reward_far_beyond_the_others_is_warned_of_once_and_not_learned():
    env = Broken(reward=1e300)
    env.action_space = gym.spaces.Box(-1.0, 1.0, (1,))
    agent = FuzzyQLearning(env.observation_space, env.action_space)
    with pytest.warns(UserWarning, match=r"reward 1e\+300 of transition 11") as warned:
        agent.train(env, steps=40)
    assert len(warned) == 1
    assert np.isfinite(agent.state()["agent.rules.values"]).all()


def test_errors_of_an_environment_are_raised_unchanged():
    class Failing(Corridor):
        def step(self, action):
            raise ValueError("no current")

    for use in (lambda agent, env: agent.train(env, steps=9), evaluate):
        with pytest.raises(ValueError, match=r"^no current$") as told:
            use(corridor_agent(), Failing())
        assert not isinstance(told.value, UnusableStepError)


class FailsOnce(Careless):
    """Careful, but one of its calls fails: by an error, or by what cannot be learned."""

    def __init__(self, call=("step", None), failure=TimeoutError):
        super().__init__(is_careful=True)
        self._left = {"step": None, "reset": None} | dict([call])
        self._failure = failure

    def reset(self, **options):
        self._fail("reset")
        return super().reset(**options)

    def step(self, action):
        seen, reward, *ends = super().step(action)
        return seen, self._fail("step") or float(reward[0]), *ends

    def _fail(self, name):
        if self._left[name] is None:
            return None
        self._left[name] -= 1
        if self._left[name] == 0:
            if self._failure is TimeoutError:
                raise TimeoutError("no answer")
            return np.nan
        return None


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("call", "failure", "n_learned"),
    [
        (("step", 1), TimeoutError, 0),
        (("step", 33), TimeoutError, 32),
        (("step", 33), UnusableStepError, 32),
        (("reset", 1), TimeoutError, 0),
        (("reset", 3), TimeoutError, 40),
    ],
)
def test_learning_before_an_environment_fails_is_kept(kind, call, failure, n_learned, tmp_path):
    make, options = KINDS[kind]
    env = FailsOnce(call, failure)
    agent = make(env.observation_space, env.action_space, seed=3, **options)
    path, rows = tmp_path / "checkpoint", JSONLines(tmp_path / "rows.jsonl")
    training = Training(
        agent, env, steps=100, callbacks=[rows, CheckpointCallback(path, every=1000)]
    )
    with pytest.raises(failure):
        training.run()
    assert not training.is_within_step
    loaded = Training.load(path, FailsOnce())
    assert loaded.n_steps == training.n_steps == n_learned
    assert states_equal(loaded.agent, agent)
    for one in (loaded, training):
        one.run()
        assert (one.n_steps, one.n_episodes) == (100, 4 if n_learned == 32 else 5)
    assert states_equal(loaded.agent, agent)
    told = [json.loads(line) for line in rows.path.read_text().splitlines()]
    assert [row["episode"] for row in told] == list(range(training.n_episodes))
    assert {row["length"] for row in told} == {20}


def change_actions(path, change):
    """Save a training in its third step, and change the actions of its episode in the file."""
    env = Corridor()
    agent = SDNNQLearning(env.observation_space, env.action_space, approximator=SMALL, seed=3)
    Training(agent, env, episodes=9, callbacks=[Stop(3, path)]).run()
    description, arrays = read_file(path, "training")
    name = "training.0.actions"
    assert len(arrays[name]) > 0
    write_file(path, "training", arrays | {name: change(arrays[name])}, description)
    return name, env


@pytest.mark.parametrize(
    "change",
    [
        lambda actions: actions + 9,
        lambda actions: actions - 9,
        lambda actions: actions[:, np.newaxis],
        lambda actions: actions + 0.0,
        lambda actions: actions.astype(np.uint64),
        lambda actions: actions[0],
    ],
)
def test_an_environment_gets_no_actions_that_it_does_not_have_from_a_file(change, tmp_path):
    path = tmp_path / "checkpoint"
    name, env = change_actions(path, change)
    refuses(name, Training.load, path, env)


def test_an_episode_of_a_file_may_have_no_actions(tmp_path):
    path = tmp_path / "checkpoint"
    _, env = change_actions(path, lambda actions: actions[:0])
    with pytest.raises(UnrepeatedEpisodeError):  # the first observation is not the fourth
        Training.load(path, env)


@pytest.mark.parametrize("has_own_resets", [False, True])
def test_learning_before_one_of_several_environments_fails_is_kept(has_own_resets, tmp_path):
    env = gym.vector.SyncVectorEnv([FailsOnce, functools.partial(FailsOnce, ("step", 33))])
    if has_own_resets:
        env = gym.wrappers.vector.NormalizeObservation(env)
    make, options = KINDS["sdnn"]
    agent = make(env.single_observation_space, env.single_action_space, seed=3, **options)
    path = tmp_path / "checkpoint"
    training = Training(agent, env, steps=200, callbacks=[CheckpointCallback(path, every=1000)])
    with pytest.raises(TimeoutError):
        training.run()
    careful = gym.vector.SyncVectorEnv([FailsOnce] * 2)
    if has_own_resets:  # the observations of the other vector, not normalized
        space = env.single_observation_space
        careful = gym.wrappers.vector.TransformObservation(
            careful, np.asarray, env.observation_space, space
        )
    loaded = Training.load(path, careful, repeat_episodes=not has_own_resets)
    assert loaded.n_steps == training.n_steps == 64
    training.run()
    loaded.run()
    assert training.n_steps == loaded.n_steps == 200
    assert training.n_episodes == loaded.n_episodes == 8, "two, and then six"
    assert states_equal(loaded.agent, agent) != has_own_resets


def test_a_start_that_fails_is_skipped_on_resuming(tmp_path):
    env = Corridor()
    corridor_agent().train(env, episodes=4, seed=7)
    bad = env.seeds[2:4]

    class Picky(Corridor):
        def reset(self, *, seed=None, options=None):
            if seed in bad:
                raise RuntimeError("no such start")
            return super().reset(seed=seed)

    path = tmp_path / "checkpoint"
    callbacks = [CheckpointCallback(path)]
    training = Training(corridor_agent(), Picky(), episodes=4, seed=7, callbacks=callbacks)
    for _ in bad:
        refuses("start", training.run, error=RuntimeError)
        assert training.n_episodes == 2
        training = Training.load(path, Picky(), callbacks=callbacks)
    assert training.run().n_episodes == 4
    assert training.next_episode == 6


@pytest.mark.parametrize("n_envs", [1, 2])
def test_a_training_stopped_after_a_failure_resumes_exactly(n_envs, tmp_path):
    make, options = KINDS["sdnn"]
    envs = [FailsOnce] * (n_envs - 1) + [functools.partial(FailsOnce, ("step", 33))]

    def finished(stop):
        env = gym.vector.SyncVectorEnv(envs) if n_envs > 1 else envs[0]()
        agent = make(FailsOnce.observation_space, FailsOnce.action_space, seed=3, **options)
        training = Training(agent, env, steps=200, callbacks=[Stop(stop, tmp_path / "t")])
        with pytest.raises(TimeoutError):
            training.run()
        if training.run().is_finished:
            return training
        fresh = gym.vector.SyncVectorEnv([FailsOnce] * n_envs) if n_envs > 1 else FailsOnce()
        loaded = Training.load(tmp_path / "t", fresh)
        assert loaded.run().is_finished
        return loaded

    whole, cut = finished(1000), finished(150)
    assert states_equal(whole.agent, cut.agent)
    assert whole.next_episode == cut.next_episode


def test_a_failed_evaluation_is_repeated_first_on_resuming(tmp_path):
    path, rows = tmp_path / "checkpoint", tmp_path / "rows.jsonl"
    every = {"steps": 100, "evaluate_every": 25, "evaluation_episodes": 2}
    make, options = KINDS["sdnn"]

    def training(evaluation_env, name):
        agent = make(FailsOnce.observation_space, FailsOnce.action_space, seed=3, **options)
        callbacks = [JSONLines(tmp_path / name), CheckpointCallback(path, every=1000)]
        evaluations = {"evaluation_env": evaluation_env, **every}
        return Training(agent, FailsOnce(), callbacks=callbacks, **evaluations)

    whole = training(FailsOnce(), "whole")
    whole.run()
    cut = training(FailsOnce(("reset", 3)), "rows.jsonl")  # the second evaluation's first
    with pytest.raises(TimeoutError):
        cut.run()
    assert (cut.n_steps, cut.is_within_step, len(cut.evaluations)) == (50, False, 1)
    again = FailsOnce(("reset", 1))
    loaded = Training.load(path, FailsOnce(), evaluation_env=again, callbacks=[JSONLines(rows)])
    with pytest.raises(TimeoutError):
        loaded.run()
    assert loaded.n_steps == 50
    for one in (loaded, cut):
        one.run()
        assert one.evaluations == whole.evaluations
        assert states_equal(one.agent, whole.agent)

    def told(place):
        lines = [json.loads(line) for line in place.read_text().splitlines()]
        return [{k: v for k, v in line.items() if k != "seconds"} for line in lines]

    assert told(rows) == told(tmp_path / "whole")


def test_evaluation_refuses_vector_environments():
    several = gym.vector.SyncVectorEnv([Corridor] * 2)
    refuses("env", evaluate, corridor_agent(), several, error=TypeError)
    refuses(
        "evaluation_env",
        corridor_agent().train,
        Corridor(),
        steps=9,
        evaluate_every=3,
        evaluation_env=several,
        error=TypeError,
    )


def test_a_second_training_meets_other_episodes(tmp_path):
    env, agent = Corridor(), corridor_agent()
    agent.train(env, episodes=3)
    agent.save(tmp_path / "agent")
    for one in (agent, load_agent(tmp_path / "agent"), copy.deepcopy(agent)):
        one.train(env, steps=20)
    n = (len(env.seeds) - 3) // 3
    first = env.seeds[3 : 3 + n]
    assert env.seeds[3:] == 3 * first
    assert len({*env.seeds[:3], *first}) == 3 + n
    one_go = Corridor()
    corridor_agent().train(one_go, episodes=5)
    assert one_go.seeds == env.seeds[:5]
    again = Corridor()
    for _ in range(2):
        agent.train(again, episodes=2, seed=4)
    assert again.seeds[:2] == again.seeds[2:], "as it was asked for"


def test_it_learns_the_corridor():
    agent = corridor_agent()
    result = agent.train(Corridor(), episodes=300)
    assert result.is_finished
    assert (result.n_episodes, len(result.returns)) == (300, 300)
    found = evaluate(agent, Corridor(), 20, seed=3)
    assert found.terminated.all()
    assert set(found.lengths) <= {3, 4}, "from cell 0 or 1 straight to cell 4"
    assert found.mean_return == found.returns.mean() > 0.6


def test_every_episode_has_another_seed():
    env, other = Corridor(), Corridor()
    corridor_agent().train(env, episodes=30, seed=4)
    corridor_agent().train(other, episodes=30, seed=4)
    assert env.seeds == other.seeds
    assert len(set(env.seeds)) == 30
    third = Corridor()
    evaluate(corridor_agent(), third, 30, seed=4)
    assert not set(third.seeds) & set(env.seeds)


def test_evaluations_change_nothing_that_is_learned(tmp_path):
    plain = Training(corridor_agent(), Corridor(), steps=300)
    tested = Training(
        corridor_agent(), Corridor(), steps=300, evaluate_every=50, evaluation_env=Corridor()
    )
    plain.run()
    result = tested.run()
    one, other = plain.agent.state(), tested.agent.state()
    differ = {name for name in one if not np.array_equal(one[name], other[name])}
    assert differ <= {"agent.policy.evaluation_ties.words"}
    assert result.evaluations[:, 0].tolist() == [50, 100, 150, 200, 250, 300]
    rows = [row for row in result.rows if row["kind"] == "evaluation"]
    assert all(row["mean_return"] == np.mean(row["returns"]) for row in rows)


@pytest.mark.parametrize("kind", KINDS)
def test_a_training_stopped_inside_an_episode_resumes_exactly(kind, tmp_path):
    make, options = KINDS[kind]

    def env():
        return gym.make("Pendulum-v1", max_episode_steps=40)

    def begun(*callbacks):
        agent = make(env(), seed=3, **options)
        return Training(agent, env(), steps=300, seed=9, callbacks=callbacks)

    cuts = np.random.default_rng(5).integers(1, 300, 12)
    check_exact_resume(begun, env, tmp_path / "t", cuts)


def test_an_unbounded_environment_is_warmed_up_and_learned(tmp_path):
    env = gym.make("CartPole-v1")

    def begun(*callbacks):
        agent = SDNNQLearning(env, approximator=SMALL, warm_up_steps=200)
        return Training(agent, env, steps=500, callbacks=callbacks)

    young = begun().agent
    assert young.is_warming_up
    refuses("observation_range", young.q_values, env.reset()[0], error=RuntimeError)
    cuts = (1, 150, 199, 200, 201, 350)
    whole = check_exact_resume(begun, lambda: env, tmp_path / "t", cuts)
    assert not whole.agent.is_warming_up
    assert whole.agent.learning_report()["n_corrections"] > 480


@pytest.mark.parametrize("missing", ["hold", "code"])
def test_a_training_resumes_exactly_from_missing_observations(missing, tmp_path):
    class Echo(Corridor):
        """Nothing comes back from ahead where the corridor continues, as of a sonar."""

        observation_space = gym.spaces.Box(0.0, np.inf, (1,), dtype=np.float64)

        def _seen(self):
            return np.array([np.inf if self._at == 1 else self._at])

    def begun(*callbacks):
        agent = SDNNQLearning(Echo(), approximator=SMALL, observation_range=(0, 4), missing=missing)
        return Training(agent, Echo(), steps=60, callbacks=callbacks)

    check_exact_resume(begun, Echo, tmp_path / "t", range(1, 10))


def test_an_environment_that_does_not_repeat_itself_is_refused(tmp_path):
    env = Corridor(is_random=True)
    Training(corridor_agent(), env, steps=500, callbacks=[Stop(20, tmp_path / "t")]).run()
    refuses("env", Training.load, tmp_path / "t", env, error=UnrepeatedEpisodeError)


def test_a_training_that_repeats_no_episode_abandons_the_unfinished_one(tmp_path):
    env = Corridor(is_random=True)
    first = corridor_agent()
    path = tmp_path / "rows.jsonl"
    callbacks = [JSONLines(path), Stop(20, tmp_path / "t")]
    Training(first, env, steps=200, callbacks=callbacks).run()
    new = Corridor(is_random=True)
    training = Training.load(
        tmp_path / "t", new, callbacks=[JSONLines(path)], repeat_episodes=False
    )
    assert new.seeds == [], "nothing happens in the environment before it resumes"
    assert states_equal(training.agent, first)
    assert training.n_steps == 20
    assert training.run().n_steps == 200
    assert not set(new.seeds) & set(env.seeds), "the episode that was left is not begun again"
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    assert [row["episode"] for row in rows] == list(range(training.n_episodes))
    assert [row["step"] for row in rows] == sorted(row["step"] for row in rows)
    unfinished = 20 - sum(row["length"] for row in rows if row["step"] <= 20)
    assert unfinished > 0
    learned = sum(row["length"] for row in rows)
    assert rows[-1]["step"] == learned + unfinished, "the steps of what was left count"


def test_between_episodes_nothing_is_repeated_anyway(tmp_path):
    class StopBetween(Callback):
        def on_row(self, training, row):
            if row["episode"] == 5:
                training.stop()

    training = Training(corridor_agent(), Corridor(), steps=200, callbacks=[StopBetween()])
    training.run()
    training.save(tmp_path / "t")
    one, other = (
        Training.load(tmp_path / "t", Corridor(), repeat_episodes=does) for does in (True, False)
    )
    assert one.run().n_steps == other.run().n_steps == 200
    assert states_equal(one.agent, other.agent)


def test_pending_steps_are_learned_when_a_new_episode_begins(tmp_path):
    env = Corridor()
    learning = QLearningConfig(n_steps=3)
    Training(
        corridor_agent(learning=learning), env, steps=200, callbacks=[Stop(20, tmp_path / "t")]
    ).run()
    with_training = Training.load(tmp_path / "t", Corridor(), steps=21, repeat_episodes=False)
    with_training.run()
    by_hand, at = load_agent(tmp_path / "t"), Corridor()
    observation, _ = at.reset(seed=env.seeds[-1])
    by_hand.begin_episode()
    action = by_hand.act(observation)
    next_observation, reward, terminated, _, _ = at.step(action)
    by_hand.learn(Transition(observation, action, reward, next_observation, terminated))
    by_hand.progress = 1.0
    assert states_equal(with_training.agent, by_hand)


def test_an_episode_without_an_end_takes_little_memory(tmp_path):
    class Endless(Corridor):
        def step(self, action):
            self._at = int(np.clip(self._at + (1 if action else -1), 0, 4))
            return self._seen(), float(self._at == 2), False, False, {}

    class Watch(Callback):
        def __init__(self):
            self.bytes = {}

        def on_step(self, training):
            if training.n_steps in (2_000, 20_000):
                self.bytes[training.n_steps] = tracemalloc.get_traced_memory()[0]

    watch = Watch()
    training = Training(corridor_agent(), Endless(), steps=20_500, callbacks=[watch])
    tracemalloc.start()
    try:
        training.run()
    finally:
        tracemalloc.stop()
    assert (watch.bytes[20_000] - watch.bytes[2_000]) / 18_000 < 32
    training.save(tmp_path / "t")
    again = Training.load(tmp_path / "t", Endless(), steps=20_600)
    training.steps = 20_600
    assert training.run().n_steps == again.run().n_steps == 20_600
    assert states_equal(training.agent, again.agent)


def test_evaluations_may_follow_episodes(tmp_path):
    def begun(*callbacks):
        return Training(
            corridor_agent(), Corridor(), episodes=30, evaluate_every_episodes=5,
            evaluation_env=Corridor(), evaluation_episodes=2, callbacks=callbacks,
        )  # fmt: skip

    rows = begun().run().rows
    evaluations = [row for row in rows if row["kind"] == "evaluation"]
    assert [row["episode"] for row in evaluations] == [5, 10, 15, 20, 25, 30]
    assert all(len(row["lengths"]) == len(row["terminated"]) == 2 for row in evaluations)
    ends = {row["step"] for row in rows if row["kind"] == "episode"}
    assert {row["step"] for row in evaluations} <= ends
    cuts = (3, 20, 47, evaluations[2]["step"])
    check_exact_resume(begun, Corridor, tmp_path / "t", cuts, evaluation_env=Corridor())


def test_without_a_seed_the_streams_of_environments_run_on(tmp_path):
    env, tested = Corridor(), Corridor()
    training = Training(
        corridor_agent(), env, episodes=6, seed=None, evaluate_every_episodes=2,
        evaluation_env=tested, callbacks=[Stop(7, tmp_path / "t")],
    )  # fmt: skip
    training.run()
    training.run()
    assert (env.seeds, tested.seeds) == ([None] * 6, [None] * 30)
    refuses("repeat_episodes", Training.load, tmp_path / "t", Corridor(), evaluation_env=Corridor())
    other = Training.load(
        tmp_path / "t", Corridor(), evaluation_env=Corridor(), repeat_episodes=False
    )
    assert other.run().n_episodes == 6


def test_options_of_resets_follow_the_episodes():
    class Told(Corridor):
        def __init__(self):
            super().__init__()
            self.told = []

        def reset(self, *, seed=None, options=None):
            self.told.append(options["number"])
            return super().reset(seed=seed)

    env, tested = Told(), Told()
    training = Training(
        corridor_agent(), env, episodes=4, evaluate_every_episodes=2, evaluation_env=tested,
        evaluation_episodes=1, reset_options=lambda episode: {"number": episode},
    )  # fmt: skip
    training.run()
    assert (env.told, tested.told) == ([1, 2, 3, 4], [2, 4])
    refuses(
        "reset_options",
        Training,
        corridor_agent(),
        gym.vector.SyncVectorEnv([Corridor] * 2),
        steps=9,
        reset_options=dict,
    )


def test_a_time_limit_may_count_as_an_end():
    class Note:
        def __init__(self):
            self.ends = []

        def begin_episode(self):
            pass

        def act(self, observation, explore=True):
            return 0

        def learn(self, transition):
            self.ends.append(transition.terminated)

    agents = Note(), Note()
    for agent, bootstraps in zip(agents, (True, False), strict=True):
        Training(agent, Corridor(), episodes=1, limit_bootstraps=bootstraps).run()
    assert agents[0].ends == [False] * 8
    assert agents[1].ends == [False] * 7 + [True]


def test_a_training_in_pieces_is_the_same_and_may_be_left_between_two():
    whole, pieces = (Training(corridor_agent(), Corridor(), steps=60) for _ in range(2))
    whole.run()
    assert sum(1 for _ in pieces.pieces(0.0)) == 60
    assert states_equal(whole.agent, pieces.agent)
    ended = []

    class Note(Callback):
        def on_end(self, training):
            ended.append(training.n_steps)

    left = Training(corridor_agent(), Corridor(), steps=60, callbacks=[Note()])
    generator = left.pieces(0.0)
    next(generator)
    generator.close()
    assert (ended, left.n_steps) == ([1], 1)
    assert left.run().n_steps == 60


def test_early_stopping_needs_several_evaluations_in_a_row():
    stop = StopTrainingOnRewardThreshold(mean_return=0.6, patience=2)
    result = corridor_agent().train(
        Corridor(), steps=20_000, callbacks=[stop], evaluate_every=200, evaluation_env=Corridor()
    )
    assert not result.is_finished
    assert (result.evaluations[-2:, 1] >= 0.6).all()


@pytest.mark.parametrize("cut", [15, 20, 25, 29])
def test_an_early_stop_counts_the_evaluations_before_a_training_was_loaded(tmp_path, cut):
    def training(goal, agent):
        stop = StopTrainingOnRewardThreshold(mean_return=-1e9, patience=3)
        return Training(
            agent, Corridor(), steps=goal, callbacks=[stop],
            evaluate_every=10, evaluation_env=Corridor(),
        )  # fmt: skip

    whole = training(100, corridor_agent())
    whole.run()
    assert whole.n_steps == 30
    first = training(100, corridor_agent())
    first.callbacks += (Stop(cut, tmp_path / "c"),)
    first.run()
    again = Training.load(
        tmp_path / "c",
        Corridor(),
        callbacks=[StopTrainingOnRewardThreshold(mean_return=-1e9, patience=3)],
        evaluation_env=Corridor(),
    )
    assert again.evaluations == first.evaluations
    result = again.run()
    assert again.n_steps == 30
    assert again.evaluations == whole.evaluations
    assert len(result.evaluations) == 3 - cut // 10


def test_a_result_has_the_rows_of_all_that_was_run():
    training = Training(corridor_agent(), Corridor(), steps=300)
    training.callbacks = (Stop(100),)
    training.run()
    training.callbacks = ()
    result = training.run()
    assert len(result.returns) == result.n_episodes > 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "episodes"),
        ({"steps": 10, "episodes": 1}, "episodes"),
        ({"steps": 10, "evaluate_every": 5}, "evaluation_env"),
        ({"steps": 10, "evaluate_every_episodes": 5}, "evaluation_env"),
        ({"steps": 10, "evaluate_every": 5, "evaluate_every_episodes": 5}, "evaluate_every"),
    ],
)
def test_impossible_trainings_are_named(options, message):
    refuses(message, Training, corridor_agent(), Corridor(), **options)
