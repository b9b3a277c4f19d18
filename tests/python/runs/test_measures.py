import math

import numpy as np
import pytest

from sdnn.runs import TrialRows
from sdnn.runs.results import MEASURES, episode_of_collapse, episodes_to_learn, final_share_solved


def episodes(steps):
    return 10 * np.arange(1, len(steps) + 1)


def of_rows(name, steps, returns=None):
    """A measure of a trial that took so many steps in its tests, or gave these returns."""
    steps = np.asarray(steps)
    returns = np.zeros(steps.size) if returns is None else np.asarray(returns)
    rows = TrialRows.of_tests(episodes(steps), steps, returns, steps < 50)
    return MEASURES[name][1](rows)


def learned(steps):
    return episodes_to_learn(episodes(steps), steps)


def test_learned_at_the_first_test():
    assert learned([10] * 10) == 10.0


def test_measures_of_unlearned_tasks_are_infinite():
    assert learned([50] * 100) == math.inf
    assert learned([11] * 100) == math.inf


def test_failed_tests_before_the_first_good_one_do_not_count():
    # From the third test on: 6 good of the 10 that begin there is enough for the median, but
    # the windows that begin at failed tests do not count although their medians are good.
    assert learned([50] * 4 + [7] * 20) == 50.0


def test_median_of_an_even_window_is_the_mean_of_the_middle_two():
    # 5 good and 5 failed: median (7 + 50) / 2 = 28.5; 6 good and 4 failed: 7.
    assert learned([7] * 5 + [50] * 5) == math.inf
    assert learned([7] * 6 + [50] * 4) == 10.0
    assert learned([7] + [50] * 4 + [7] * 5) == 10.0


def test_lucky_test_does_not_count_and_relapse_does_not_undo():
    assert learned([50, 3] + [50] * 8 + [6] * 10 + [50] * 80) == 110.0


def test_window_cut_off_by_the_end_does_not_count():
    assert learned([50] * 5 + [5] * 9) == math.inf
    assert learned([5] * 9) == math.inf


def test_final_measures_use_the_last_fifty_tests():
    steps = [3] * 100 + [50] * 24 + [4] * 26
    assert of_rows("final_steps", steps) == 4.0
    assert final_share_solved([s < 50 for s in steps]) == 0.52
    assert of_rows("final_steps", [8, 9]) == 8.5


def collapse(steps):
    return episode_of_collapse(episodes(steps), steps)


def test_collapse_is_the_end_of_the_last_mastered_run():
    # 60 good tests, then failed ones. A run of 50 with 26 good tests has a median of 7, one with 25
    # a median of 28.5: the last mastered run begins at test 35 and ends with test 84.
    assert collapse([7] * 60 + [50] * 100) == 840.0


def test_no_collapse_within_the_trial_is_infinite():
    assert collapse([50] * 100 + [7] * 50) == math.inf
    assert collapse([7] * 50) == math.inf


def test_mended_relapse_is_no_collapse():
    assert collapse([7] * 60 + [50] * 100 + [7] * 60) == math.inf
    assert collapse([7] * 60 + [50] * 100 + [7] * 60 + [50] * 100) == 10.0 * (60 + 100 + 60 + 24)


def test_lifetime_without_mastery_is_zero():
    assert collapse([50] * 200) == 0.0
    assert collapse([7, 50] * 100) == 0.0


def test_too_few_tests_for_a_run_say_nothing():
    assert math.isnan(collapse([7] * 49))


def test_early_steps_are_those_of_the_first_episodes():
    steps = [4] * 150 + [8] * 100 + [50] * 750
    assert of_rows("early_steps", steps) == 4.0
    assert of_rows("early_steps", [50] * 251) == 50.0


@pytest.mark.parametrize("n_tests", [1, 9, 10, 49, 50, 137])
def test_measures_take_trials_of_any_length(n_tests):
    steps = np.random.default_rng(n_tests).integers(1, 51, n_tests)
    assert episodes_to_learn(episodes(steps), steps) > 0
    assert 1 <= of_rows("final_steps", steps) <= 50
    assert 0 <= final_share_solved(steps < 50) <= 1


def test_returns_are_averaged_over_all_tests_or_the_last_tenth():
    def mean_and_final(returns):
        steps = np.full(len(returns), 50)
        return [of_rows(name, steps, returns) for name in ("mean_return", "final_return")]

    returns = np.arange(40.0)
    assert mean_and_final(returns) == [19.5, 37.5]  # 36 to 39
    assert mean_and_final(returns[:19])[1] == 18.0
    assert mean_and_final([-3.0]) == [-3.0, -3.0]
