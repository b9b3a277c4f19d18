"""Dead ends: states in which no action is allowed, at which a limit truncates an episode."""

import json

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import (
    SDNNActorCritic,
    SDNNQLambda,
    SDNNQLearning,
    Training,
    Transition,
    UnusableStepError,
    evaluate,
    imitate,
    learn_from,
)
from sdnn.approximators import LinearSDNNConfig, SDNNCConfig
from stopped_training import check_exact_resume, states_equal

SMALL = SDNNCConfig(n_hidden_units=60, n_active_units=20, n_pattern_units=20)
SPACES = {"discrete": gym.spaces.Discrete(3), "several": gym.spaces.MultiDiscrete([3, 2])}
ALL = {"discrete": [1, 1, 1], "several": ([1, 1, 1], [1, 1])}
NONE = {"discrete": [0, 0, 0], "several": ([1, 0, 1], [0, 0])}
"""Masks that allow no action: of several dimensions, all of one are forbidden."""


class DeadEnds(gym.Env):
    """Episodes of three steps with random states; no action is allowed in the last state.

    The environment reports the end by the flag ``end``: it "terminates" or "truncates", or it does
    neither ("continues").
    """

    def __init__(self, end, actions="discrete"):
        self.observation_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)
        self.action_space = SPACES[actions]
        self.metadata = {"action_masks": True}
        self.end, self.actions = end, actions

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.n_steps = 0
        return self.np_random.uniform(-1, 1, 2), {"action_mask": ALL[self.actions]}

    def step(self, action):
        self.n_steps += 1
        is_last = self.n_steps == 3
        observation = self.np_random.uniform(-1, 1, 2)
        masks = NONE if is_last else ALL
        terminated, truncated = is_last and self.end == "terminates", self.end == "truncates"
        info = {"action_mask": masks[self.actions]}
        return observation, 1.0, terminated, is_last and truncated, info


class Overriding(SDNNQLambda):
    """An agent whose `act` and `learn` replace those that the training loop calls in C++."""

    def act(self, *arguments, **options):
        return super().act(*arguments, **options)

    def learn(self, transition, environment=0):
        super().learn(transition, environment)


def new_agent(agent_class, actions="discrete"):
    """Return an agent without a warm-up."""
    approximator = SMALL if agent_class is SDNNQLearning else LinearSDNNConfig()
    options = {"inputs": "all", "angle_pairs": "none", "observation_range": (-1.0, 1.0)}
    return agent_class(DeadEnds("terminates", actions), approximator=approximator, **options)


@pytest.mark.parametrize("actions", SPACES)
@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNActorCritic, SDNNQLearning, Overriding])
def test_a_step_truncated_in_a_dead_end_is_learned_as_terminated(agent_class, actions):
    def trained(end):
        agent = new_agent(agent_class, actions)
        result = agent.train(DeadEnds(end, actions), steps=60, seed=1)
        return agent, [row["terminated"] for row in result.rows]

    (truncated, truncated_ends), (terminated, terminated_ends) = map(
        trained, ("truncates", "terminates")
    )
    assert states_equal(truncated, terminated)
    # The rows keep the flags of the environment.
    assert truncated_ends == [False] * 20
    assert terminated_ends == [True] * 20


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP", "DISABLED"])
@pytest.mark.parametrize("vector_class", [gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv])
@pytest.mark.parametrize("agent_class", [SDNNQLambda, Overriding])
def test_dead_ends_of_vectors_are_learned_as_terminated(agent_class, vector_class, mode):
    def trained(end):
        envs = vector_class(
            [lambda: DeadEnds(end, "several")] * 2, autoreset_mode=gym.vector.AutoresetMode[mode]
        )
        agent = new_agent(agent_class, "several")
        agent.train(envs, steps=60, seed=1)
        envs.close()
        return agent

    assert states_equal(trained("truncates"), trained("terminates"))


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP"])
def test_dead_ends_of_vectors_that_reset_themselves_are_learned_as_terminated(mode, monkeypatch):
    # Without this, the training would reset each environment of a SyncVectorEnv itself.
    monkeypatch.setattr("sdnn.training.vectors._resets_each", lambda env: False)

    class OtherVectorEnv(gym.vector.SyncVectorEnv):
        """A vector of an unknown class, whose environments are not stepped one by one."""

    def trained(end):
        envs = OtherVectorEnv(
            [lambda: DeadEnds(end)] * 2, autoreset_mode=gym.vector.AutoresetMode[mode]
        )
        agent = new_agent(SDNNQLambda)
        agent.train(envs, steps=60, seed=1)
        return agent

    assert states_equal(trained("truncates"), trained("terminates"))


@pytest.mark.parametrize("n_environments", [1, 2])
def test_a_training_with_dead_ends_resumes_exactly(n_environments, tmp_path):
    def new_env():
        makers = [lambda: DeadEnds("truncates")] * n_environments
        return gym.vector.SyncVectorEnv(makers) if n_environments > 1 else makers[0]()

    def new_training(*callbacks):
        return Training(new_agent(SDNNQLambda), new_env(), steps=30, callbacks=callbacks)

    # Episodes have 3 steps, so that all places in an episode and a round of two are stopped at.
    check_exact_resume(new_training, new_env, tmp_path / "training", range(4, 11))


def test_an_agent_that_overrides_learn_receives_a_terminated_transition_without_a_mask():
    transitions = []

    class Recording(SDNNQLambda):
        def learn(self, transition, environment=0):
            transitions.append(transition)
            super().learn(transition, environment)

    new_agent(Recording).train(DeadEnds("truncates"), steps=3)
    assert [transition.terminated for transition in transitions] == [False, False, True]
    assert [transition.next_mask for transition in transitions] == [[1, 1, 1], [1, 1, 1], None]


def test_learners_in_python_may_have_masks_of_another_form():
    masks = []

    class Learner:
        def begin_episode(self):
            pass

        def act(self, observation, explore=True, mask=None):
            masks.append(mask)
            return 0

        def learn(self, transition):
            masks.append(transition.next_mask)

    class NamedActions(DeadEnds):
        def reset(self, **options):
            return super().reset(**options)[0], {"action_mask": "all"}

        def step(self, action):
            return *super().step(action)[:-1], {
                "action_mask": "none" if self.n_steps == 3 else "all"
            }

    Training(Learner(), NamedActions("truncates"), episodes=1).run()
    assert masks == ["all"] * 5 + ["none"]  # in turns for act and learn


def test_evaluations_end_in_a_dead_end():
    evaluation = evaluate(new_agent(SDNNQLambda), DeadEnds("truncates"), episodes=2)
    assert evaluation.lengths.tolist() == [3, 3]


@pytest.mark.parametrize("agent_class", [SDNNQLambda, Overriding])
def test_a_dead_end_in_which_an_episode_continues_is_an_unusable_step(agent_class):
    for env in (DeadEnds("continues"), gym.vector.SyncVectorEnv([lambda: DeadEnds("continues")])):
        with pytest.raises(UnusableStepError, match=r"step 3 of episode 0.*mask must be of 0"):
            new_agent(agent_class).train(env, steps=10)


def logs_of(end, folder):
    """Return the log of two steps in all forms that have masks; ``end`` names the last flag."""
    steps = [
        {"observation": [0.1, 0.2], "action": 1, "reward": 1.0, "next_observation": [0.3, 0.4]},
        {"observation": [0.3, 0.4], "action": 2, "reward": 2.0, "next_observation": [0.5, 0.6]},
    ]
    steps[0]["next_mask"], steps[1]["next_mask"] = ALL["discrete"], NONE["discrete"]
    steps[1][end] = True
    path = folder / f"{end}.jsonl"
    path.write_text("".join(json.dumps(step) + "\n" for step in steps))
    columns = {f"{name}s": [step[name] for step in steps] for name in steps[0]}
    return {"mappings": steps, "lines": path, "arrays": {**columns, end: [False, True]}}


@pytest.mark.parametrize("form", ["mappings", "lines", "arrays"])
@pytest.mark.parametrize("learn_log", [learn_from, imitate])
def test_logged_dead_ends_are_learned_as_terminated(learn_log, form, tmp_path):
    agents = [new_agent(SDNNQLambda) for _ in range(2)]
    for agent, end in zip(agents, ("truncated", "terminated"), strict=True):
        assert learn_log(agent, logs_of(end, tmp_path)[form], epochs=2) == 4
    assert states_equal(*agents)


def test_an_unusable_mask_of_a_truncated_step_of_a_log_is_refused():
    transition = Transition([0.1, 0.2], 1, 1.0, [0.3, 0.4], False, [0, 0])._asdict()
    with pytest.raises(ValueError, match="dataset, episode 0, transition 0: next_mask must have 3"):
        learn_from(new_agent(SDNNQLambda), [transition | {"truncated": True}])
