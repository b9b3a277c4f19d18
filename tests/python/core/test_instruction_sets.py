"""Instruction sets of the processor: each gives the same bits; users can select one."""

import pytest

from processes import environment, python
from sdnn import _core
from sdnn.support.machine import available_instruction_sets, instruction_set, set_instruction_set


@pytest.fixture
def restored_instruction_set():
    """Select the present instruction set again after the test."""
    before = instruction_set()
    yield
    set_instruction_set(before)


N_EPISODES, EVALUATE_EVERY = 60, 5


def short_trial(n_inputs, noise):
    return _core.AcrobotTrial(
        approximator=_core.SDNNCConfig(n_inputs=n_inputs),
        learning=_core.QLearningConfig(),
        acrobot=_core.AcrobotConfig(),
        goal=_core.GoalScheduleConfig(),
        sensors=_core.SensorConfig(n_sensors=n_inputs, noise=noise),
        protocol=_core.ProtocolConfig(episodes=N_EPISODES, evaluate_every_episodes=EVALUATE_EVERY),
        seed=3,
    )


@pytest.mark.usefixtures("restored_instruction_set")
@pytest.mark.parametrize(("n_inputs", "noise"), [(4, 0.0), (4, 0.02), (6, 0.02)])
def test_a_trial_has_the_same_bits_on_every_instruction_set(n_inputs, noise):
    results = {}
    for name in available_instruction_sets():
        set_instruction_set(name)
        trial = short_trial(n_inputs, noise)
        trial.advance(N_EPISODES)
        results[name] = (trial.n_decisions, trial.test_rows())
    expected_decisions, expected_columns = results["portable"]
    assert len(expected_columns["steps"]) == N_EPISODES // EVALUATE_EVERY
    for name, (n_decisions, columns) in results.items():
        assert n_decisions == expected_decisions, name
        for title, column in columns.items():
            assert column.tobytes() == expected_columns[title].tobytes(), (name, title)


@pytest.mark.parametrize("name", ["", "sse9", "AVX2", "avx2 "])
def test_unknown_instruction_sets_are_refused_and_change_nothing(name):
    before = instruction_set()
    with pytest.raises(ValueError, match="instruction set"):
        set_instruction_set(name)
    assert instruction_set() == before
    with pytest.raises(TypeError):
        set_instruction_set(2)


def test_the_environment_variable_selects_an_instruction_set():
    code = "import sdnn; print(sdnn.instruction_set())"
    process = python("-c", code, env=environment(SDNN_INSTRUCTION_SET="portable"))
    assert (process.returncode, process.stdout) == (0, "portable\n")


def test_an_unknown_instruction_set_in_the_environment_raises_an_error():
    calls = (
        "sdnn.SDNNRegressor(max_iter=1).fit([[0.0], [1.0]], [0.0, 1.0])",
        "sdnn.approximators.SDNNC()",
        "sdnn.environments.AcrobotSwingUpVectorEnv(num_envs=2).reset() and sdnn.instruction_set()",
        "sdnn.instruction_set()",
    )
    lines = ["import sdnn, sdnn.approximators, sdnn.environments"]
    lines += [f"try: {call}\nexcept ValueError as error: print(error)" for call in calls]
    process = python("-c", "\n".join(lines), env=environment(SDNN_INSTRUCTION_SET="foo"))
    printed = process.stdout.splitlines()
    accepted = ", ".join(available_instruction_sets())
    message = f"SDNN_INSTRUCTION_SET must be one of {accepted} on this processor, got foo"
    assert printed == [message] * len(calls)
