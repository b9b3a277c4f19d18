"""The settings that the core declares: their fields, checks and documentation come from C++."""

from __future__ import annotations

import dataclasses
import inspect
import typing
from typing import Any, NamedTuple

from sdnn._core import (
    AcrobotConfig as AcrobotConfig,
    Controller as Controller,
    FuzzyQLearningConfig as FuzzyQLearningConfig,
    FuzzyRulesConfig as FuzzyRulesConfig,
    GoalScheduleConfig as GoalScheduleConfig,
    LinearSDNNConfig as LinearSDNNConfig,
    ProtocolConfig as ProtocolConfig,
    QLambdaConfig as QLambdaConfig,
    QLearningConfig as QLearningConfig,
    RBFNetworkConfig as RBFNetworkConfig,
    SDNNCConfig as SDNNCConfig,
    SensorConfig as SensorConfig,
)
from sdnn.support.arguments import explains_names


class Field(NamedTuple):
    """A setting of the core."""

    name: str
    hint: str
    default: Any
    doc: str
    low: float
    high: float
    excludes_low: bool

    @property
    def type(self) -> Any:
        """Its type, as Python's type hints have it."""
        return eval(self.hint, {"typing": typing})


def fields_of(kind: Any) -> tuple[Field, ...]:
    """Return the settings of one of the core's classes; none of any other class.

    Examples
    --------
    >>> [field.name for field in fields_of(FuzzyRulesConfig)]
    ['n_inputs', 'n_sets', 'n_actions', 'max_table_bytes']
    """
    return tuple(Field(*field) for field in getattr(kind, "fields", ()))


def values_of(config: Any) -> dict[str, Any]:
    """Return the values of all settings by name, as data that JSON can hold."""
    return {field.name: getattr(config, field.name) for field in fields_of(type(config))}


def _complete(kind: Any) -> None:
    """Make a class of the core a dataclass: for `dataclasses.replace`, `fields` and `asdict`."""
    fields = [
        (field.name, field.type, dataclasses.field(default=field.default))
        for field in fields_of(kind)
    ]
    like = dataclasses.make_dataclass(kind.__name__, fields, repr=False, eq=False, kw_only=True)
    kind.__dataclass_fields__ = vars(like)["__dataclass_fields__"]
    kind.__annotations__ = like.__annotations__
    kind.__signature__ = inspect.signature(like).replace(return_annotation=inspect.Signature.empty)
    explains_names()(kind)


(WARM_UP,) = fields_of(Controller)
"""The number of steps of a warm-up, which agents and specifications share."""

for _kind in [kind for name, kind in vars().items() if name.endswith("Config")]:
    _complete(_kind)
