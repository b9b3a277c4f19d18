import importlib.util
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def fake():
    """The module of the fake trial, which is also a script."""
    path = Path(__file__).with_name("fake_trial.py")
    spec = importlib.util.spec_from_file_location("fake_trial", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["fake_trial"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def run(fake):
    """Run a plan into the store of a folder; returns outcome and digest."""
    from sdnn.experiments import ResultStore, run_trials

    def _run(folder, plan=None, make_trial=fake.FakeTrial, **options):
        with ResultStore(folder) as store:
            outcome = run_trials(
                fake.make_plan() if plan is None else plan,
                store,
                make_trial,
                version=fake.VERSION,
                **options,
            )
            return outcome, store.content_digest()

    return _run
