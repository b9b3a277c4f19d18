"""Claims of the paper are judged by hand-made trials.

An evaluation of 50 steps has not solved the task; ten trials of 15,000 episodes are judged.
"""

import math

import numpy as np
import pytest

from made_records import make_record
from sdnn.reproduction.cases import EXPERIMENTS, PAPER_EPISODES
from sdnn.reproduction.claims import (
    CLAIMS,
    Check,
    CheckOutcome,
    Claim,
    ClaimOutcome,
    Verdict,
    is_paper_scale,
    judge_claims,
    verdict_of,
)
from sdnn.reproduction.cost import QUICK_COST, SERIES, CostConfig, CostRecord
from sdnn.runs import Estimate, TrialKey, measure

CASES = {case.id: case for experiment in EXPERIMENTS for case in experiment.cases}

LEARNED_SOON, SOLVED_AT_END, LEARNED_BY_FUZZY, UNSTABLE_FUZZY = 1, 2, 3, 4
LATER_COLLAPSE, LEARNED_AS_SOON, GROWTH_OF_COSTS = 6, 8, 9
"""Claims by their numbers in REPRODUCTION.md."""


def fake_trials(case_id, agent, steps, n_trials=10, n_tests=1500):
    """Measure trials that take these steps in every evaluation; one number, or one per trial."""
    records = tuple(
        make_record(key=TrialKey(case_id, agent, trial, trial, "hash"), steps=np.full(n_tests, n))
        for trial, n in enumerate(np.broadcast_to(steps, (n_trials,)))
    )
    return measure(CASES[case_id].title, records)


def cost(series, n_inputs, microseconds, config=None):
    """Return a made-up record of times of a step, with the full settings by default."""
    config_hash = (config or CostConfig()).config_hash
    return CostRecord(
        series=series, n_inputs=n_inputs, microseconds=tuple(map(float, microseconds)), n_steps=1,
        table_bytes=1, machine="m", version="0", config_hash=config_hash,
    )  # fmt: skip


def verdicts(summaries):
    """Return the verdicts by the numbers of their claims."""
    return {outcome.claim.number: outcome.verdict for outcome in judge_claims(summaries)}


@pytest.mark.parametrize(
    ("estimate_low_high", "verdict"),
    [
        ((100, 80, 150), Verdict.HOLDS),  # the limit itself is allowed
        ((140, 120, 160), Verdict.UNDECIDED),  # 150 is inside
        ((300, 160, math.inf), Verdict.FAILS),
        ((math.inf, math.inf, math.inf), Verdict.FAILS),  # never learned
        ((10, math.nan, math.nan), Verdict.UNDECIDED),  # no interval
    ],
)
def test_a_check_holds_or_fails_with_its_whole_interval(estimate_low_high, verdict):
    check = Check(measure="episodes_to_learn", case="s4", paper="about 150", at_most=150)
    assert verdict_of(check, Estimate(*estimate_low_high)) == verdict


def test_a_check_may_have_a_lower_and_an_upper_limit():
    check = Check(measure="final_steps", case="s4", paper="", at_least=3, at_most=5)
    assert verdict_of(check, Estimate(4, 3, 5)) == Verdict.HOLDS
    assert verdict_of(check, Estimate(2, 1, 2.5)) == Verdict.FAILS
    assert verdict_of(check, Estimate(7, 6, 8)) == Verdict.FAILS
    assert verdict_of(check, Estimate(4, 2, 8)) == Verdict.UNDECIDED


@pytest.mark.parametrize(
    ("checks", "claim"),
    [
        (("holds", "holds"), "holds"),
        (("holds", "does not hold", "undecided"), "does not hold"),
        (("holds", "undecided"), "undecided"),
        (("holds", "not run", "undecided"), "not run"),
        (("not judged", "not judged"), "not judged"),
    ],
)
def test_the_verdict_of_a_claim_follows_from_its_checks(checks, claim):
    outcomes = tuple(CheckOutcome(CLAIMS[0].checks[0], None, Verdict(name)) for name in checks)
    assert ClaimOutcome(Claim(1, "", ()), outcomes).verdict == Verdict(claim)


def test_the_nine_claims_refer_to_planned_cases_and_agents():
    assert [claim.number for claim in CLAIMS] == list(range(1, 10))
    planned = {(case.id, agent) for e in EXPERIMENTS for case in e.cases for agent in case.agents}
    series = {series.id for series in SERIES}
    for check in (check for claim in CLAIMS for check in claim.checks):
        assert str(check)
        if check.measure is None:
            assert check.series in series
            continue
        assert set(check.subjects) <= planned
        assert check.at_least > -math.inf or check.at_most < math.inf


def test_claims_hold_for_good_trials_and_fail_for_bad_ones():
    good = verdicts([fake_trials("s4", "sdnn-c", 4), fake_trials("s6", "sdnn-c", 4)])
    assert good[LEARNED_SOON] == good[SOLVED_AT_END] == Verdict.HOLDS
    assert good[LEARNED_AS_SOON] == Verdict.NOT_RUN  # the noisy cases are missing
    assert LEARNED_BY_FUZZY not in good
    bad = verdicts([fake_trials("s4", "sdnn-c", 50), fake_trials("s6", "sdnn-c", 4)])
    assert bad[LEARNED_SOON] == bad[SOLVED_AT_END] == Verdict.FAILS


def test_the_claim_that_fuzzy_q_learning_is_unstable_with_noise_fails_if_it_solves_the_task():
    def verdict_with(steps):
        cases = ("s4-noise", "s5-noise", "s6-noise")
        return verdicts([fake_trials(case, "fuzzy", steps) for case in cases])[UNSTABLE_FUZZY]

    assert verdict_with(50) == Verdict.HOLDS, "an evaluation of 50 steps is not solved"
    assert verdict_with(7) == Verdict.FAILS


def test_a_difference_of_collapses_counts_none_as_the_last_episode():
    def outcome_with(steps_of_fewer_inputs):
        fewer = fake_trials("s4-noise", "sdnn-c", steps_of_fewer_inputs)
        outcomes = judge_claims([fake_trials("s5-noise", "sdnn-c", 4), fewer], ())
        return next(o for o in outcomes if o.claim.number == LATER_COLLAPSE)

    never_learned = outcome_with(50)  # which counts as a collapse at episode 0
    assert never_learned.checks[0].estimate == Estimate(*3 * [float(PAPER_EPISODES)])
    assert never_learned.verdict == Verdict.HOLDS
    assert outcome_with(4).verdict == Verdict.FAILS, "neither collapses"


def test_evenly_split_trials_leave_a_claim_undecided():
    split = [4] * 5 + [50] * 5
    judged = verdicts([fake_trials("s4", "sdnn-c", split), fake_trials("s6", "sdnn-c", 4)])
    assert judged[SOLVED_AT_END] == Verdict.UNDECIDED


# The paper has 10 trials of 15,000 episodes, with a test after every tenth.
@pytest.mark.parametrize("size", [{"n_trials": 9}, {"n_tests": 1499}])
def test_fewer_trials_or_episodes_than_the_papers_are_not_judged(size):
    judged = verdicts([fake_trials("s4", "sdnn-c", 4, **size), fake_trials("s6", "sdnn-c", 4)])
    assert judged[LEARNED_SOON] == judged[SOLVED_AT_END] == Verdict.NOT_JUDGED


COSTS = [
    cost("sdnn-c", 4, [10, 10, 10]), cost("sdnn-c", 8, [50, 50, 50]),
    cost("rbf", 4, [1, 1, 1]), cost("rbf", 8, [200, 220, 210]),
]  # fmt: skip


def test_the_growth_of_costs_is_a_ratio_of_medians():
    (outcome,) = judge_claims([], COSTS)
    assert outcome.claim.number == GROWTH_OF_COSTS
    growths = [checked.estimate for checked in outcome.checks]  # from 4 to 8 inputs
    assert growths[0] == Estimate(5.0, 5.0, 5.0)  # 50 / 10 microseconds
    assert growths[1] == Estimate(210.0, 200.0, 220.0)  # medians of 200, 210 and 220, over 1
    assert growths[2] is None  # of a series without costs
    assert [c.verdict for c in outcome.checks] == [Verdict.HOLDS, Verdict.HOLDS, Verdict.NOT_RUN]
    assert outcome.verdict == Verdict.NOT_RUN


def test_quick_costs_are_not_judged_and_a_slow_growth_of_rbf_costs_fails_the_claim():
    quick = [cost("sdnn-c", n, [10.0 * n] * 3, QUICK_COST) for n in (4, 8)]
    assert judge_claims([], quick)[0].checks[0].verdict == Verdict.NOT_JUDGED
    of_rbf = [cost("rbf", 4, [1, 1]), cost("rbf", 8, [4, 4])]  # grows less than SDNN-C, by 4, not 5
    of_sdnn_c = [of_n for of_n in COSTS if of_n.series == "sdnn-c"]
    assert judge_claims([], of_sdnn_c + of_rbf)[0].verdict == Verdict.FAILS


def test_the_description_of_a_difference_names_both_cases():
    text = str(Check(measure="final_steps", case="s6-noise", minus="s4", paper=""))
    for words in ("final steps", "SDNN-C", "6 noisy inputs", "4 inputs"):
        assert words in text


def test_a_trial_without_a_collapse_counts_as_its_last_episode():
    summary = fake_trials("s4", "sdnn-c", [3] * 5 + [50] * 5)
    collapses = [PAPER_EPISODES] * 5 + [0] * 5
    np.testing.assert_array_equal(summary.uncensored("episode_of_collapse"), collapses)
    assert summary.medians["final_share_solved"].value == (0 + 1) / 2, "median of trials"
    assert is_paper_scale(summary)
