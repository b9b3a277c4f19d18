"""The library's own exceptions, of all its modules."""

import contextlib
import copy
import importlib
import inspect
import pickle
import pkgutil

import pytest

import sdnn


def modules():
    for info in pkgutil.walk_packages(sdnn.__path__, "sdnn."):
        if not info.name.rpartition(".")[2].startswith("_"):
            with contextlib.suppress(ModuleNotFoundError):  # an extra that is not installed
                yield importlib.import_module(info.name)


def error_classes():
    return {
        value
        for module in modules()
        for name, value in vars(module).items()
        if inspect.isclass(value)
        and issubclass(value, Exception)
        and value.__module__.startswith("sdnn.")
        and not name.startswith("_")
    }


@pytest.mark.parametrize("copied", [copy.copy, lambda error: pickle.loads(pickle.dumps(error))])
def test_errors_equal_their_copies_and_pickles(copied):
    # An error that cannot be unpickled would end a pool of processes without its message.
    classes = error_classes()
    assert {"ConfigError", "StoreError", "UnusableStepError"} <= {
        error_class.__name__ for error_class in classes
    }
    for error_class in classes:
        defines_init = inspect.isfunction(error_class.__init__)
        names = list(inspect.signature(error_class).parameters) if defines_init else ["message"]
        error = error_class(*(f"the {name}" for name in names))
        copy_ = copied(error)
        assert type(copy_) is error_class
        assert str(copy_) == str(error), error_class
        assert vars(copy_) == vars(error), error_class
