"""The lines of keys, against texts counted by hand and against what the TOML reader finds."""

import sys

import pytest

from sdnn.toml_lines import key_lines, line_of

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

TEXT = """\
# a comment with = and [brackets]
top = "a # no comment \\" ]"
[study]
title = '''
two = 1
lines''' # after
"quoted.key" = [1,
  "],", # ] here
  { a = 3, b.c = "}" },
]

[cases . "s 4"]
sensors = { n_sensors = 4, noise = 0.02 }  # inline
a.b = 1979-05-27T07:32:00Z
a.'c' = \"\"\"x
= \\\""" y\"\"\"\"\"
a.d = [[true, false],
       []]
[[many]]
x = 1
[[many]]
y = 2
"""


def test_lines_counted_by_hand():
    lines = key_lines(TEXT)
    assert {path: lines[path] for path in lines if path[0] != "many"} == {
        ("top",): 2,
        ("study",): 3,
        ("study", "title"): 4,
        ("study", "quoted.key"): 7,
        ("study", "quoted.key", 0): 7,
        ("study", "quoted.key", 1): 8,
        ("study", "quoted.key", 2): 9,
        ("study", "quoted.key", 2, "a"): 9,
        ("study", "quoted.key", 2, "b"): 9,
        ("study", "quoted.key", 2, "b", "c"): 9,
        ("cases",): 12,
        ("cases", "s 4"): 12,
        ("cases", "s 4", "sensors"): 13,
        ("cases", "s 4", "sensors", "n_sensors"): 13,
        ("cases", "s 4", "sensors", "noise"): 13,
        ("cases", "s 4", "a"): 14,
        ("cases", "s 4", "a", "b"): 14,
        ("cases", "s 4", "a", "c"): 15,
        ("cases", "s 4", "a", "d"): 17,
        ("cases", "s 4", "a", "d", 0): 17,
        ("cases", "s 4", "a", "d", 0, 0): 17,
        ("cases", "s 4", "a", "d", 0, 1): 17,
        ("cases", "s 4", "a", "d", 1): 18,
    }
    assert lines["many", "y"] == 22


def paths(value, path=()):
    if isinstance(value, dict):
        for key, item in value.items():
            yield (*path, key)
            yield from paths(item, (*path, key))
    elif isinstance(value, list):
        for number, item in enumerate(value):
            yield (*path, number)
            yield from paths(item, (*path, number))


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_every_key_of_the_reader_has_a_line(end):
    text = TEXT.partition("[[many]]")[0].replace("\n", end)
    assert set(key_lines(text)) == set(paths(tomllib.loads(text)))


def test_a_key_that_is_not_there_has_the_line_of_its_table():
    lines = key_lines("\n[a]\nb = 1\n")
    assert line_of(lines, ("a", "c", "d")) == 2
    assert line_of(lines, ("x",)) is None
    assert line_of(lines, ()) is None


@pytest.mark.parametrize(
    "text", ["", "\n", "# only\n", "a=1", "a = 1 # x", "[t]", "a = {}", "a=[]"]
)
def test_small_texts(text):
    assert set(key_lines(text)) == set(paths(tomllib.loads(text)))
