"""The dataclasses of the configurations: the core's fields, the core's defaults."""

import dataclasses

import pytest

from sdnn import _core, agents, approximators, environments
from sdnn.config import to_core
from sdnn.reproduction import ProtocolConfig

CONFIGS = (
    agents.FuzzyQLearningConfig,
    agents.QLearningConfig,
    approximators.FuzzyRulesConfig,
    approximators.RBFNetworkConfig,
    approximators.SDNNCConfig,
    environments.AcrobotConfig,
    environments.GoalScheduleConfig,
    environments.SensorConfig,
    ProtocolConfig,
)


def core_fields(core):
    return {name for name, kind in vars(type(core)).items() if isinstance(kind, property)}


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: config.__name__)
def test_a_dataclass_has_the_fields_and_defaults_of_the_core(config):
    core = getattr(_core, config.__name__)
    assert {field.name for field in dataclasses.fields(config)} == core_fields(core())
    assert config().to_core() == core()


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: config.__name__)
def test_every_field_reaches_the_core(config):
    for field in dataclasses.fields(config):
        other = changed(getattr(config(), field.name), core_default(config, field.name))
        core = dataclasses.replace(config(), **{field.name: other}).to_core()
        assert core != config().to_core()
        if not isinstance(other, str):
            assert getattr(core, field.name) == (list(other) if other == (True,) else other)
        else:
            assert getattr(core, field.name).name == other


def core_default(config, name):
    return getattr(config().to_core(), name)


def changed(value, core_value):
    """Another value of a field."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, str):
        return next(name for name in type(core_value).__members__ if name != value)
    if isinstance(value, tuple):
        return (True,)
    return 7 if value is None else value + 1


def test_a_repr_tells_every_field():
    text = repr(_core.QLearningConfig(discount=0.25))
    assert text.startswith("QLearningConfig(learning_rate=0.5, discount=0.25, epsilon=0.1,")


def test_an_unknown_word_is_refused_with_its_name():
    config = agents.QLearningConfig(tie_rule="best")
    with pytest.raises(ValueError, match="tie_rule must be one of 'uniform', 'lowest', 'middle'"):
        to_core(config, _core.QLearningConfig)


def test_a_value_of_another_type_is_refused():
    with pytest.raises(TypeError, match="n_inputs"):
        approximators.SDNNCConfig(n_inputs="four").to_core()
