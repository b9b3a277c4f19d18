"""Batched acrobots: the bits of single environments."""

import copy

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from refusals import refuses
from sdnn import _core
from sdnn.environments import AcrobotConfig, AcrobotSwingUpVectorEnv, GoalSchedule

ID = "sdnn/AcrobotSwingUp-v0"
LOW_GOAL = AcrobotConfig(goal_height=0.5, max_decisions=12)
INSTRUCTION_SETS = _core.available_instruction_sets()


@pytest.fixture(params=INSTRUCTION_SETS)
def instruction_set(request):
    before = _core.instruction_set()
    _core.set_instruction_set(request.param)
    yield request.param
    _core.set_instruction_set(before)


def assert_equal_bits(got, expected):
    """Check that nested tuples and dicts of arrays have equal types, shapes and bits."""
    assert type(got) is type(expected)
    if isinstance(expected, dict):
        assert got.keys() == expected.keys()
        for key, value in expected.items():
            assert_equal_bits(got[key], value)
    elif isinstance(expected, tuple):
        assert len(got) == len(expected)
        for item, expected_item in zip(got, expected, strict=True):
            assert_equal_bits(item, expected_item)
    else:
        assert got.dtype == expected.dtype
        assert got.shape == expected.shape
        assert got.tobytes() == expected.tobytes()


def batched_and_sync(num_envs, **kwargs):
    """Return a batched environment, and a `SyncVectorEnv` of single ones."""
    return [
        gym.make_vec(ID, num_envs=num_envs, vectorization_mode=mode, **kwargs)
        for mode in ("vector_entry_point", "sync")
    ]


def test_make_vec_returns_the_batched_environment_with_the_spaces_of_a_sync_vector():
    envs = gym.make_vec(f"sdnn:{ID}", num_envs=5)
    assert isinstance(envs, AcrobotSwingUpVectorEnv)
    assert envs.num_envs == 5
    assert envs.metadata["autoreset_mode"] == gym.vector.AutoresetMode.NEXT_STEP
    assert envs.spec.id == ID
    sync = gym.make_vec(ID, num_envs=5, vectorization_mode="sync")
    for name in ("action_space", "observation_space"):
        assert getattr(envs, name) == getattr(sync, name)
        assert getattr(envs, f"single_{name}") == getattr(sync, f"single_{name}")


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("num_envs", [1, 3, 8, 13])
def test_a_batch_has_the_bits_of_single_environments(instruction_set, num_envs, dtype):
    envs, sync = batched_and_sync(num_envs, config=LOW_GOAL, dtype=dtype)
    random = np.random.default_rng(num_envs)
    assert_equal_bits(envs.reset(seed=3), sync.reset(seed=3))
    n_terminated = n_truncated = 0
    for _ in range(150):
        actions = random.uniform(-1.0, 1.0, (num_envs, 1)).astype(dtype)
        got, expected = envs.step(actions), sync.step(actions)
        assert_equal_bits(got, expected)
        n_terminated += got[2].sum()
        n_truncated += got[3].sum()
    assert n_terminated >= num_envs
    assert n_truncated >= num_envs


def test_resets_of_a_batch_equal_those_of_a_sync_vector():
    envs, sync = batched_and_sync(4, config=LOW_GOAL)
    random = np.random.default_rng(2)
    mask = np.array([True, False, True, False])
    resets = [
        {},
        {"seed": 7},
        {"seed": [None, 1, None, 2]},
        {"options": {"goal_tolerance": 0.5}},
        {"options": {"reset_mask": mask}},
        {"options": {"reset_mask": ~mask, "goal_tolerance": 0.7}},
        {"seed": [1, None, None, None], "options": {"reset_mask": mask}},
        {"seed": 3, "options": {"goal_tolerance": 0.25}},
    ]
    for _ in range(3):
        for arguments in resets:
            # `SyncVectorEnv` removes the mask from its options.
            expected = sync.reset(**copy.deepcopy(arguments))
            assert_equal_bits(envs.reset(**arguments), expected)
            assert envs.goal_tolerance.tolist() == list(sync.get_attr("goal_tolerance"))
            for _ in range(random.integers(15)):
                actions = random.uniform(-1.0, 1.0, (4, 1)).astype(np.float32)
                assert_equal_bits(envs.step(actions), sync.step(actions))
    assert "reset_mask" in resets[4]["options"], "a batch does not change its options"


def tolerances_of_next_episodes(envs):
    """Step to the end of episodes of two decisions, and into the next episodes."""
    no_torque = np.zeros((envs.num_envs, 1))
    assert envs.step(no_torque)[3].tolist() == [False] * envs.num_envs
    assert envs.step(no_torque)[3].tolist() == [True] * envs.num_envs
    *_, truncated, infos = envs.step(no_torque * np.nan)  # actions are ignored: episodes begin
    assert truncated.tolist() == [False] * envs.num_envs
    assert infos["state"].tolist() == np.zeros((envs.num_envs, 4)).tolist()
    return infos["goal_tolerance"].tolist()


def test_a_goal_tolerance_holds_from_the_next_episode_of_each_environment():
    envs = AcrobotSwingUpVectorEnv(2, config=AcrobotConfig(max_decisions=2))
    envs.reset()
    envs.goal_tolerance = GoalSchedule()(300)
    assert tolerances_of_next_episodes(envs) == [0.25, 0.25]  # 1 / (1 + 300 / 100), by the schedule
    envs.goal_tolerance = [0.1, 0.2]
    assert envs.step([[0.0], [0.0]])[4]["goal_tolerance"].tolist() == [0.25, 0.25]
    envs.goal_tolerance[0] = 7.0  # changes a copy
    assert envs.reset()[1]["goal_tolerance"].tolist() == [0.1, 0.2]


def test_modifying_returned_arrays_does_not_change_the_environment():
    envs = AcrobotSwingUpVectorEnv(2)
    observations, infos = envs.reset()
    expected = copy.deepcopy((observations, infos))
    for array in (observations, *infos.values()):
        array[:] = 1
    observations, infos = envs.reset(seed=0)
    np.testing.assert_array_equal(observations, expected[0])
    for name in ("state", "goal_tolerance"):
        np.testing.assert_array_equal(infos[name], expected[1][name])


def test_bad_actions_are_refused_by_index_and_change_nothing():
    envs = AcrobotSwingUpVectorEnv(3)
    with pytest.raises(gym.error.ResetNeeded):
        envs.step(np.zeros((3, 1)))
    envs.reset(options={"reset_mask": np.array([True, True, False])})
    with pytest.raises(gym.error.ResetNeeded):
        envs.step(np.zeros((3, 1)))
    envs.reset()
    for action in (np.nan, np.inf, -np.inf, 1.01, -1.01):
        refuses("actions[1]", envs.step, [[1.0], [action], [1.0]])
    for shape in ((2, 1), (3, 2), (1, 3), ()):
        refuses("actions", envs.step, np.zeros(shape))
    observations = envs.step(np.zeros(3))[0]  # hang at rest, in the middle of all ranges
    np.testing.assert_array_equal(observations, np.full((3, 4), 0.5))


def test_bad_seeds_tolerances_and_masks_are_refused_by_name():
    envs = AcrobotSwingUpVectorEnv(2)
    refuses("seed", envs.reset, seed=[1, 2, 3])
    for tolerance in (-0.1, [1.0, np.nan], [1.0] * 3):
        refuses("goal_tolerance", envs.reset, options={"goal_tolerance": tolerance})
        refuses("goal_tolerance", AcrobotSwingUpVectorEnv, 2, goal_tolerance=tolerance)
        refuses("goal_tolerance", setattr, envs, "goal_tolerance", tolerance)
    refuses("'episode'", envs.reset, options={"episode": 3})
    for mask in (np.zeros(2, bool), np.ones(3, bool), np.ones(2), "yes"):
        refuses("reset_mask", envs.reset, options={"reset_mask": mask})
    assert envs.goal_tolerance.tolist() == [1.0, 1.0]
    with pytest.raises(gym.error.ResetNeeded):
        envs.step(np.zeros((2, 1)))


def test_gymnasiums_vector_wrappers_record_whole_episodes():
    envs = RecordEpisodeStatistics(gym.make_vec(ID, num_envs=2, config=LOW_GOAL))
    envs.reset()
    lengths = []
    for _ in range(30):  # twice 12 decisions and the step that resets, and four more
        *_, infos = envs.step(np.zeros((2, 1), np.float32))
        if "episode" in infos:
            lengths += infos["episode"]["l"].tolist()
    assert lengths == [12] * 4, "two episodes of 12 decisions in each of two environments"


def test_a_batch_renders_every_environment_or_warns_without_a_mode(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    envs, sync = batched_and_sync(2, render_mode="rgb_array")
    actions = np.array([[1.0], [-0.5]], np.float32)
    for vector in (envs, sync):
        vector.reset(seed=1)
        vector.step(actions)
    assert_equal_bits(envs.render(), sync.render())
    envs.close()
    sync.close()
    without_mode = AcrobotSwingUpVectorEnv(1)
    without_mode.reset()
    with pytest.warns(UserWarning, match="render_mode"):
        assert without_mode.render() is None
    without_mode.close()
