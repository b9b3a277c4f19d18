"""The numbers of LIBSDNN, and readers of its files.

Hashes and model files were made by LIBSDNN itself (commit 5a862cc, g++ 12, -O3), from the
parameters and samples below; the hash is of thresholds and weights as its model file has them.
"""

import hashlib
import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from refusals import refuses
from sdnn import libsdnn

FILES = Path(__file__).parents[1] / "reference" / "libsdnn_files"

BLANKS = ((400, 600, 400, 600), (200, 800, 100, 300), (100, 200, 300, 700), (800, 900, 300, 700))

PARAMETERS = (FILES / "demonstration.txt").read_text()


def demonstration_sample(n_samples):
    """Draw points of a lattice outside the blanks, and the function there, as LIBSDNN's demo does.

    The random numbers are those of a linear congruential generator that begins with 1.
    """
    state, points, targets = 1, [], []
    while len(points) < n_samples:
        drawn = []
        for _ in range(2):
            state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
            drawn.append((state >> 33) % 1001)
        i, j = drawn
        if any(a <= i <= b and c <= j <= d for a, b, c, d in BLANKS):
            continue
        x, y = i / 1000, j / 1000
        wave = (1 + x) / 2 * math.sin(6 * math.pi * math.sqrt(x) * y**2) ** 2
        points.append((x, y))
        targets.append(1.0 if (i - 500) ** 2 + (j - 500) ** 2 <= 200**2 else round(wave, 6))
    return np.array(points), np.array(targets)


def digest(layer):
    rows = np.column_stack([layer.thresholds, layer.weights])
    return hashlib.sha256(np.ascontiguousarray(rows, dtype="<i4").tobytes()).hexdigest()


@pytest.fixture
def parameter_file(tmp_path):
    def write(*changes):
        text = PARAMETERS
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "parameters.txt"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize(
    ("n_epochs", "expected"),
    [
        (20, "5131552d0ca2e546a88a3c93d723fbe5d4ec81508c7af141e63e8deb6f9f1870"),
        (300, "4f4ce621e58d75b8191d3d0e35acf67a41e5e325a8bc0a299bfb66717f99caa1"),
    ],
)
def test_the_demonstration_problem_has_libsdnns_weights(parameter_file, n_epochs, expected):
    parameters = libsdnn.read_parameter_file(parameter_file())
    assert parameters.n_output_units == 280
    points, targets = demonstration_sample(2000)
    layer = parameters.make_layer("libstdc++")
    trainer = parameters.make_trainer(layer, points, targets)
    for _ in range(n_epochs):
        trainer.present(np.arange(2000))
    trainer.synchronize()
    assert digest(layer) == expected


def test_the_two_libraries_draw_different_weights(parameter_file):
    parameters = libsdnn.read_parameter_file(parameter_file(("n = 2000", "n = 40")))
    layers = [parameters.make_layer(library) for library in ("libstdc++", "msvc")]
    assert digest(layers[0]) != digest(layers[1])


@pytest.mark.parametrize(
    ("name", "expected"), [("one_vs_one", "2a1aa1d6"), ("one_vs_rest", "60d6ed36")]
)
def test_the_model_file_of_a_classifier_is_read_with_libsdnns_weights(name, expected):
    model = libsdnn.read_model_file(FILES / f"{name}.bin", "libstdc++")
    assert model.parameters.scheme == name
    number = libsdnn.LibsdnnInput(symbolic=False, n_bins=51, n_flipped=3)
    assert model.parameters.inputs == (number, number)
    assert model.parameters.pairs == ((0, 1), (1, 0))
    assert model.parameters.pattern_seed == (7, 8, 9)
    assert digest(model.layer).startswith(expected)
    lattice = np.array(list(itertools.product(np.linspace(0.0, 1.0, 41), repeat=2)))
    right, above = (lattice >= 0.5).astype(int).T
    assert np.mean(model.predict(lattice) == right + 2 * above) > 0.8, "the classes are quadrants"


def test_values_have_the_bins_of_libsdnn(parameter_file):
    number_and_symbol = (
        "[NUMERICAL(RANDOM_INVERSE(1001,5)):2]",
        "[NUMERICAL(RANDOM_INVERSE(10,5)), SYMBOLIC(RANDOM_INVERSE(4,5))]",
    )
    parameters = libsdnn.read_parameter_file(parameter_file(number_and_symbol))
    # Numbers from 0 to 1 have ten bins, symbols are their bins; both are clipped.
    values = [(0.0, 0), (0.0999, 1), (0.1, 3), (1.0, 4), (-3.0, -2), (2.0, 9)]
    expected = [(0, 0), (0, 1), (1, 3), (9, 3), (0, 0), (9, 3)]
    assert parameters.bins(values).tolist() == [list(pair) for pair in expected]
    for bad in ([0.5, 0.5], [[0.5]], [[np.nan, 0.0]]):
        refuses("inputs", parameters.bins, bad)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("input_number = 2", "input_number = 3"), "input_number"),
        (("input_number = 2", "input_number = two"), "input_number"),
        (("input_number = 2", "input_number = 9^9^9^9"), "input_number"),
        (("input_number = 2", "% input_number"), "input_number"),
        (("n = 2000", "n = 2001"), "n"),
        (("n = 2000", "n = 8"), "RANDOM_INVERSE"),
        (("[NUMERICAL(RANDOM_INVERSE(1001,5)):2]", "[NUMERICAL(TREE(1)):2]"), "TREE"),
        (("[NUMERICAL(RANDOM_INVERSE(1001,5)):2]", "NUMERICAL"), "NUMERICAL"),
        (("function_approximation", "clustering"), "clustering"),
        (("[-0.2, 1.2]", "[1.2, -0.2]"), "output_range"),
        (("[-5, 5]", "[5, -5]"), "initial_value_range"),
        (("mutual", "nobody"), "combination_setting"),
        (("mutual", "file"), "filename"),
        (("<SD>", "SD"), "19"),  # the number of the line
        (("<ISSUE> % what", "}\n<ISSUE> % what"), "1"),
    ],
)
def test_invalid_parameter_files_are_refused_by_key(parameter_file, change, message):
    refuses(message, libsdnn.read_parameter_file, parameter_file(change))


def test_parameter_files_without_seeds_cannot_be_reproduced(parameter_file):
    path = parameter_file(("random_seed = [1]", "random_seed = hardware_entropy"))
    parameters = libsdnn.read_parameter_file(path)
    assert parameters.pattern_seed is None
    refuses("hardware_entropy", parameters.make_layer)


def test_damaged_model_files_are_refused(tmp_path):
    content = (FILES / "one_vs_one.bin").read_bytes()
    path = tmp_path / "model.bin"
    for broken in (b"", content[:3], content[:100], content[:-1], content + b"1234"):
        path.write_bytes(broken)
        refuses("must", libsdnn.read_model_file, path)
    path.write_bytes(content[:-8] + b"\xff\xff\xff\x7f" * 2)  # the largest 32-bit integers
    refuses("model.bin", libsdnn.read_model_file, path)


def test_tables_beyond_the_memory_limit_are_refused(parameter_file):
    file = parameter_file(("1001,5", "16777216,5"))  # patterns of an input: 16 GB
    refuses("RANDOM_INVERSE", libsdnn.read_parameter_file(file).make_layer)
