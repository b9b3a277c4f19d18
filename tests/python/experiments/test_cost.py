import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from sdnn.benchmarks.agent_cost import measure_steps
from sdnn.experiments import CostConfig, Observer, ResultStore, StoreError, draw_cost
from sdnn.experiments.cost import QUICK_COST, SERIES, StepTimes, cost_keys, measure_costs
from sdnn.experiments.tables import cost_header, cost_rows

SMALL = CostConfig(n_inputs=(3, 2), n_rounds=3, round_seconds=0.001, min_steps=1)


class FakeMeasure:
    """Times that grow fourfold with each input; notes what it is asked."""

    def __init__(self, ends_after=math.inf):
        self.asked = []
        self._last = ends_after

    def __call__(self, series, n_inputs, config):
        self.asked.append((series.id, n_inputs))
        if n_inputs > self._last:
            return None
        times = 4.0**n_inputs * np.arange(1, config.n_rounds + 1)
        return StepTimes(microseconds=times, n_steps=5, table_bytes=9**n_inputs)


def measured(folder, measure, config=SMALL):
    with ResultStore(folder) as store:
        measure_costs(config, store, measure, version="1", machine="m", observer=Observer())
        return store.load_costs(config.config_hash)


def test_keys_are_all_series_in_ascending_inputs():
    keys = cost_keys(SMALL)
    assert [(key.series, key.n_inputs) for key in keys] == [
        (series.id, n) for series in SERIES for n in (2, 3)
    ]
    assert {key.config_hash for key in keys} == {SMALL.config_hash}
    quick = cost_keys(QUICK_COST)
    assert max(key.n_inputs for key in quick if key.series == "rbfn-plain") == 5
    assert len(quick) == 3 * 7 + 4
    assert replace(SMALL, n_rounds=4).config_hash != SMALL.config_hash
    assert CostConfig().n_inputs == tuple(range(2, 9))
    assert asdict(QUICK_COST)["n_inputs"] == asdict(CostConfig())["n_inputs"]


def test_what_is_stored_is_not_measured_again(tmp_path):
    class KilledError(Exception):
        pass

    class Dies(FakeMeasure):
        def __call__(self, series, n_inputs, config):
            if len(self.asked) == 3:
                raise KilledError
            return super().__call__(series, n_inputs, config)

    with pytest.raises(KilledError):
        measured(tmp_path, Dies())
    second = FakeMeasure()
    costs = measured(tmp_path, second)
    assert second.asked == [(s.id, n) for s in SERIES for n in (2, 3)][3:]
    assert len(costs) == 8
    third = FakeMeasure()
    again = measured(tmp_path, third)
    assert third.asked == []
    assert [cost.key for cost in again] == [cost.key for cost in costs]
    np.testing.assert_array_equal(costs[0].microseconds, [16.0, 32.0, 48.0])
    assert (costs[0].times.n_steps, costs[0].times.table_bytes) == (5, 81)


def test_settings_of_costs_live_side_by_side(tmp_path):
    measured(tmp_path, FakeMeasure())
    other = replace(SMALL, n_rounds=5)
    assert [c.microseconds.size for c in measured(tmp_path, FakeMeasure(), other)] == [5] * 8
    with ResultStore(tmp_path) as store:
        assert len(store.load_costs(SMALL.config_hash)) == 8
        assert store.content_digest() == ResultStore(tmp_path / "empty").content_digest()


def test_damaged_costs_are_named(tmp_path):
    measured(tmp_path, FakeMeasure())
    with ResultStore(tmp_path) as store:
        store._connection.execute("UPDATE costs SET microseconds = 'x'")
        store._connection.commit()
        with pytest.raises(StoreError, match=r"results\.sqlite is damaged"):
            store.load_costs(SMALL.config_hash)


def test_table_gives_times_and_growth(tmp_path):
    rows = cost_rows(measured(tmp_path, FakeMeasure(ends_after=2)))
    assert [row[0] for row in rows] == ["2"]
    rows = cost_rows(measured(tmp_path / "all", FakeMeasure()))
    assert cost_header()[1:] == (*(s.title for s in SERIES), "FQL's table")
    assert rows[0][1] == "32 us [24 us, 40 us]"
    assert rows[1][1] == "128 us [96 us, 160 us], 4.0x"
    assert rows[1][-1] == "729 B"


def test_figure_holds_the_stored_rows(tmp_path):
    costs = measured(tmp_path, FakeMeasure())
    (axes,) = draw_cost(costs).axes
    assert axes.get_yscale() == "log"
    lines = [line for line in axes.get_lines() if len(line.get_xdata()) == 2]
    np.testing.assert_allclose(lines[0].get_ydata(), [32.0, 128.0])
    assert "quick" in json.dumps([t.get_text() for t in draw_cost(costs, quick=True).axes[0].texts])


@pytest.mark.parametrize("series", SERIES, ids=lambda series: series.id)
def test_real_agents_are_measured(series):
    times = measure_steps(series, 2, SMALL)
    assert times.microseconds.shape == (3,)
    assert (times.microseconds > 0).all()
    assert times.n_steps >= 1
    sizes = {"sdnn-c": 2 * 200 * 900, "fql": 9**2 * 21 * 4, "rbfn": 4**3 * 8}
    assert times.table_bytes == sizes[series.agent]


def test_what_there_is_no_memory_for_is_left_out(monkeypatch):
    def refuse(*_arguments, **_options):
        raise MemoryError

    monkeypatch.setattr("sdnn.benchmarks.agent_cost.FuzzyQLearning", refuse)
    assert measure_steps(SERIES[1], 2, SMALL) is None


def test_unknown_series_is_named():
    with pytest.raises(ValueError, match="got 'tiles'"):
        measure_steps(replace(SERIES[0], id="tiles"), 2, SMALL)
