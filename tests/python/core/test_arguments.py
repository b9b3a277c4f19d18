import doctest

import numpy as np
import pytest

from sdnn import arguments


def test_the_examples_run():
    result = doctest.testmod(arguments)
    assert result.failed == 0
    assert result.attempted > 0


@pytest.mark.parametrize("value", [2, np.int8(2), np.uint64(2)])
def test_whole_numbers_of_every_type(value):
    found = arguments.whole("n", value, 1, 2)
    assert found == 2
    assert type(found) is int


@pytest.mark.parametrize("value", [0, 3, 2.0, "2", True, None, np.nan])
def test_what_is_no_whole_number_in_bounds(value):
    with pytest.raises(ValueError, match=r"\bn\b"):
        arguments.whole("n", value, 1, 2)


@pytest.mark.parametrize("value", [0.5, 1, np.float32(0.5), np.int8(1), np.inf])
def test_numbers_of_every_type(value):
    found = arguments.real("x", value)
    assert found == value
    assert type(found) is float


@pytest.mark.parametrize("value", ["0.5", True, None, 1j, [0.5]])
def test_what_is_no_number(value):
    with pytest.raises(ValueError, match=r"\bx\b"):
        arguments.real("x", value)


@pytest.mark.parametrize("word", ["left", None, ["up"], 1])
def test_words_that_are_not_there(word):
    with pytest.raises(ValueError, match="direction"):
        arguments.one_of("direction", word, ("up", "down"))


@pytest.mark.parametrize("seed", [-1, 2**64, None, 1.5])
def test_seeds_that_the_core_does_not_take(seed):
    with pytest.raises(ValueError, match=r"\bseed\b"):
        arguments.seed_of(seed)
    assert arguments.seed_of(2**64 - 1) == 2**64 - 1
