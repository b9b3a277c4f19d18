"""The settings of the core: classes made of its fields, which are checked when they are made."""

import copy
import dataclasses
import inspect
import math
import pickle

import numpy as np
import pytest

from refusals import refuses
from sdnn import config
from sdnn.config import QLearningConfig, SDNNCConfig, fields_of

CONFIG_CLASSES = [
    config_class for name, config_class in vars(config).items() if name.endswith("Config")
]
FIELDS = [
    (config_class, field) for config_class in CONFIG_CLASSES for field in fields_of(config_class)
]
IDS = [f"{config_class.__name__}.{field.name}" for config_class, field in FIELDS]


def other_value(field):
    """Return a possible value that is not the default."""
    if field.hint.startswith("typing.Literal"):
        return next(word for word in field.type.__args__ if word != field.default)
    if field.hint == "bool":
        return not field.default
    if field.hint.startswith("tuple"):
        return (True,) if "bool" in field.hint else (1, 0)
    default = field.default or 0  # instead of None
    for candidate in (default + 1, default / 2, default - 1, 0.5):
        is_of_type = "float" in field.hint or candidate == int(candidate)
        if is_of_type and field.low < candidate <= field.high:
            return candidate
    raise AssertionError(f"{field.name} needs another candidate")


@pytest.mark.parametrize(("config_class", "field"), FIELDS, ids=IDS)
def test_each_field_is_kept_by_copies_pickles_and_replace(config_class, field):
    value = other_value(field)
    settings = config_class(**{field.name: value})
    assert getattr(config_class(), field.name) == field.default
    assert getattr(settings, field.name) == value != field.default
    assert settings != config_class()
    # Fields of floats show the whole value 3 as "3.0".
    assert f"{field.name}={value!r}" in repr(settings).replace(f"{value}.0", f"{value}")
    for copied in (
        pickle.loads(pickle.dumps(settings)),
        copy.deepcopy(settings),
        config_class().replace(**{field.name: value}),
        dataclasses.replace(config_class(), **{field.name: value}),
        config_class(**dataclasses.asdict(settings)),
    ):
        assert copied == settings
        assert hash(copied) == hash(settings)


@pytest.mark.parametrize(("config_class", "field"), FIELDS, ids=IDS)
def test_bad_values_of_each_field_are_refused_with_its_name(config_class, field):
    bad_values = ["four", b"x", object()]
    bad_values.append(5 if field.hint == "bool" else True)  # flags are no numbers
    if not field.hint.startswith("tuple"):  # an empty dict is an empty sequence, too
        bad_values.append({})
    if not field.hint.endswith("None"):
        bad_values.append(None)
    if field.hint in ("int", "float"):
        bad_values += [math.nan, math.inf, 10**400]
        if field.excludes_low:
            bad_values.append(field.low)
        # Values beyond the bounds, by so much that a large bound is not rounded to itself.
        if math.isfinite(field.low):
            bad_values.append(field.low - 1 - abs(field.low))
        if math.isfinite(field.high):
            bad_values.append(field.high * 2)
    if field.hint == "int":
        bad_values.append(1.5)
    for value in bad_values:
        with pytest.raises((TypeError, ValueError)) as caught:
            config_class(**{field.name: value})
        assert caught.value.argument == field.name
        assert str(caught.value).startswith(f"{field.name} must be ")


@pytest.mark.parametrize("config_class", CONFIG_CLASSES)
def test_configurations_are_frozen_keyword_only_and_documented(config_class):
    (first, *_) = fields_of(config_class)
    with pytest.raises(TypeError):
        config_class(first.default)
    with pytest.raises(AttributeError):
        setattr(config_class(), first.name, first.default)
    refuses("nothing", config_class, nothing=1, error=TypeError)
    names = [field.name for field in fields_of(config_class)]
    assert list(inspect.signature(config_class).parameters) == names
    assert [field.name for field in dataclasses.fields(config_class)] == names
    for field in fields_of(config_class):
        assert field.doc.endswith(".")
        assert f"\n{field.name} : " in config_class.__doc__


def test_configurations_accept_numpy_numbers_and_bools():
    settings = QLearningConfig(n_steps=np.int64(3), epsilon=np.float32(0.5), discount=1)
    assert (settings.n_steps, settings.epsilon, settings.discount) == (3, 0.5, 1.0)
    assert SDNNCConfig(circular=[np.True_, False]).circular == (True, False)
    assert SDNNCConfig(balanced_anchors=np.False_).balanced_anchors is False
