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
def use_trial(monkeypatch, fake):
    """Let every agent run in trials of another kind."""
    from sdnn.experiments import AGENTS

    def _use(core_trial):
        for name, entry in fake.agents_with(core_trial).items():
            monkeypatch.setitem(AGENTS, name, entry)

    return _use


@pytest.fixture
def run(fake, use_trial):
    """Run a plan into the store of a folder, with fake trials; returns outcome and digest."""
    from sdnn.experiments import ResultStore, run_trials
    from sdnn.experiments.records import records_digest

    def _run(folder, plan=None, trial=fake.FakeTrial, **options):
        use_trial(trial)
        with ResultStore(folder) as store:
            outcome = run_trials(fake.make_plan() if plan is None else plan, store, **options)
            return outcome, records_digest(store.load())

    return _run
