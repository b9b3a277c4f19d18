"""Measures of a trial: when the task was learned, the final performance, and its collapse.

Evaluations come every 10 episodes; one of 50 steps has not solved the task. The task is learned
where the median of 10 evaluations in a row is at most 10 steps, and mastered where that of 50 is.
"""

import math

import numpy as np
import pytest

from sdnn.runs import TrialRows
from sdnn.runs.results import MEASURES, episode_of_collapse, episodes_to_learn, final_share_solved


def episodes(steps):
    """Return the episodes of the evaluations, 10, 20, ..., that took these numbers of steps."""
    return 10 * np.arange(1, len(steps) + 1)


def measure(name, steps, returns=None):
    """Return a measure of a trial whose evaluations took these numbers of steps."""
    steps = np.asarray(steps)
    returns = np.zeros(steps.size) if returns is None else np.asarray(returns)
    rows = TrialRows.of_tests(episodes(steps), steps, returns, steps < 50)
    return MEASURES[name][1](rows)


@pytest.mark.parametrize(
    ("steps", "episode"),
    [
        pytest.param([10] * 10, 10.0, id="at the first test"),
        pytest.param([50] * 100, math.inf, id="never"),
        pytest.param([11] * 100, math.inf, id="never well enough"),
        # Windows that begin at failed tests do not count although their medians are good.
        pytest.param([50] * 4 + [7] * 20, 50.0, id="after failed tests"),
        # The median of 5 good and 5 failed tests is (7 + 50) / 2 = 28.5, that of 6 and 4 is 7.
        pytest.param([7] * 5 + [50] * 5, math.inf, id="half of a window"),
        pytest.param([7] * 6 + [50] * 4, 10.0, id="more than half of a window"),
        pytest.param([7] + [50] * 4 + [7] * 5, 10.0, id="more than half in any order"),
        pytest.param([50, 3] + [50] * 8 + [6] * 10 + [50] * 80, 110.0, id="luck and a relapse"),
        pytest.param([50] * 5 + [5] * 9, math.inf, id="a window that the end cuts off"),
        pytest.param([5] * 9, math.inf, id="fewer tests than a window"),
    ],
)
def test_episodes_to_learn_end_at_the_first_good_window_that_begins_solved(steps, episode):
    assert episodes_to_learn(episodes(steps), steps) == episode


def test_final_measures_use_the_last_50_evaluations():
    steps = [3] * 100 + [50] * 24 + [4] * 26  # 26 of the last 50 solve the task, 52 %
    assert measure("final_steps", steps) == 4.0
    assert final_share_solved([s < 50 for s in steps]) == 0.52
    assert measure("final_steps", [8, 9]) == 8.5


@pytest.mark.parametrize(
    ("steps", "episode"),
    [
        # A run of 50 with 26 good tests has a median of 7, one with 25 a median of 28.5: the last
        # mastered run begins at test 35 and ends with test 84.
        pytest.param([7] * 60 + [50] * 100, 840.0, id="the end of the last mastered run"),
        pytest.param([50] * 100 + [7] * 50, math.inf, id="none after late mastery"),
        pytest.param([7] * 50, math.inf, id="none within the trial"),
        pytest.param([7] * 60 + [50] * 100 + [7] * 60, math.inf, id="a relapse is no collapse"),
        # The first case again after 160 tests, which are 1,600 episodes.
        pytest.param([7] * 60 + [50] * 100 + [7] * 60 + [50] * 100, 2440.0, id="after a relapse"),
        pytest.param([50] * 200, 0.0, id="never mastered"),
        pytest.param([7, 50] * 100, 0.0, id="never mastered for a run"),
    ],
)
def test_the_episode_of_collapse_ends_the_last_mastered_run(steps, episode):
    assert episode_of_collapse(episodes(steps), steps) == episode


def test_fewer_than_50_evaluations_have_no_episode_of_collapse():
    assert math.isnan(episode_of_collapse(episodes([7] * 49), [7] * 49))


def test_early_steps_are_the_median_of_the_tests_in_the_first_2500_episodes():
    steps = [4] * 150 + [8] * 100 + [50] * 750  # 250 evaluations in 2,500 episodes
    assert measure("early_steps", steps) == 4.0
    assert measure("early_steps", [50] * 251) == 50.0


@pytest.mark.parametrize("n_tests", [1, 9, 10, 49, 50, 137])
def test_measures_are_within_bounds_for_trials_of_any_length(n_tests):
    steps = np.random.default_rng(n_tests).integers(1, 51, n_tests)
    assert episodes_to_learn(episodes(steps), steps) > 0
    assert 1 <= measure("final_steps", steps) <= 50
    assert 0 <= final_share_solved(steps < 50) <= 1


def test_mean_and_final_returns_average_all_or_the_last_tenth():
    def mean_and_final(returns):
        steps = np.full(len(returns), 50)
        return [measure(name, steps, returns) for name in ("mean_return", "final_return")]

    returns = np.arange(40.0)
    assert mean_and_final(returns) == [19.5, 37.5]  # the means of 0 to 39 and of 36 to 39
    assert mean_and_final(returns[:19])[1] == 18.0  # a tenth of 19 is the last one
    assert mean_and_final([-3.0]) == [-3.0, -3.0]
