"""The engine runs planned trials in parallel and stores them."""

import io
import os
import signal
import time
from dataclasses import replace

import pytest
from rich.console import Console

import fake_trial
from sdnn.reproduction import EXPERIMENTS, plan_trials
from sdnn.runs import ResultStore, StoreError, WorkerLostError, run_trials
from sdnn.runs.engine import (
    MOST_TOGETHER,
    Advanced,
    Failed,
    Finished,
    Noted,
    PlannedTrial,
    ThreadExecutor,
    TrialBars,
    run_to_end,
    teams_of,
)
from sdnn.runs.trial import TrialRows, records_digest


def test_the_number_of_jobs_does_not_change_the_stored_rows(tmp_path, run):
    digests = {run(tmp_path / str(jobs), executor=ThreadExecutor(jobs))[1] for jobs in (1, 2, 5)}
    assert len(digests) == 1


def plan_of_small_agents(n_trials, n_episodes):
    """Plan trials of three agents in each of the four cases of the second experiment."""
    cases = EXPERIMENTS[1].with_agents(["fuzzy", "sdnn-c", "rbf"]).cases
    return plan_trials(cases, n_trials, root_seed=0, n_episodes=n_episodes)


def test_teams_have_one_agent_each_and_shrink_as_jobs_increase():
    plan = plan_of_small_agents(n_trials=3, n_episodes=40)
    n_of_agent = 4 * 3  # trials: three in each of four cases
    teams = teams_of(plan, 2)
    assert {planned for team in teams for planned in team} == set(plan)
    # Each trial of sdnn-c runs alone, as it would not be faster in a team; those of fuzzy and of
    # rbf are divided over two jobs.
    assert sorted(map(len, teams)) == [1] * n_of_agent + [n_of_agent // 2] * 2 * 2
    assert all(len({planned.key.agent for planned in team}) == 1 for team in teams)
    assert max(map(len, teams_of(plan, 1))) == MOST_TOGETHER
    assert max(map(len, teams_of(plan, n_of_agent))) == 1


def test_trials_with_most_inputs_begin_first(tmp_path):
    plan = plan_of_small_agents(n_trials=2, n_episodes=20)
    begun = {}

    def observe(message):
        if isinstance(message, Advanced):
            begun.setdefault(message.planned.key)

    with ResultStore(tmp_path) as store:
        run_trials(plan, store, executor=ThreadExecutor(1), observer=observe)
    keys = [key for key in begun if key.agent == "sdnn-c"]
    n_inputs = [int(key.case_id[1]) for key in keys]  # the case "s4" has 4 inputs
    assert n_inputs == sorted(n_inputs, reverse=True)


def test_trials_run_in_teams_have_the_rows_of_trials_run_alone(tmp_path):
    plan = plan_of_small_agents(n_trials=1, n_episodes=60)
    with ResultStore(tmp_path) as store:
        assert run_trials(plan, store, executor=ThreadExecutor(1)).n_run == len(plan)
        records = {record.key: record for record in store.load()}
    for planned in plan:
        *_, (_, alone) = run_to_end(planned)  # its last message is Finished(planned, record)
        record = records[planned.key]
        assert record.rows.digest() == alone.rows.digest()
        assert record.n_decisions == alone.n_decisions
        assert record.seconds > 0


def test_a_trial_that_fails_in_a_team_does_not_affect_the_others(tmp_path, monkeypatch):
    plan = plan_of_small_agents(n_trials=1, n_episodes=20)
    spec = plan[0].spec
    kwargs = spec.environment.kwargs
    acrobot = kwargs["acrobot"] | {"goal_reward": 1e39, "penalty": 1e39}  # over a float's range
    environment = spec.environment.replace(kwargs=kwargs | {"acrobot": acrobot})
    bad = PlannedTrial(plan[0].key, spec.replace(environment=environment))
    good = plan[3]  # fuzzy again, in the next case
    monkeypatch.setattr("sdnn.runs.engine.teams_of", lambda planned, jobs: [planned])  # one team
    with ResultStore(tmp_path) as store:
        outcome = run_trials([bad, good], store, executor=ThreadExecutor(1))
    assert outcome.n_run == 1
    assert [f.planned for f in outcome.failures] == [bad]


def test_stored_trials_are_not_run_again(tmp_path, run):
    run_seeds = []

    def make(*, seed, **parts):
        run_seeds.append(seed)
        return fake_trial.FakeTrial(seed=seed, **parts)

    run(tmp_path, fake_trial.make_plan(2), make)
    assert len(run_seeds) == 2 * len(fake_trial.CASES) == 4
    outcome, digest = run(tmp_path, fake_trial.make_plan(3), make)
    # Three trials of two cases, of which two each are stored.
    assert (outcome.n_planned, outcome.n_reused, outcome.n_run) == (6, 4, 2)
    assert len(run_seeds) == 6
    assert run(tmp_path, fake_trial.make_plan(3), make) == (
        type(outcome)(n_planned=6, n_reused=6, n_run=0, failures=(), interrupted=False),
        digest,
    )
    assert len(run_seeds) == 6


@pytest.mark.parametrize("change", [{"root_seed": 1}, {"n_episodes": 310}])
def test_trials_of_another_seed_or_length_are_run_again(tmp_path, run, change):
    plan = fake_trial.make_plan()
    run(tmp_path, plan)
    outcome, _ = run(tmp_path, fake_trial.make_plan(**change))
    assert outcome.n_run == len(plan)


def test_the_observer_receives_begin_progress_and_end_of_every_trial(tmp_path, run):
    recorder = fake_trial.Recorder()
    run(tmp_path, fake_trial.make_plan(2), observer=recorder)
    # Two trials of each of two cases, no stored ones, and all their episodes.
    assert recorder.events[0] == ("begun", 2 * 2, 0, 2 * 2 * 300)
    for planned in fake_trial.make_plan(2):
        mine = [event for event in recorder.events[1:] if event[1] == planned.key]
        assert mine[0] == ("advanced", planned.key, 0)
        assert mine[-1][0] == "finished"
        episodes = [event[2] for event in mine if event[0] == "advanced"]
        assert episodes == sorted(episodes)
        assert episodes[-1] == 300


def test_a_failing_trial_does_not_stop_the_others_and_is_run_again(tmp_path, run):
    plan = fake_trial.make_plan()

    def make(*, seed, **parts):
        if seed == plan[0].key.seed:
            raise RuntimeError("broken")
        return fake_trial.FakeTrial(seed=seed, **parts)

    recorder = fake_trial.Recorder()
    outcome, _ = run(tmp_path, plan, make, observer=recorder)
    assert outcome.n_run == len(plan) - 1
    assert [(f.planned.key, str(f.error)) for f in outcome.failures] == [(plan[0].key, "broken")]
    assert ("failed", plan[0].key) in recorder.events
    assert run(tmp_path, plan)[0].n_run == 1


@pytest.mark.parametrize("exception", [SystemExit, KeyboardInterrupt, GeneratorExit])
def test_a_trial_that_raises_an_exit_or_interrupt_fails(tmp_path, run, exception):
    class Leaving(fake_trial.FakeTrial):
        def __init__(self, **_parts):
            raise exception("left")

    outcome, _ = run(tmp_path, None, Leaving)
    assert outcome.n_run == 0
    assert not outcome.interrupted
    assert {str(f.error) for f in outcome.failures} == {f"the trial raised {exception('left')!r}"}


def test_ctrl_c_keeps_finished_trials_and_the_next_run_resumes(tmp_path, run):
    # Ctrl-C comes while the second trial runs: it is abandoned, the first stays stored.
    begun_seeds = []
    before = signal.getsignal(signal.SIGINT)

    class Interrupting(fake_trial.FakeTrial):
        sent = False

        def __init__(self, *, seed, **parts):
            super().__init__(seed=seed, **parts)
            begun_seeds.append(seed)

        def advance(self, n):
            if len(begun_seeds) < 2:
                super().advance(n)
            elif not self.sent:  # from here on it never ends by itself
                self.sent = True
                os.kill(os.getpid(), signal.SIGINT)
            else:
                time.sleep(0.001)

    outcome, _ = run(tmp_path, None, Interrupting, executor=ThreadExecutor(1))
    assert outcome.interrupted
    assert outcome.n_run == 1
    assert signal.getsignal(signal.SIGINT) is before
    resumed, digest = run(tmp_path)
    assert resumed.n_run == len(fake_trial.make_plan()) - 1
    assert digest == run(tmp_path / "whole")[1]


def test_an_error_of_the_store_stops_the_run(tmp_path, use_trial):
    class Full(ResultStore):
        def add(self, record, *, is_exact=True):
            raise StoreError("disk full")

    begun_seeds = []

    class Counted(fake_trial.SlowTrial):
        def __init__(self, *, seed, **parts):
            super().__init__(seed=seed, **parts)
            begun_seeds.append(seed)

    use_trial(Counted)
    plan = fake_trial.make_plan(10, 50)
    with Full(tmp_path) as store, pytest.raises(StoreError, match="disk full"):
        run_trials(plan, store, executor=ThreadExecutor(1))
    assert len(begun_seeds) < len(plan)


class Scripted:
    """Executor that runs nothing: functions of the planned trials make the messages it reports."""

    def __init__(self, *script):
        self.script = script
        self.closed = False

    def run(self, planned, stop):
        try:
            yield from ([message(*planned)] for message in self.script)
        finally:
            self.closed = True


@pytest.fixture
def record(tmp_path, run):
    """The record of the first trial of the plan `make_plan(1)`, from another folder."""
    run(tmp_path / "other", fake_trial.make_plan(1))
    with ResultStore(tmp_path / "other") as store:
        return store.load([fake_trial.make_plan(1)[0].key])[0]


LOST = WorkerLostError("a lost worker")


@pytest.fixture
def restarting(record):
    """An executor whose first trial starts again and finishes, and whose second trial fails."""
    return Scripted(
        lambda first, second: Noted("a note"),
        lambda first, second: Advanced(first, 0),
        lambda first, second: Advanced(first, 100),
        lambda first, second: Advanced(first, 0),  # episodes: it starts again
        lambda first, second: Failed(second, LOST),
        lambda first, second: Finished(first, record),
    )


def test_observers_receive_the_reports_of_an_executor_in_order(tmp_path, run, restarting):
    plan = fake_trial.make_plan(1)[::-1]  # the order in which they begin
    recorder = fake_trial.Recorder()
    outcome, _ = run(tmp_path, plan, executor=restarting, observer=recorder)
    assert (outcome.n_run, outcome.interrupted) == (1, False)
    assert [(f.planned.key, f.error) for f in outcome.failures] == [(plan[1].key, LOST)]
    first, second = (planned.key for planned in plan)
    assert recorder.events[1:] == [
        ("noted", "a note"),
        ("advanced", first, 0),
        ("advanced", first, 100),
        ("advanced", first, 0),
        ("failed", second),
        ("finished", first),
    ]


def test_progress_bars_show_notes_and_the_trials_that_are_left(tmp_path, run, restarting):
    text = io.StringIO()
    with TrialBars(Console(file=text, force_terminal=True, width=80)) as observer:
        run(tmp_path, fake_trial.make_plan(1), executor=restarting, observer=observer)
    assert "a note" in text.getvalue()
    assert "all (0 to go)" in text.getvalue()


def test_an_executor_is_closed_when_the_store_fails(tmp_path, run, record, monkeypatch):
    def full(store, record, *, is_exact=True):
        raise StoreError("disk full")

    executor = Scripted(
        lambda first, _: Finished(first, record), lambda *_: pytest.fail("resumed after an error")
    )
    monkeypatch.setattr(ResultStore, "add", full)
    with pytest.raises(StoreError, match="disk full"):
        run(tmp_path, fake_trial.make_plan(1), executor=executor)
    assert executor.closed, "its generator has ended"


def test_trials_that_end_together_are_stored_in_one_transaction(tmp_path, run, use_trial):
    use_trial(fake_trial.FakeTrial)
    plan = fake_trial.make_plan(2)
    numbers_stored = []

    class AllAtOnce(ThreadExecutor):
        def run(self, planned, stop):
            yield [message for batch in super().run(planned, stop) for message in batch]

    with ResultStore(tmp_path / "out") as store:

        def count_stored(message):
            if isinstance(message, Finished):
                numbers_stored.append(len(store.keys()))

        statements = []
        store._connection.set_trace_callback(statements.append)
        run_trials(plan, store, executor=AllAtOnce(1), observer=count_stored)
        assert records_digest(store.load()) == run(tmp_path / "one by one", plan)[1]
    assert numbers_stored == [len(plan)] * len(plan)
    assert statements.count("COMMIT") == 1


def test_a_trial_that_cannot_be_stored_loses_none_that_ended_before_it(tmp_path, run, record):
    plan = fake_trial.make_plan(1)
    run(tmp_path / "out", plan[1:])
    (stored,) = records_of(tmp_path / "out")
    table = stored.rows.table.copy()
    table["length"] += 1
    other = replace(stored, rows=TrialRows(table))

    class AllAtOnce(Scripted):
        def run(self, planned, stop):
            yield [Finished(plan[0], record), Finished(plan[1], other)]

    with ResultStore(tmp_path / "out") as store:
        store.keys = set  # as if another process had stored the second one meanwhile
        with pytest.raises(StoreError, match="two results"):
            run_trials(plan, store, executor=AllAtOnce())
    assert {record.key for record in records_of(tmp_path / "out")} == {p.key for p in plan}


def records_of(folder):
    """Return the stored trials of a folder."""
    with ResultStore(folder, read_only=True) as store:
        return store.load()


def test_an_empty_plan_runs_no_executor(tmp_path, run):
    executor = Scripted(lambda: pytest.fail("was run"))
    assert run(tmp_path, [], executor=executor)[0].n_planned == 0
