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

KINDS = [kind for name, kind in vars(config).items() if name.endswith("Config")]
FIELDS = [(kind, field) for kind in KINDS for field in fields_of(kind)]
IDS = [f"{kind.__name__}.{field.name}" for kind, field in FIELDS]


def other_value(field):
    """A possible value that is not the default."""
    if field.hint.startswith("typing.Literal"):
        return next(word for word in field.type.__args__ if word != field.default)
    if field.hint == "bool":
        return not field.default
    if field.hint.startswith("tuple"):
        return (True,) if "bool" in field.hint else (1, 0)
    number = field.default or 0
    tried = (number + 1, number / 2, number - 1, 0.5)
    inside = [x for x in tried if field.low <= x <= field.high and x != field.low]
    return next(x for x in inside if "float" in field.hint or x == int(x))


@pytest.mark.parametrize(("kind", "field"), FIELDS, ids=IDS)
def test_each_field_is_kept_by_copies_pickles_and_replace(kind, field):
    value = other_value(field)
    made = kind(**{field.name: value})
    assert getattr(made, field.name) == value != field.default == getattr(kind(), field.name)
    assert made != kind()
    assert f"{field.name}={value!r}" in repr(made).replace(f"{value}.0", f"{value}")
    for again in (
        pickle.loads(pickle.dumps(made)),
        copy.deepcopy(made),
        kind().replace(**{field.name: value}),
        dataclasses.replace(kind(), **{field.name: value}),
        kind(**dataclasses.asdict(made)),
    ):
        assert again == made
        assert hash(again) == hash(made)


@pytest.mark.parametrize(("kind", "field"), FIELDS, ids=IDS)
def test_bad_values_of_each_field_are_refused_with_its_name(kind, field):
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
            kind(**{field.name: value})
        assert caught.value.argument == field.name
        assert str(caught.value).startswith(f"{field.name} must be ")


@pytest.mark.parametrize("kind", KINDS)
def test_configurations_are_frozen_keyword_only_and_documented(kind):
    (first, *_) = fields_of(kind)
    with pytest.raises(TypeError):
        kind(first.default)
    with pytest.raises(AttributeError):
        setattr(kind(), first.name, first.default)
    refuses("nothing", kind, nothing=1, error=TypeError)
    names = [field.name for field in fields_of(kind)]
    assert list(inspect.signature(kind).parameters) == names
    assert [field.name for field in dataclasses.fields(kind)] == names
    for field in fields_of(kind):
        assert field.doc.endswith(".")
        assert f"\n{field.name} : " in kind.__doc__


def test_configurations_accept_numpy_numbers_and_bools():
    made = QLearningConfig(n_steps=np.int64(3), epsilon=np.float32(0.5), discount=1)
    assert (made.n_steps, made.epsilon, made.discount) == (3, 0.5, 1.0)
    assert SDNNCConfig(circular=[np.True_, False]).circular == (True, False)
    assert SDNNCConfig(balanced_anchors=np.False_).balanced_anchors is False
