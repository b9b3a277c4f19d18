"""The page about what the agent of a run has learned."""

import json
import re
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from sdnn.runs import Run, RunError
from sdnn.runs.inspection import inspect_run

MOST_BYTES = 2 * 10**6  # of a page: a chosen limit


class DockEnv(gym.Env):
    """Move a point to 0; the observed gear and colour are random and have no effect."""

    observation_space = gym.spaces.Dict(
        colour=gym.spaces.Discrete(3),
        gear=gym.spaces.Discrete(2),
        position=gym.spaces.Box(-2.0, 2.0, (2,)),
    )
    action_space = gym.spaces.Box(-1.0, 1.0, (2,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._position = self.np_random.uniform(-1.0, 1.0, 2)
        return self._observation(), {}

    def step(self, action):
        self._position = np.clip(self._position + 0.2 * np.asarray(action, float), -2.0, 2.0)
        return self._observation(), -float(np.abs(self._position).sum()), False, False, {}

    def _observation(self):
        colour, gear = (int(self.np_random.integers(n)) for n in (3, 2))
        return {"colour": colour, "gear": gear, "position": self._position.astype(np.float32)}


class MaskedEnv(gym.Env):
    """Each step costs 1; action 2 is always masked, and the second observation is constant."""

    observation_space = gym.spaces.Box(0.0, 1.0, (2,))
    action_space = gym.spaces.Discrete(3)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self._observation(), self._info()

    def step(self, action):
        assert action != 2
        return self._observation(), -1.0, False, False, self._info()

    def _info(self):
        return {"action_mask": np.array([1, 1, 0], np.int8)}

    def _observation(self):
        return np.array([self.np_random.random(), 0.25], np.float32)


gym.register("tests/Masked-v0", entry_point=MaskedEnv, max_episode_steps=20)
gym.register("tests/Dock-v0", entry_point=DockEnv, max_episode_steps=50)

TASKS = {  # the name and the type of one of the inputs
    "CartPole-v1": ("observation 0", "variable"),
    "Pendulum-v1": ("angle of observation 0 and 1", "angle"),
    "MountainCar-v0": ("observation 1", "variable"),
    max(name for name in gym.registry if name.startswith("Taxi-v")): ("observation", "symbol"),
    "tests/Dock-v0": ("position[1]", "variable"),
}


@pytest.fixture
def trained(output_of):
    """Train a short run and return its folder."""

    def _trained(task, *options, steps=2500):
        arguments = ("train", task, "--steps", steps, "--evaluate-every", 1000, "--out", "run")
        output_of(*arguments, "--evaluation-episodes", 2, *options)
        return Path("run")

    return _trained


@pytest.mark.parametrize("task", TASKS)
def test_the_page_is_small_and_self_contained(output_of, trained, task):
    folder = trained(task)
    before = (folder / "checkpoint.safetensors").read_bytes()
    printed = output_of("inspect", folder, "--json")
    input_types = {i["name"]: i["type"] for i in json.loads(printed)["inputs"]}
    name, input_type = TASKS[task]
    assert input_types[name] == input_type
    page = (folder / "inspect.html").read_text()
    assert len(page) < MOST_BYTES
    # Four figures, each with a variant for narrow screens; nothing is loaded from elsewhere.
    assert page.count("<img") == page.count("<source media=") == 4
    assert not re.search(r"""(?:src|href)\s*=\s*["'](?!data:)""", page)
    assert not re.search(r"<script|@import|url\((?!data:)", page)
    assert task in page
    assert (folder / "checkpoint.safetensors").read_bytes() == before


def test_the_table_and_the_warnings_are_printed(output_of, trained):
    folder = trained("MountainCar-v0", "--agent", "sdnn-c", steps=300)
    printed = output_of("inspect", folder, "--input", "0", "--out", "page.html")
    assert "observation 1" in printed
    assert printed.splitlines()[-1] == "wrote page.html"
    page = Path("page.html").read_text()
    for words in ("mean size of corrections", "step of values", "share changed"):
        assert words in page
    assert "Values and actions over observation 0<" in page
    for warning in inspect_run(Run.open(folder)).warnings():
        assert warning.split(":")[0] in page


def test_the_map_is_over_the_named_inputs_and_the_episode_follows_from_the_seed(output_of, trained):
    folder, seed = trained("CartPole-v1"), 4
    options = ("--input", "observation 3", "--input", 0, "--json", "--seed", seed)
    values = json.loads(output_of("inspect", folder, *options))
    assert values["map_of"] == ["observation 3", "observation 0"]
    returns = Run.open(folder).evaluate(1, seed).returns
    assert values["episode"]["return"] == returns[0]
    assert values == json.loads(output_of("inspect", folder, *options))


def test_wrong_options_are_named(invoke, refused, trained):
    folder = trained("CartPole-v1")
    assert "--input" in refused("inspect", folder, "--input", "speed", code=2)
    three = [word for number in range(3) for word in ("--input", number)]
    assert "--input" in refused("inspect", folder, *three, code=2)
    assert "page.pdf" in refused("inspect", folder, "--out", "page.pdf", code=2)
    assert "keep-best" in refused("inspect", folder, "--best", code=1)


def test_an_agent_that_is_warming_up_is_refused(trained):
    folder = trained("CartPole-v1", steps=200)  # fewer than the 1,000 of its warm-up
    with pytest.raises(RunError, match="warming up"):
        inspect_run(Run.open(folder))


def test_inputs_that_are_left_out_are_in_the_table_without_influence(trained):
    folder = trained("tests/Dock-v0", steps=2500)
    inspection = inspect_run(Run.open(folder))
    table = inspection.input_table()
    left_out = {i.input.name for i in inspection.influences if not i.input.is_used}
    assert "colour" in left_out
    notes = {name: note for name, *_, note in table.rows}
    assert all(notes[name].startswith("left out") for name in left_out)
    assert inspection.influences[-1].on_values == 0.0, "sorted: those without influence are last"


def test_warnings_name_narrow_use_collapse_and_rounded_rewards(trained):
    folder = trained("CartPole-v1", "--range", "1=-500:500", steps=2500)
    inspection = inspect_run(Run.open(folder))
    narrow = [text for text in inspection.warnings() if text.startswith("observation 1 uses only")]
    assert len(narrow) == 1
    evaluations = [
        {"kind": "evaluation", "step": step, "mean_return": mean, "episode": step}
        for step, mean in ((1, 10.0), (2, 500.0), (3, 20.0))
    ]
    collapsed = replace(inspection, rows=evaluations)
    assert any("--keep-best" in text for text in collapsed.warnings())
    # A reward of 1 is two units of values, where fewer than 1,000 are warned of.
    coarse = {**inspection.report, "value_unit": 0.5, "recent_reward": 1.0}
    rounded = replace(inspection, report=coarse)
    assert any("rounded" in text for text in rounded.warnings())


def test_warnings_name_constant_inputs_and_maps_leave_out_masked_actions(trained):
    masks = ("--set", "environment.action_masks=true", "--set", "agent.inputs=all")
    inspection = inspect_run(Run.open(trained("tests/Masked-v0", *masks, steps=1500)))
    warnings = inspection.warnings()
    assert "observation 1 is constant: the agent can do without it." in warnings
    assert not any("uses only" in text for text in warnings)
    assert not any("mask" in text for text in warnings)
    # The last of the actions 0, 1 and 2 is always masked.
    assert set(np.unique(inspection.state_map.actions)) <= {0.0, 1.0}
    assert set(np.unique(inspection.episode.actions)) <= {0.0, 1.0}
    assert "a mask allowed in the nearest state" in inspection.page().to_html("")
    table = inspection.input_table()
    met = {row[0]: row[table.header.index("met")] for row in table.rows}
    assert met["observation 1"] == "0.25"
