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

KINDS = [config_class for name, config_class in vars(config).items() if name.endswith("Config")]
FIELDS = [(config_class, field) for config_class in KINDS for field in fields_of(config_class)]
IDS = [f"{config_class.__name__}.{field.name}" for config_class, field in FIELDS]


def other_value(field):
    """A possible value that is not the default."""
    if field.hint.startswith("typing.Literal"):
        return next(word for word in field.type.__args__ if word != field.default)
    if field.hint == "bool":
        return not field.default
    if field.hint.startswith("tuple"):
        return (True,) if "bool" in field.hint else (1, 0)
    number = field.default or 0
    candidates = (number + 1, number / 2, number - 1, 0.5)
    inside = [x for x in candidates if field.low <= x <= field.high and x != field.low]
    return next(x for x in inside if "float" in field.hint or x == int(x))


@pytest.mark.parametrize(("config_class", "field"), FIELDS, ids=IDS)
def test_each_field_is_kept_by_copies_pickles_and_replace(config_class, field):
    value = other_value(field)
    config_ = config_class(**{field.name: value})
    assert (
        getattr(config_, field.name)
        == value
        != field.default
        == getattr(config_class(), field.name)
    )
    assert config_ != config_class()
    assert f"{field.name}={value!r}" in repr(config_).replace(f"{value}.0", f"{value}")
    for again in (
        pickle.loads(pickle.dumps(config_)),
        copy.deepcopy(config_),
        config_class().replace(**{field.name: value}),
        dataclasses.replace(config_class(), **{field.name: value}),
        config_class(**dataclasses.asdict(config_)),
    ):
        assert again == config_
        assert hash(again) == hash(config_)


@pytest.mark.parametrize(("config_class", "field"), FIELDS, ids=IDS)
def test_bad_values_of_each_field_are_refused_with_its_name(config_class, field):
    bad = ["four", b"x", {}, object(), 5 if field.hint == "bool" else True]
    if not field.hint.endswith("None"):
        bad.append(None)
    if field.hint in ("int", "float"):
        bad += [math.nan, math.inf, 10**400]
        bad += [field.low] * field.excludes_low
        bad += [field.low - 1 - abs(field.low)] * math.isfinite(field.low)
        bad += [field.high * 2] * math.isfinite(field.high)
    if field.hint == "int":
        bad.append(1.5)
    for value in bad:
        if field.hint.startswith("tuple") and value == {}:
            continue
        with pytest.raises((TypeError, ValueError)) as caught:
            config_class(**{field.name: value})
        assert caught.value.argument == field.name
        assert str(caught.value).startswith(f"{field.name} must be ")


@pytest.mark.parametrize("config_class", KINDS)
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
    config_ = QLearningConfig(n_steps=np.int64(3), epsilon=np.float32(0.5), discount=1)
    assert (config_.n_steps, config_.epsilon, config_.discount) == (3, 0.5, 1.0)
    assert SDNNCConfig(circular=[np.True_, False]).circular == (True, False)
    assert SDNNCConfig(balanced_anchors=np.False_).balanced_anchors is False
