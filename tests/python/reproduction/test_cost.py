"""Times of a step by the number of inputs: how they are planned, stored and shown."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from refusals import refuses
from sdnn import _core
from sdnn.reproduction import CostConfig, draw_cost
from sdnn.reproduction.cost import (
    QUICK_COST,
    SERIES,
    cost_series,
    load_costs,
    measure_costs,
    measure_steps,
    planned_costs,
)
from sdnn.reproduction.report import cost_table
from sdnn.runs import ResultStore, StoreError
from sdnn.support import machine

SMALL = CostConfig(n_inputs=(3, 2), n_rounds=3, round_seconds=0.001)


class FakeMeasure:
    """Give times that grow fourfold with each input, and none beyond a number of inputs."""

    def __init__(self, most_inputs=math.inf):
        self.requested = []
        self._most_inputs = most_inputs

    def __call__(self, series, n_inputs, config):
        self.requested.append((series.id, n_inputs))
        if n_inputs > self._most_inputs:
            return None
        microseconds = 4.0**n_inputs * np.arange(1, config.n_rounds + 1)
        n_steps, table_bytes = 5, 9**n_inputs
        return tuple(microseconds.tolist()), n_steps, table_bytes


@pytest.fixture
def measured(monkeypatch):
    """Measure all costs with a fake measure; return the stored records."""

    def _measured(folder, measure, config=SMALL):
        monkeypatch.setattr("sdnn.reproduction.cost.measure_steps", measure)
        with ResultStore(folder) as store:
            measure_costs(planned_costs(config), config, store, lambda _: None)
            return load_costs(store, config.config_hash)

    return _measured


def test_planned_costs_are_all_series_with_ascending_inputs():
    planned = planned_costs(SMALL)
    assert [*planned.values()] == [(series, n) for series in SERIES for n in (2, 3)]
    assert all(SMALL.config_hash in key for key in planned)
    assert replace(SMALL, n_rounds=4).config_hash != SMALL.config_hash


def test_quick_costs_omit_the_plain_rbf_network_of_more_than_five_inputs():
    assert QUICK_COST.n_inputs == CostConfig().n_inputs == tuple(range(2, 9))
    quick = planned_costs(QUICK_COST)
    assert max(n for series, n in quick.values() if series.id == "rbf-plain") == 5
    assert len(quick) == 3 * 7 + 4  # three series of 2 to 8 inputs and this one of 2 to 5


def test_stored_measurements_are_not_repeated(tmp_path, measured):
    class KilledError(Exception):
        pass

    class Dies(FakeMeasure):
        def __call__(self, *arguments):
            if len(self.requested) == 3:
                raise KilledError
            return super().__call__(*arguments)

    with pytest.raises(KilledError):
        measured(tmp_path, Dies())
    second = FakeMeasure()
    costs = measured(tmp_path, second)
    assert second.requested == [(s.id, n) for s in SERIES for n in (2, 3)][3:]
    assert len(costs) == 2 * len(SERIES)
    third = FakeMeasure()
    assert measured(tmp_path, third) == costs
    assert third.requested == []
    np.testing.assert_array_equal(costs[0].microseconds, 4.0**2 * np.array([1, 2, 3]))  # 2 inputs
    assert (costs[0].n_steps, costs[0].table_bytes) == (5, 9**2)
    assert {cost.machine for cost in costs} == {machine.description()}
    assert {cost.version for cost in costs} == {_core.__version__}


def test_costs_of_different_settings_are_stored_separately(tmp_path, measured):
    measured(tmp_path, FakeMeasure())
    n_costs = 2 * len(SERIES)  # of 2 and 3 inputs
    of_other = measured(tmp_path, FakeMeasure(), replace(SMALL, n_rounds=5))
    assert [len(c.microseconds) for c in of_other] == [5] * n_costs
    with ResultStore(tmp_path) as store:
        assert len(load_costs(store, SMALL.config_hash)) == n_costs
        assert store.load() == (), "costs are no trials"


def test_costs_of_another_machine_or_version_are_measured_again(tmp_path, measured, monkeypatch):
    measured(tmp_path, FakeMeasure())
    another = (machine, "description", lambda: "another"), (_core, "__version__", "9.9.9")
    for module, name, value in another:
        with monkeypatch.context() as patched:
            patched.setattr(module, name, value)
            measure = FakeMeasure()
            assert len(measured(tmp_path, measure)) == len(measure.requested) == 2 * len(SERIES)


def test_damaged_costs_are_named(tmp_path, measured):
    measured(tmp_path, FakeMeasure())
    with ResultStore(tmp_path) as store:
        store._connection.execute("UPDATE measurements SET content = 'x'")
        store._connection.commit()
        refuses("results.sqlite", load_costs, store, SMALL.config_hash, error=StoreError)


def test_the_table_of_costs_has_no_row_of_inputs_that_were_not_measured(tmp_path, measured):
    rows = cost_table(measured(tmp_path, FakeMeasure(most_inputs=2))).rows
    assert [row[0] for row in rows] == ["2"]


def test_the_table_of_costs_gives_medians_quartiles_and_growth(tmp_path, measured):
    # The three times of 2 inputs are 16, 32 and 48, those of 3 inputs four times as long.
    table = cost_table(measured(tmp_path / "all", FakeMeasure()))
    rows = table.rows
    assert table.header[1:] == (*(s.title for s in SERIES), "FQL's table")
    assert rows[0][1] == "32 us [24, 40]"
    assert rows[1][1] == "128 us [96, 160], 4.0x"
    assert rows[1][-1] == "0.000729 MB"  # 9^3 bytes


def test_the_figure_of_costs_shows_the_stored_medians(tmp_path, measured):
    costs = measured(tmp_path, FakeMeasure())
    (axes,) = draw_cost(costs).axes
    assert axes.get_yscale() == "log"
    lines = [line for line in axes.get_lines() if len(line.get_xdata()) == 2]
    np.testing.assert_allclose(lines[0].get_ydata(), [2 * 4.0**2, 2 * 4.0**3])  # of 3 rounds
    assert "quick" in json.dumps([t.get_text() for t in draw_cost(costs, quick=True).axes[0].texts])


@pytest.mark.parametrize("series", SERIES, ids=[series.id for series in SERIES])
def test_every_series_measures_a_real_agent_and_its_table(series):
    microseconds, n_steps, table_bytes = measure_steps(series, 2, SMALL)
    assert len(microseconds) == 3
    assert min(microseconds) > 0
    assert n_steps >= 1
    # Bytes for two inputs. SDNN-C: one for each weight of 900 units, of two pairs of 200 columns.
    # Fuzzy: 9 sets for each input, 21 actions of 4 bytes. RBF: 4 bases for each input and the
    # action, of 8 bytes.
    sizes = {"sdnn-c": 2 * 200 * 900, "fuzzy": 9**2 * 21 * 4, "rbf": 4**3 * 8}
    assert table_bytes == sizes[series.agent]


def test_agents_that_exceed_the_memory_are_omitted():
    def refuse(*_arguments, **_options):
        raise MemoryError

    (series,) = cost_series(["fuzzy"])
    assert measure_steps(replace(series, core_agent=refuse), 2, SMALL) is None


def test_costs_may_be_limited_to_some_agents():
    series_ids = {series.id for series, _ in planned_costs(SMALL, ["rbf"]).values()}
    assert series_ids == {"rbf", "rbf-plain"}
    refuses("tiles", planned_costs, SMALL, ["tiles"])


def test_timed_agents_learn_reproducibly_by_seed():
    def weights(agent_class, seed):
        rbf = _core.RBFNetworkConfig(n_inputs=2, n_actions=21)
        agent = agent_class(approximator=rbf, learning=_core.QLearningConfig(), seed=5)
        n_steps = 40
        assert (_core.time_agent_steps(agent, n_steps, seed) > 0).all()
        return (agent.networks[0] if agent_class is _core.BareAgent else agent.network).weights()

    first, plain = weights(_core.BareAgent, 1), weights(_core.PlainRBFQLearning, 1)
    np.testing.assert_array_equal(first, weights(_core.BareAgent, 1))
    assert (first != weights(_core.BareAgent, 2)).any()
    np.testing.assert_allclose(plain, first, rtol=0, atol=1e-10)
