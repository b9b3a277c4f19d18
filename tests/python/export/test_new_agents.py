"""New agents for small processors, in Python and by the command."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn.agents import SDNNActorCritic, SDNNQLambda, SDNNQLearning
from sdnn.approximators import LinearSDNNConfig, SDNNCConfig
from sdnn.export import c_header, export_c_header, new_agent

SPACE = gym.spaces.Box(np.array([-2.0, -np.pi]), np.array([1.0, np.pi]), dtype=np.float64)
TWO_ACTIONS = gym.spaces.Discrete(2)
RANGES = ("--range", "-2:1", "--range", "angle")
SDNN_C = (*RANGES, "--actions", "2", "--agent", "sdnn-c")


@pytest.fixture
def export(invoke):
    return lambda *arguments: invoke("export", *arguments, "--c-header", "agent.h")


@pytest.mark.parametrize("ram_bytes", [14_000, 20_000, 10**6])
@pytest.mark.parametrize("actions", [TWO_ACTIONS, gym.spaces.MultiDiscrete([3, 4])])
@pytest.mark.parametrize("kind", ["q-lambda", "actor-critic"])
def test_a_new_linear_agent_is_the_largest_that_fits_the_memory(kind, ram_bytes, actions):
    settings = {"kind": kind, "seed": 3}
    agent = new_agent(SPACE, actions, ram_bytes=ram_bytes, **settings)
    n_units = agent.approximator.n_pattern_units
    assert c_header(agent, "agent", learning=True).ram_bytes <= ram_bytes
    larger = LinearSDNNConfig(n_pattern_units=n_units + 16)  # the next candidate; 768 is the last
    header = c_header(
        new_agent(SPACE, actions, approximator=larger, **settings), "a", learning=True
    )
    assert header.ram_bytes > ram_bytes or n_units == 768


@pytest.mark.parametrize(("ram_bytes", "n_hidden"), [(9000, 75), (30_000, 300), (10**6, 900)])
def test_a_new_network_is_the_largest_that_fits_the_memory(ram_bytes, n_hidden):
    agent = new_agent(SPACE, TWO_ACTIONS, kind="sdnn-c", ram_bytes=ram_bytes, seed=3)
    sizes = agent.approximator
    assert (sizes.n_hidden_units, sizes.n_active_units) == (n_hidden, n_hidden // 3)
    # Patterns of the preset `small` have 40 units; hidden units, in twelfths of its 900, are added
    # only to full patterns.
    assert sizes.n_pattern_units == 40 if n_hidden > 75 else 15 <= sizes.n_pattern_units < 40
    assert c_header(agent, "agent", learning=True).ram_bytes <= ram_bytes


def test_a_new_network_keeps_its_sizes_and_draws_first_weights_in_c():
    small = SDNNQLearning.presets["small"].approximator
    config = replace(small, n_pattern_units=16, averaging_interval=0, weight_limit=127)
    agent = new_agent(SPACE, TWO_ACTIONS, kind="sdnn-c", ram_bytes=10**6, approximator=config)
    assert agent.approximator.n_pattern_units == 16
    assert agent.learning == SDNNQLearning.presets["small"].learning
    text = c_header(agent, "agent", learning=True).text
    assert "agent_first_weights[" not in text  # drawn on the chip


def test_a_new_network_may_have_three_active_units():
    few = {"n_pattern_units": 4, "n_hidden_units": 8, "n_active_units": 3}
    config = SDNNCConfig(**few, averaging_interval=0, weight_limit=127)
    agent = new_agent(SPACE, TWO_ACTIONS, kind="sdnn-c", ram_bytes=10**6, approximator=config)
    assert agent.approximator.n_active_units == 3


def test_new_agents_keep_sizes_seed_and_angles():
    config = LinearSDNNConfig(n_pattern_units=100, averaging_interval=0)
    agent = new_agent(SPACE, TWO_ACTIONS, approximator=config, angles=[1], seed=5)
    assert (agent.approximator.n_pattern_units, agent.seed) == (100, 5)
    assert [(kind, list(at)) for kind, at in agent.inputs] == [("variable", [0]), ("circular", [1])]


def test_new_agents_without_memory_or_ranges_are_refused():
    refuses("ram_bytes", new_agent, SPACE, TWO_ACTIONS, ram_bytes=1000)
    refuses("ram_bytes", new_agent, SPACE, TWO_ACTIONS, ram_bytes=1.5)
    refuses("ram_bytes", new_agent, SPACE, TWO_ACTIONS, kind="sdnn-c", ram_bytes=5000)
    larger = LinearSDNNConfig(n_pattern_units=512)
    refuses("ram_bytes", new_agent, SPACE, TWO_ACTIONS, ram_bytes=20_000, approximator=larger)
    refuses("kind", new_agent, SPACE, TWO_ACTIONS, kind="rbf")
    for kind, config in (("q-lambda", SDNNCConfig()), ("sdnn-c", LinearSDNNConfig())):
        settings = {"kind": kind, "approximator": config}
        refuses("approximator", new_agent, SPACE, TWO_ACTIONS, **settings, error=TypeError)
    unknown = gym.spaces.Box(-np.inf, np.inf, (2,))
    refuses("observation_range", new_agent, unknown, TWO_ACTIONS, error=RuntimeError)
    known = new_agent(unknown, TWO_ACTIONS, observation_range=([-1, -1], [1, 1]))
    assert c_header(known, "agent", learning=True).ram_bytes <= 20_000


@pytest.mark.parametrize(
    ("kind", "options", "arguments", "least_bytes", "most_bytes"),
    [
        (
            "q-lambda",
            ("--ram", 9000, "--seed", 7, "--missing", "hold"),
            {"ram_bytes": 9000, "seed": 7, "missing": "hold"},
            0,
            9000,
        ),
        # By default linear agents may take 20 kB of memory, networks 60 kB.
        ("actor-critic", ("--agent", "actor-critic"), {}, 15_000, 20_000),
        ("sdnn-c", ("--agent", "sdnn-c"), {}, 50_000, 60_000),
    ],
)
def test_the_command_exports_the_agent_that_new_agent_makes(
    kind, options, arguments, least_bytes, most_bytes, export, tmp_path
):
    settings = ("--set", "approximator.n_actions=3", "--set", "learning.discount=0.9")
    done = export("--new", *RANGES, "--actions", "-1:1", *options, *settings)
    assert done.exit_code == 0, done.output
    classes = {"actor-critic": SDNNActorCritic, "sdnn-c": SDNNQLearning, "q-lambda": SDNNQLambda}
    preset = classes[kind].presets["small" if kind == "sdnn-c" else "general"]
    config = replace(preset.approximator, n_actions=3)
    if kind == "sdnn-c":  # learning in C needs small weights without averages
        config = replace(config, averaging_interval=0, weight_limit=127)
    agent = new_agent(
        SPACE, gym.spaces.Box(-1.0, 1.0, (1,), np.float64), kind=kind, angles=[1],
        approximator=config, learning=replace(preset.learning, discount=0.9), **arguments,
    )  # fmt: skip
    expected = c_header(agent, "agent", learning=True)
    assert (tmp_path / "agent.h").read_text() == expected.text
    assert f"{expected.ram_bytes:,} bytes of memory" in done.stdout
    assert least_bytes < expected.ram_bytes <= most_bytes


@pytest.mark.parametrize(
    ("actions", "space"),
    [
        (["3"], gym.spaces.Discrete(3)),
        (["3", "5"], gym.spaces.MultiDiscrete([3, 5])),
        (["-1:1", "0:2"], gym.spaces.Box(np.array([-1.0, 0.0]), np.array([1.0, 2.0]), dtype=float)),
    ],
)
def test_the_actions_option_accepts_counts_and_ranges(actions, space, export, tmp_path):
    options = [part for action in actions for part in ("--actions", action)]
    done = export("--new", *RANGES, *options)
    assert done.exit_code == 0, done.output
    agent = new_agent(SPACE, space, angles=[1])
    assert (tmp_path / "agent.h").read_text() == c_header(agent, "agent", learning=True).text


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ((), "--range"),
        (RANGES, "--actions"),
        (("--actions", "2"), "--range"),
        *((("--actions", 2, "--range", text), "--range") for text in ("1:1", "2:1", "nan:1", "0",
          "x:y", "0:inf", "-1e300:1", "0:1:2", "")),
        *(((*RANGES, "--actions", text), "--actions") for text in ("1", "0", "-3", "1.5", "9" * 8,
          "9" * 400, "", "x", "1:0", "0:inf", "0:1:2", "\N{SUPERSCRIPT TWO}")),
        ((*RANGES, "--actions", "2", "--actions", "0:1"), "--actions"),
        ((*RANGES, "--actions", "2", "--ram", "500"), "--ram must be at least"),
        ((*RANGES, "--actions", "2", "--ram", "x"), "--ram"),
        ((*RANGES, "--actions", "2", "--agent", "rbf"), "--agent"),
        ((*SDNN_C, "--ram", 5000), "--ram must be at least"),
        ((*RANGES, "--actions", "2", "--seed", "-1"), "--seed"),
        *(((*RANGES, "--actions", "2", "--set", text), "--set") for text in ("learning",
          "learning.x=1", "budget.steps=3", "learning.=3", "learning.discount=2",
          "learning.discount=x", "approximator.n_inputs=3", "approximator.n_pattern_units=-1")),
        ((*SDNN_C, "--set", "approximator.averaging_interval=9"), "averaging_interval"),
        ((*SDNN_C, "--set", "approximator.weight_limit=0"), "weight_limit"),
        ((*SDNN_C, "--set", "learning.traces=dutch"), "--set"),
        ((*SDNN_C, "--set", "ram=9000"), "did you mean --ram?"),
        ((*SDNN_C, "--set", "learning.ram=9000"), "did you mean --ram?"),
        ((*RANGES, "--actions", "2", "--actions", "3", "--agent", "sdnn-c"), "--actions"),
        ((*RANGES, "--actions", "65536"), "--ram"),
    ],
)  # fmt: skip
def test_bad_options_of_new_agents_are_refused_by_name(words, named, export, tmp_path):
    done = export("--new", *words)
    assert done.exit_code == 2, done.output
    assert named in done.stderr
    assert not (tmp_path / "agent.h").exists()


def test_export_refuses_a_run_together_with_options_of_new_agents(export):
    SDNNQLambda(SPACE, TWO_ACTIONS, inputs="all", angle_pairs=[]).save("one.safetensors")
    for words, named in (
        ((), "RUN"),
        (("one.safetensors", "--new", *RANGES, "--actions", 2), "omit one.safetensors"),
        *((("one.safetensors", *more), more[0]) for more in (("--range", "0:1"), ("--actions", 2),
          ("--ram", 9000), ("--seed", 0), ("--set", "learning.discount=0.5"),
          ("--agent", "sdnn-c"))),
    ):  # fmt: skip
        done = export(*words)
        assert (done.exit_code, done.stdout) == (2, ""), done.output
        assert named in done.stderr
    assert export("one.safetensors", "--learning").exit_code == 0


def test_a_single_pattern_unit_is_refused_by_the_option_that_gave_it(refused):
    option = ("--set", "approximator.n_pattern_units=1")
    new = ("export", "--new", "--range", "0:1", "--actions", 2, "--c-header", "a.h")
    for command in (new, ("train", "CartPole-v1")):
        assert option[0] + " approximator.n_pattern_units" in refused(*command, *option, code=2)
    few = LinearSDNNConfig(n_pattern_units=1)
    refuses("n_pattern_units", SDNNQLambda, SPACE, TWO_ACTIONS, approximator=few)


def test_the_command_warns_of_ranges_that_fixed_point_hardly_resolves(invoke):
    new = ("export", "--new", "--actions", 2, "--c-header", "a.h", "--range", "0:1")
    assert "warning" not in invoke(*new, "--range", "-0.01:0.01").output
    amperes = invoke(*new, "--range", "0:0.0001")
    assert amperes.exit_code == 0
    # 0.0001 2^16 = 6.55
    expected = (
        "warning: observation[1], from 0 to 0.0001, has a range of only 6.6 times 2^-16: observe it"
        " in another unit, or with more --fraction-bits\n"
    )
    assert amperes.output.count("warning") == 1
    assert expected in amperes.stderr
    assert "warning" not in invoke(*new, "--range", "0:0.0001", "--fraction-bits", 24).output
    # 10^9 leaves a bit, and 2 steps from 0 to 1
    assert "observation[0], from 0 to 1," in invoke(*new, "--range", "0:1e9").output


def test_python_warns_of_ranges_that_fixed_point_hardly_resolves(tmp_path):
    motor = gym.spaces.Box(-4e-6, 4e-6, (1,), np.float64)
    agent = new_agent(gym.spaces.Box(0.0, 1.0, (1,)), motor)  # no warning
    # 8 10^-6 2^16 = 0.524
    message = (
        r"action\[0\], from -4e-06 to 4e-06, has a range of only 0.52 times 2\^-16: give it in"
        " another unit, or with more fraction_bits"
    )
    for make in (c_header, lambda agent, name: export_c_header(agent, tmp_path / f"{name}.h")):
        with pytest.warns(UserWarning, match=message) as warned:
            make(agent, "motor")
        assert [warning.filename for warning in warned] == [__file__]
    export_c_header(agent, tmp_path / "motor.h", fraction_bits=24)  # no warning
