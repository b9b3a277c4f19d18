"""Packages that load their names when they are first used."""

import doctest
import importlib
import subprocess
import sys

import pytest

from sdnn import lazy

PACKAGES = ("sdnn", "sdnn.estimators", "sdnn.reproduction", "sdnn.runs")


@pytest.mark.parametrize("name", PACKAGES)
def test_every_public_name_is_there(name):
    package = importlib.import_module(name)
    for public in package.__all__:
        assert getattr(package, public) is not None, public
    assert set(package.__all__) <= set(dir(package))
    with pytest.raises(AttributeError, match="nothing"):
        package.nothing  # noqa: B018


def test_importing_the_package_loads_nothing_large():
    code = (
        "import sys, sdnn\n"
        "large = {'gymnasium', 'numpy', 'sklearn', 'sdnn.runs', 'sdnn.reproduction'}\n"
        "print(large & {*sys.modules})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_docstrings():
    assert doctest.testmod(lazy) == (0, 3)
