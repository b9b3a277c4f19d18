"""Settings in Python against the core's structs."""

import dataclasses

import pytest

from sdnn import _core
from sdnn.environments import AcrobotConfig, GoalSchedule, GoalScheduleConfig, SensorConfig

PAIRS = [
    (AcrobotConfig, _core.AcrobotConfig),
    (GoalScheduleConfig, _core.GoalScheduleConfig),
    (SensorConfig, _core.SensorConfig),
]


def values(config, like):
    """The fields of a core struct, enumerations as their words."""
    read = {field.name: getattr(config, field.name) for field in dataclasses.fields(like)}
    return {name: getattr(value, "name", value) for name, value in read.items()}


@pytest.mark.parametrize(("python", "core"), PAIRS)
def test_defaults_equal_the_cores(python, core):
    assert values(core(), python) == dataclasses.asdict(python())
    fields = {name for name in dir(core) if not name.startswith("_")}
    assert fields == {field.name for field in dataclasses.fields(python)}


@pytest.mark.parametrize("python", [pair[0] for pair in PAIRS])
def test_every_number_arrives_in_the_core(python):
    numbers = {
        field.name: type(field.default)(i + 2)
        for i, field in enumerate(dataclasses.fields(python))
        if not isinstance(field.default, str)
    }
    config = python(**numbers)
    assert values(config.to_core(), python) == dataclasses.asdict(config)


@pytest.mark.parametrize("kind", ["inverse_linear", "inverse_sqrt", "constant"])
def test_schedule_kinds_arrive(kind):
    assert GoalScheduleConfig(kind=kind).to_core().kind.name == kind
    expected = {"inverse_linear": 0.5, "inverse_sqrt": 101**-0.5, "constant": 1.0}
    assert GoalSchedule(GoalScheduleConfig(kind=kind))(100) == pytest.approx(expected[kind])


def test_unknown_words_are_named():
    with pytest.raises(ValueError, match="goal_test must be one of 'every_step'"):
        AcrobotConfig(goal_test="sometimes").to_core()
    with pytest.raises(ValueError, match="kind must be one of 'inverse_linear'"):
        GoalScheduleConfig(kind="linear").to_core()


def test_settings_are_frozen_and_keyword_only():
    with pytest.raises(dataclasses.FrozenInstanceError):
        AcrobotConfig().gravity = 1.0
    with pytest.raises(TypeError):
        SensorConfig(4)
