"""Packages that load their names when they are first used."""

import ast
import compileall
import importlib
import shutil
from pathlib import Path

import pytest

import sdnn
from processes import python
from sdnn import _core

PACKAGES = ("sdnn", "sdnn.estimators", "sdnn.reproduction", "sdnn.runs")


@pytest.mark.parametrize("name", PACKAGES)
def test_public_names_are_importable_listed_and_in_the_stub(name):
    package = importlib.import_module(name)
    for public in package.__all__:
        assert getattr(package, public) is not None, public
    stub = ast.parse(Path(package.__file__).with_suffix(".pyi").read_text("utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    in_stub = {alias.asname for node in imports for alias in node.names}
    assert set(package.__all__) == set(dir(package)) == in_stub
    with pytest.raises(AttributeError, match="nothing"):
        package.nothing  # noqa: B018


def test_importing_sdnn_imports_no_large_package():
    code = (
        "import sys, sdnn\n"
        "large = {'click', 'gymnasium', 'joblib', 'matplotlib', 'numpy', 'pandas', 'pygame', "
        "'rich', 'safetensors', 'scipy', 'sklearn', 'sdnn.runs', 'sdnn.reproduction'}\n"
        "print(large & {*sys.modules})"
    )
    assert python("-c", code).stdout == "set()\n"


def test_an_installation_with_bytecode_but_no_sources_works(tmp_path):
    folder = Path(sdnn.__file__).parent
    shutil.copytree(folder, tmp_path / "sdnn", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(_core.__file__, tmp_path / "sdnn")
    compileall.compile_dir(tmp_path / "sdnn", quiet=1, legacy=True)
    for source in [*(tmp_path / "sdnn").rglob("*.py"), *(tmp_path / "sdnn").rglob("*.pyi")]:
        source.unlink()
    code = f"""
import sys
sys.path.insert(0, {str(tmp_path)!r})
sys.meta_path[:] = sys.meta_path[-3:]  # Python's finders, without that of an editable install
import sdnn, sdnn.runs, sdnn.reproduction
assert sdnn.__file__.endswith('.pyc')
print(sdnn.runs.BudgetSpec().steps, sdnn.SDNNRegressor(), sdnn.SDNNKernelRidge())
"""
    process = python("-c", code)
    assert process.stdout == "None SDNNRegressor() SDNNKernelRidge()\n", process.stderr
