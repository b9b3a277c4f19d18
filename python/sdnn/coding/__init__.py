"""Codings: the values of one input as binary patterns.

A coding is a frozen dataclass; ``fit`` returns a copy with range, categories and bins known.

>>> import numpy as np
>>> from sdnn.coding import RandomInverse
>>> coding = RandomInverse(length_scale=0.5).fit(np.array([3.0, 7.0, 5.0]), n_units=200)
>>> coding.low, coding.high, coding.n_bins
(3.0, 7.0, 100)
>>> coding.bins(np.array([2.0, 3.0, 5.0, 7.0]))
array([ 0,  0, 50, 99], dtype=int32)
>>> coding.patterns(200, seed=1).shape
(100, 200)
"""

from sdnn.coding.base import CODINGS, Coding, coding_named, from_dict, to_dict
from sdnn.coding.numeric import Anchor, Circular, CoarseCodeWarning, RandomInverse
from sdnn.coding.symbols import CorrelationMatrix, Symbolic, WithMissing

__all__ = [
    "CODINGS",
    "Anchor",
    "Circular",
    "CoarseCodeWarning",
    "Coding",
    "CorrelationMatrix",
    "RandomInverse",
    "Symbolic",
    "WithMissing",
    "coding_named",
    "from_dict",
    "to_dict",
]

for _coding in (RandomInverse, Anchor, Circular, Symbolic, CorrelationMatrix, WithMissing):
    CODINGS[_coding.name] = _coding
