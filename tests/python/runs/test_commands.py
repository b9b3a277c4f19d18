"""Commands for runs: train, resume, evaluate, plot, record and export."""

import csv
import json
import pickle
import re
import signal
import subprocess
import sys
import time
import traceback
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import drifting_env
from processes import environment
from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.agents import RBFQLearning, SDNNQLearning, Training, evaluate, load_agent
from sdnn.cli.common import WARMING_UP, value_of
from sdnn.environments import UnitSensors
from sdnn.export import c_header, estimator_header
from sdnn.export.estimators import CODE_BYTES
from sdnn.runs import AGENTS, Run, RunSpec

SMALL = (
    "--agent", "sdnn-c", "--set", "approximator.n_hidden_units=60",
    "--set", "approximator.n_active_units=20",
    "--set", "approximator.n_pattern_units=20", "--set", "agent.warm_up_steps=60",
)  # fmt: skip
SHORT = ("--steps", 150, "--evaluate-every", 70, "--evaluation-episodes", 2, *SMALL)
DRIFTING = "drifting_env:tests/Drifting-v0"


@pytest.fixture
def trained(output_of):
    """The folder of a short run, "run"."""
    output_of("train", DRIFTING, *SHORT, "--out", "run")
    return Path("run")


def test_train_prints_a_summary_and_the_next_commands(invoke):
    result = invoke("train", DRIFTING, *SHORT, "--seed", 3)  # 150 steps, evaluated every 70
    assert result.exit_code == 0, result.output
    assert result.stderr == "", "no progress bar where there is no terminal"
    folder = Path("runs/drifting_env-tests-Drifting-v0-sdnn-c-3")
    lines = result.stdout.splitlines()
    assert lines[0].startswith(f"{folder}: 150 steps, ")
    assert lines[1].startswith("last evaluation, after 140 steps: mean return ")
    assert "corrections" in lines[2]
    assert lines[-5] == "next:"
    commands = [line.partition("  #")[0].strip() for line in lines[-4:]]
    assert commands == [
        f"sdnn evaluate {folder}", f"sdnn plot {folder}", f"sdnn inspect {folder}",
        f"sdnn record {folder} x.gif",
    ]  # fmt: skip


def test_evaluate_prints_the_returns_of_an_evaluation(output_of, trained):
    evaluate = ("evaluate", trained, "--json", "--episodes")
    printed = json.loads(output_of(*evaluate, 3, "--seed", 9))
    returns = Run.open(trained).evaluate(3, 9).returns
    assert printed["returns"] == returns.tolist()
    assert printed["mean_return"] == pytest.approx(returns.mean())
    assert printed["range"] == [returns.min(), returns.max()]
    text = output_of("evaluate", trained, "--episodes", 3)
    assert text.startswith(f"{trained}: mean return ")
    assert json.loads(output_of(*evaluate, 1))["standard_deviation"] is None


def test_plot_writes_a_figure_and_the_numbers_of_its_curves(output_of, trained):
    figure, numbers = trained / "curves.png", trained / "curves.csv"
    written = output_of("plot", trained)
    assert str(figure) in written
    assert str(numbers) in written
    drawn = list(csv.DictReader(numbers.read_text().splitlines()))
    rows = Run.open(trained).rows()
    for kind, row_kind, name in (
        ("evaluation", "evaluation", "mean_return"), ("return", "episode", "return"),
    ):  # fmt: skip
        values = [float(point["value"]) for point in drawn if point["kind"] == kind]
        assert values == [row[name] for row in rows if row["kind"] == row_kind]
    assert figure.stat().st_size > 10_000, "bytes of a picture that is not empty"
    assert "x.svg" in output_of("plot", trained, "--out", "x.svg")


def test_record_writes_a_gif_of_the_requested_steps(output_of, trained, tmp_path):
    printed = output_of("record", trained, "x.gif", "--steps", 4)
    assert printed.startswith("wrote x.gif: 5 frames, return ")  # of the reset and 4 steps
    assert (tmp_path / "x.gif").read_bytes().startswith(b"GIF89a")


@pytest.mark.filterwarnings("ignore:.*render_mode")
def test_record_refuses_environments_that_cannot_be_rendered(output_of, refused, tmp_path):
    printed = output_of("train", "drifting_env:tests/Unseen-v0", *SHORT, "--out", "one")
    proposed_commands = printed.rpartition("next:")[2]
    assert "sdnn plot one" in proposed_commands
    assert "record" not in proposed_commands
    error = refused("record", "one", "x.gif", code=1)
    assert "drifting_env:tests/Unseen-v0 cannot be rendered" in error
    assert not (tmp_path / "x.gif").exists()


def test_export_writes_the_c_header_of_a_run_or_an_agent_file(invoke, output_of, tmp_path):
    output_of("train", DRIFTING, *SHORT, "--seed", 3, "--out", "run")
    result = invoke("export", "run", "--c-header", "drift.h")
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    agent = Run.open("run").agent()
    assert Path("drift.h").read_text() == c_header(agent, "drift").text
    assert result.stdout.startswith("wrote drift.h: ")
    options = ("--name", "mine", "--fraction-bits", 12, "--json")
    printed = json.loads(
        output_of("export", "run/agent.safetensors", "--c-header", "b.h", *options)
    )
    header = c_header(agent, "mine", fraction_bits=12)
    assert Path("b.h").read_text() == header.text
    assert (printed["file"], printed["name"], printed["fraction_bits"]) == ("b.h", "mine", 12)
    assert printed["flash_bytes"] == header.flash_bytes
    assert "text" not in printed


def test_export_with_learning_writes_the_header_of_a_linear_agent(output_of):
    options = ("--agent", "q-lambda", "--steps", 150, "--evaluate-every", 0, "--out", "one")
    warm_up = ("--set", "agent.warm_up_steps=60")
    output_of("train", DRIFTING, *options, *warm_up)
    printed = output_of("export", "one", "--c-header", "drift.h", "--learning")
    header = c_header(Run.open("one").agent(), "drift", learning=True)
    assert Path("drift.h").read_text() == header.text
    assert f"{header.ram_bytes:,} bytes of memory" in printed


def test_export_of_an_estimator_writes_its_c_header_and_refuses_bad_options(output_of, refused):
    X = np.random.default_rng(0).uniform(size=(60, 2))
    settings = {"n_pattern_units": 32, "max_iter": 3, "random_state": 0}
    models = {
        "regressor": SDNNRegressor(n_output_units=20, **settings).fit(X, X[:, 0]),
        "classifier": SDNNClassifier(n_units_per_class=5, **settings).fit(X, X[:, 0] > 0.5),
    }
    for name, model in models.items():
        model.save(f"{name}.safetensors")
        for learning in (False, True):
            options = ["--c-header", f"{name}.h", *(["--learning"] if learning else [])]
            printed = output_of("export", f"{name}.safetensors", *options)
            header = estimator_header(model, name, learning=learning)
            assert Path(f"{name}.h").read_text() == header.text
            assert f"{header.flash_bytes:,} bytes of constants" in printed
    limits = ("--flash", 10_000, "--c-header", "a.h")
    printed = json.loads(output_of("export", "regressor.safetensors", *limits, "--json"))
    ram_bytes = estimator_header(models["regressor"], "a").ram_bytes
    assert (printed["file"], printed["name"], printed["ram_bytes"]) == ("a.h", "a", ram_bytes)
    for arguments, words in (
        (["--flash", 5000], f"--flash must be at least {printed['flash_bytes'] + CODE_BYTES}, for"),
        (["--fraction-bits", 8], "--fraction-bits is for agents"),
        (["--name", "1"], "--name must be a C identifier"),
    ):
        error = refused("export", "regressor.safetensors", "--c-header", "b.h", *arguments, code=2)
        assert words in error
    assert not Path("b.h").exists()


def test_export_with_learning_refuses_a_network_without_a_weight_limit(refused, trained):
    error = refused("export", trained, "--c-header", "b.h", "--learning", code=1)
    assert "approximator.weight_limit=127" in error
    assert not Path("b.h").exists()


def test_export_refuses_agents_trained_with_action_masks(output_of, refused):
    options = ("--agent", "q-lambda", "--steps", 60, "--evaluate-every", 0, "--out", "one")
    masks = ("--set", "environment.action_masks=true")
    taxi = "Taxi-v4" if "Taxi-v4" in gym.registry else "Taxi-v3"  # Gymnasium before 1.3 has v3
    output_of("train", taxi, *options, *masks)
    for source in ("one", "one/agent.safetensors"):
        error = refused("export", source, "--c-header", "a.h", code=1)
        assert "learned without action masks" in error
        assert not Path("a.h").exists()


SCALED = ("--noise", 0.01, "--redundant", 1, "--range", "-4:4", "--range", "1=-2:3")
SCALED_LINES = [
    "observation[0]: variable 0, from -4.0 to 4.0",
    "observation[1]: variable 1, from -2.0 to 3.0",
    "observation[2]: the mean of observation[0] and observation[1]",
]


def test_train_and_export_state_the_scaling_of_observations(output_of):
    printed = output_of("train", DRIFTING, *SHORT, *SCALED, "--out", "one")
    assert "0 from -4 to 4, 1 from -2 to 3, and means of neighbours (1)" in printed
    assert "sdnn.runs.Run.open('one').spec.make_env()" in printed
    for source in ("one", "one/agent.safetensors", "one/checkpoint.safetensors"):
        printed = output_of("export", source, "--c-header", "a.h")
        _file_and_memory, _introduction, *scaling = printed.splitlines()
        assert [line.strip() for line in scaling] == SCALED_LINES
        text = Path("a.h").read_text()
        assert text == c_header(Run.open("one").agent(), "a").text
        introduction, scaling = text.split(" */\n", 1)[0].split(" *\n")  # of the first comment
        assert introduction.startswith("/* What this policy observes is scaled, ")
        assert [line.removeprefix(" *   ") for line in scaling.splitlines()] == SCALED_LINES
    printed = json.loads(output_of("export", "one", "--c-header", "a.h", "--json"))
    assert printed["scaling"] == {"ranges": [[-4.0, 4.0], [-2.0, 3.0]], "redundant": 1}


def test_a_copied_agent_file_keeps_the_scaling_of_its_run(output_of):
    output_of("train", DRIFTING, *SHORT, *SCALED, "--out", "one")
    Path("agent.safetensors").write_bytes(Path("one/agent.safetensors").read_bytes())
    Path("config.json").write_text("a file of another program, which must not be read")
    printed = json.loads(output_of("export", "agent.safetensors", "--c-header", "a.h", "--json"))
    assert printed["scaling"] == {"ranges": [[-4.0, 4.0], [-2.0, 3.0]], "redundant": 1}
    assert all(line in Path("a.h").read_text() for line in SCALED_LINES)

    agent = load_agent("agent.safetensors")
    environment = Run.open("one").spec.environment
    assert agent.scaling == pickle.loads(pickle.dumps(agent)).scaling == environment.scaling()
    assert evaluate(agent, environment.make(), 1).lengths.size == 1
    unscaled_env = gym.make("tests/Drifting-v0")
    refuses("UnitSensors", evaluate, agent, unscaled_env)
    refuses("UnitSensors", agent.train, unscaled_env, steps=1)


def test_unit_sensors_with_the_stated_scaling_fit_the_agent(output_of):
    noisy = ("--noise", 0.01, "--range", "-4:4")
    output_of("train", DRIFTING, *SHORT, *noisy, "--out", "one")
    agent = load_agent("one/agent.safetensors")
    env = UnitSensors(gym.make("tests/Drifting-v0"), *agent.scaling.ends)
    assert evaluate(agent, env, 1).lengths.size == 1
    agent.scaling = None  # the bounds of observations still differ: [0, 1] and unbounded
    refuses("env", evaluate, agent, gym.make("tests/Drifting-v0"), 1)
    refuses("scaling", setattr, agent, "scaling", 0, error=TypeError)


def test_a_run_is_exported_where_its_environment_cannot_be_made(output_of):
    output_of("train", DRIFTING, *SHORT, *SCALED, "--out", "one")
    path = Path("one/config.json")
    path.write_text(path.read_text().replace("Drifting-v0", "Gone-v0"))
    assert SCALED_LINES[0] in output_of("export", "one", "--c-header", "a.h")


def test_errors_of_export_name_option_or_file_and_write_nothing(refused, tmp_path):
    space = gym.spaces.Box(-1.0, 1.0, (2,))
    SDNNQLearning(space, space).save("sdnn.safetensors")
    RBFQLearning(space, gym.spaces.Box(-1.0, 1.0, (1,))).save("rbf.safetensors")
    # Without bounds of observations, their ranges are unknown until the end of a warm-up.
    SDNNQLearning(gym.spaces.Box(-np.inf, np.inf, (2,)), space).save("unsettled.safetensors")
    Path("damaged").write_text("no agent")
    Path("folder").mkdir()
    before = sorted(tmp_path.iterdir())
    for arguments, code, words in (
        (["sdnn.safetensors"], 2, "Missing option '--c-header'"),
        (["nowhere", "--c-header", "a.h"], 2, "'nowhere' does not exist"),
        (["sdnn.safetensors", "--c-header", "folder"], 2, "is a directory"),
        (["sdnn.safetensors", "--c-header", "not-c.h"], 2, "--name, which must be a C identifier"),
        (["sdnn.safetensors", "--c-header", "a.h", "--name", "1"], 2, "--name must be a C ident"),
        (["sdnn.safetensors", "--c-header", "a.h", "--fraction-bits", 31], 2, "--fraction-bits"),
        (["rbf.safetensors", "--c-header", "a.h"], 1, "must be an SDNNQLearning"),
        (["unsettled.safetensors", "--c-header", "a.h"], 1, "warm"),
        (["damaged", "--c-header", "a.h"], 1, "damaged"),
        (["folder", "--c-header", "a.h"], 1, "folder"),
        (["sdnn.safetensors", "--c-header", "no/a.h"], 1, "no/a.h"),
    ):
        assert words in refused("export", *arguments, code=code)
    assert sorted(tmp_path.iterdir()) == before


def test_plot_draws_several_runs_as_one_curve(output_of, tmp_path):
    for seed in (1, 2):
        output_of("train", DRIFTING, *SHORT, "--seed", seed)
    folders = sorted((tmp_path / "runs").iterdir())
    repeated = folders[0]
    assert "curves.png and curves.csv" in output_of("plot", *folders, repeated)
    drawn = list(csv.DictReader(Path("curves.csv").read_text().splitlines()))
    assert {(point["kind"], point["n_runs"], point["run"]) for point in drawn} == {
        ("evaluation", "2", ""), ("running median", "2", ""),
        *(("return", "1", str(folder)) for folder in folders),
    }  # fmt: skip


def test_plot_draws_goals_random_actions_and_baselines(output_of, refused, tmp_path):
    training = ("CartPole-v1", "--steps", 300, "--evaluate-every", 100, "--out", "pole")
    output_of("train", *training)

    def levels(*options):
        output_of("plot", "pole", *options)
        rows = csv.DictReader(Path("pole/curves.csv").read_text().splitlines())
        return [row["kind"] for row in rows if not row["step"]]

    assert levels() == ["goal", "random actions"]
    # With --plain, without the lines of the goal and of random actions.
    assert levels("--plain", "--baseline", "PPO", "--baseline", "RBFN") == ["PPO", "RBFN"]
    message = refused("plot", "pole", "--baseline", "nobody", code=2)
    assert "--baseline: " in message
    assert "'PPO', 'SAC'" in message


def test_plot_names_runs_without_rows(invoke, output_of):
    output_of("train", DRIFTING, *SHORT, "--out", "run1")
    config = json.loads(output_of("train", DRIFTING, *SHORT, "--seed", 2, "--dry-run"))
    del config["folder"]
    Path("run2").mkdir()
    Path("run2/config.json").write_text(json.dumps(config))  # a run that has not begun
    result = invoke("plot", "run1", "run2")
    assert (result.exit_code, "curves.png" in result.stdout) == (0, True)
    assert "run2" in result.stderr
    assert "run1" not in result.stderr


def test_train_dry_run_prints_the_configuration_and_writes_nothing(output_of, tmp_path):
    printed = output_of(
        "train", "CartPole-v1", "--agent", "sdnn-c", "--preset", "robust", "--episodes", 7,
        "--noise", 0.1, "--redundant", 2, "--range", "-4:4", "--range", "1=-3:3",
        "--set", "learning.discount=0.5", "--set", "learning.tie_rule=middle",
        "--set", "approximator.circular=[true, false]", "--env-arg", "max_episode_steps=50",
        "--evaluate-every", 0, "--checkpoint-every", 5, "--dry-run", "--set",
        "approximator.circular=[]",
    )  # fmt: skip
    values = json.loads(printed)
    assert values.pop("folder") == "runs/CartPole-v1-sdnn-c-0"
    assert values["environment"] == {
        "id": "CartPole-v1",
        "kwargs": {"max_episode_steps": 50},
        "ranges": {"all": [-4.0, 4.0], "1": [-3.0, 3.0]},
        "noise": 0.1,
        "redundant": 2,
    }
    assert values["learning"] == {"discount": 0.5, "tie_rule": "middle"}
    assert values["agent"] == {"name": "sdnn-c", "preset": "robust"}
    assert (values["budget"], values["protocol"]) == ({"episodes": 7}, {"evaluate_every": 0})
    assert values["output"] == {"checkpoint_every": 5}
    assert "approximator" not in values, "the last --set of `circular` is the default"
    assert list(tmp_path.iterdir()) == []


def test_angle_pairs_find_makes_the_angle_of_pendulum_circular(output_of):
    output_of(
        "train", "Pendulum-v1", "--steps", 70, "--angle-pairs", "find", "--out", "one", *SMALL
    )
    assert Run.open("one").agent().approximator.circular == (True, False)  # angle, speed


def test_options_override_the_configuration_file(output_of, tmp_path):
    (tmp_path / "mine.toml").write_text(
        'environment = "CartPole-v1"\nbudget.steps = 5\nseed = 8\nagent = "sdnn-c-robust"\n'
        "[learning]\ndiscount = 0.5\nepsilon = 0.2\n"
    )
    command = ("train", "--config", "mine.toml", "--dry-run")
    values = json.loads(output_of(*command))
    assert (values["environment"]["id"], values["seed"]) == ("CartPole-v1", 8)
    assert values["budget"] == {"steps": 5}
    values = json.loads(
        output_of(*command, "Acrobot-v1", "--episodes", 6, "--set", "learning.epsilon=0.3")
    )
    assert values["environment"]["id"] == "Acrobot-v1"
    assert (values["budget"], values["agent"]["preset"]) == ({"episodes": 6}, "robust")
    assert values["learning"] == {"discount": 0.5, "epsilon": 0.3}
    values = json.loads(output_of(*command, "--agent", "rbf"))
    assert values["agent"] == {"name": "rbf"}
    output_of("train", "--config", "mine.toml", "--out", "one", *SMALL)
    again = json.loads(output_of("train", "--config", "one/config.json", "--dry-run"))
    assert again.pop("folder") == "runs/CartPole-v1-sdnn-c-8"
    assert RunSpec.from_values(again) == Run.open("one").spec


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--steps", 9, "--set", "budget.steps=7"], ["--set budget.steps", "--steps", "7", "9"]),
        (["--set", "environment.id="], ["--set environment.id", "ENV_ID", "''", "CartPole-v1"]),
        (["--range", "0:1", "--set", "environment.ranges.all=[0, 2]"], ["--range all", "[0, 2]"]),
        (["--agent", "rbf", "--set", "agent.name=rbf"], ["--set agent.name", "--agent"]),
    ],
)
def test_two_options_for_one_setting_are_refused(refused, options, words):
    error = refused("train", "CartPole-v1", *options, "--dry-run", code=2)
    assert all(word in error for word in words), error


def test_an_environment_module_may_register_an_agent(output_of, tmp_path, monkeypatch):
    (tmp_path / "my_room.py").write_text(
        "import gymnasium as gym\nfrom dataclasses import replace\n"
        "from sdnn.runs import AGENTS, register\n"
        "register(replace(AGENTS['rbf'], id='roomy', core_trial=None))\n"
        "gym.register('my/Room-v0', 'drifting_env:DriftingEnv', max_episode_steps=40)\n"
    )
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    short = ("--steps", 60, "--evaluate-every", 50, "--set", "agent.warm_up_steps=20")
    try:
        output_of("train", "my_room:my/Room-v0", "--agent", "roomy", *short, "--out", "one")
        # In a new process, resuming has to import the module again.
        del AGENTS["roomy"], sys.modules["my_room"], gym.registry["my/Room-v0"]
        output_of("resume", "one", "--steps", 70)
    finally:
        AGENTS.pop("roomy", None)
        sys.modules.pop("my_room", None)
        gym.registry.pop("my/Room-v0", None)


def test_configuration_files_must_be_toml_or_json(refused, tmp_path):
    (tmp_path / "mine.sh").write_text("echo")
    for command in (["train", "--config", "mine.sh"], ["sweep", "mine.sh"]):
        assert re.search(r"mine\.sh: .*\.toml or \.json", refused(*command, code=2))


def test_train_with_n_envs_learns_in_several_environments(output_of):
    printed = output_of("train", DRIFTING, *SHORT, "--n-envs", 4, "--out", "four", "--json")
    assert json.loads(printed)["n_steps"] == 150
    run = Run.open("four")
    assert run.spec.protocol.n_envs == 4
    environments = {row["environment"] for row in run.rows() if row["kind"] == "episode"}
    assert len(environments) > 1
    assert environments <= {0, 1, 2, 3}
    output_of("resume", "four", "--steps", 170)
    output_of("plot", "four")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--agent fuzzy", "ENV_ID: action_space must be a Box"),
        ("--agent rbf --preset paper", "--preset: must be omitted"),
        ("--steps 5 --episodes 5", "--episodes: must not be given together with steps"),
        ("--noise 0.1", "--range 1: must be given"),
        ("--redundant 5000 --range 0:1", "--redundant"),
        ("--range 5", "--range must be [VARIABLE=]LOW:HIGH, adaptive or running, got '5'"),
        ("--range 0=adaptive", "--range must be [VARIABLE=]LOW:HIGH, adaptive or running"),
        ("--range adaptive --range 0:1", "--range: must not be given together"),
        ("--range 4:3", "--range all: must be finite, low < high"),
        ("--range 9=3:4", "--range 9: CartPole-v1 has the variables 0 to 3"),
        ("--set learning.discount", "--set must be NAME=VALUE"),
        ("--set discount=1", "--set discount: must be TABLE.NAME"),
        ("--set learning.discont=1", "--set learning.discont: unknown"),
        ("--set gamma=1", "did you mean --set learning.discount=...?"),
        ("--gamma 1", "--gamma: did you mean --set learning.discount=...?"),
        ("--set agent.angles=[7]", "--set agent.angles: must"),
        ("--set learning.traces=\udcff", "learning.traces: must be one"),
        ("--set agent.inputs=\udcff", "--inputs: must be one of"),
        ("--env-arg 5", "--env-arg must be NAME=VALUE"),
        ("--env-arg color=5", "--env-arg: CartPole-v1 cannot be made"),
        ("--target-return 5 --evaluate-every 0", "--target-return: "),
        ("--angle-pairs find --redundant 1", "--angle-pairs: "),
        ("--fast", "--fast"),
    ],
)
def test_bad_options_of_train_exit_with_2_and_name_the_option(refused, tmp_path, options, words):
    assert words in refused("train", "CartPole-v1", *options.split(), code=2)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("place", ["", "train.", "learning."])
@pytest.mark.parametrize("option", ["--agent", "--env-arg", "--json", "--out", "--seed", "--steps"])
def test_an_option_that_is_given_to_set_is_named(refused, place, option):
    setting = place + option.removeprefix("--").replace("-", "_")
    error = refused("train", "CartPole-v1", "--set", f"{setting}=5", code=2)
    assert f"--set {setting}: " in error
    assert f"did you mean {option}?" in error


@pytest.mark.parametrize(
    ("env_id", "words"), [([], "ENV_ID"), (["Nothing-v0"], "ENV_ID: no environment 'Nothing-v0'")]
)
def test_a_missing_or_unknown_environment_of_train_is_refused(refused, tmp_path, env_id, words):
    assert words in refused("train", *env_id, code=2)
    assert list(tmp_path.iterdir()) == []


def test_a_missing_tensorboard_is_refused_before_training(refused, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "tensorboardX", None)
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    error = refused("train", "CartPole-v1", "--tensorboard", code=2)
    assert re.search("--tensorboard: .*tensorboardX", error)
    assert list(tmp_path.iterdir()) == []


NOISE_WITHOUT_RANGES = """\
[environment]
id = "CartPole-v1"
noise = 0.1
"""
BAD_KWARGS = """\
agent = "rbf"
[environment]
id = "CartPole-v1"
ranges = { 1 = [-3, 3], 9 = [-3, 3] }
kwargs.colour = 5
[learning]
discount = 0.5
"""
BAD_RANGE = BAD_KWARGS.replace("kwargs.colour", "# ")
VALID = BAD_RANGE.replace("9 =", "3 =")


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ('environment = "Nothing-v0"\n', "", "mine.toml:1: environment.id: no environment"),
        ('environment = "CartPole-v1"\nbudget.steps = "x"\n', "", "mine.toml:2: budget.steps: "),
        ('environment = "A"\n', "Nothing-v0", "Error: ENV_ID: no environment 'Nothing-v0'"),
        ('[environment]\nid = "Nothing-v0"\n', "", "mine.toml:2: environment.id: no environ"),
        (BAD_KWARGS, "", "mine.toml:5: environment.kwargs: CartPole-v1 cannot be made"),
        (BAD_KWARGS, "--env-arg max_episode_steps=9", "Error: --env-arg: CartPole-v1 cannot be"),
        (BAD_KWARGS, "Pendulum-v1", "mine.toml:5: environment.kwargs: Pendulum-v1 cannot be made"),
        (
            BAD_KWARGS.replace("colour", "max_episode_steps"),
            "--env-arg shape=1",
            "Error: --env-arg: CartPole-v1 cannot be made",
        ),
        (BAD_RANGE, "", "mine.toml:4: environment.ranges.9: CartPole-v1 has the variables 0"),
        (BAD_KWARGS.replace("0.5", "1.5"), "", "mine.toml:7: learning.discount: must be in [0, 1]"),
        (VALID, "--set learning.discount=2", "Error: --set learning.discount: must be in [0, 1]"),
        (VALID, "--range 8=0:1", "Error: --range 8: CartPole-v1 has the variables 0 to 3, got 8"),
        (NOISE_WITHOUT_RANGES, "", "mine.toml:1: environment.ranges.1: must be given"),
        (NOISE_WITHOUT_RANGES, "--range 0:1=1", "Error: --range must be"),
        (
            "[agent]\nobservation_range = 'adaptive'\n",
            "CartPole-v1 --range 0:1",
            "Error: --range: must not be given together with agent.observation_range",
        ),
        (
            "[approximator]\nn_hidden_units = 1000000000\n",
            "CartPole-v1",
            "mine.toml:2: approximator.n_hidden_units: ",
        ),
    ],
)
def test_errors_name_the_line_of_the_file_or_the_option(refused, tmp_path, text, options, words):
    (tmp_path / "mine.toml").write_text(text)
    assert words in refused("train", "--config", "mine.toml", *options.split(), code=2)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


def test_an_unknown_environment_of_a_run_is_refused_with_its_configuration_file(refused, trained):
    path = trained / "config.json"
    path.write_text(path.read_text().replace("Drifting-v0", "Gone-v0"))
    for command in (["evaluate", trained], ["record", trained, "x.gif"]):
        assert f"{path}: environment.id: " in refused(*command, code=2)


def test_resume_refuses_a_changed_configuration(output_of, refused, trained):
    path = trained / "config.json"
    text = path.read_text()
    path.write_text(text.replace('"n_hidden_units": 60', '"n_hidden_units": 61'))
    error = refused("resume", trained, "--steps", 170, code=1)
    assert f"{path} differs from the specification in results.sqlite" in error
    path.write_text(text)
    output_of("resume", trained, "--steps", 170)


class WiderEnv(drifting_env.DriftingEnv):
    observation_space = gym.spaces.Box(-np.inf, np.inf, (3,), np.float64)

    def reset(self, *, seed=None, options=None):
        observation, info = super().reset(seed=seed, options=options)
        return np.append(observation, 0.0), info


class StrongerEnv(drifting_env.DriftingEnv):
    action_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float32)


@pytest.mark.parametrize(
    ("env_class", "words"),
    [
        (WiderEnv, "observation_space, Box(-inf, inf, (2,), float64), got"),
        (StrongerEnv, "action_space, Box(-1.0, 1.0, (1,), float32), got"),
    ],
)
def test_changed_spaces_of_an_environment_are_reported_in_one_line(
    output_of, refused, monkeypatch, env_class, words
):
    whole_episodes = (*SHORT, "--env-arg", "max_episode_steps=5")  # 150 steps end with an episode
    output_of("train", DRIFTING, *whole_episodes, "--out", "one")
    monkeypatch.setattr(gym.registry["tests/Drifting-v0"], "entry_point", env_class)
    for command in ("evaluate one", "record one x.gif", "resume one --steps 170"):
        assert words in refused(*command.split(), code=1)


BROKEN = "drifting_env:tests/Broken-v0"


def test_a_reward_of_nan_is_reported_with_its_step_and_the_way_to_resume(invoke, refused):
    # By default step 250 of an environment object has a reward of NaN, so 249 steps are learned
    # from; a resumed run makes a new object, of which step 250 is not reached.
    options = ("--steps", 400, "--evaluate-every", 0, *SMALL)
    error = refused("train", BROKEN, *options, "--out", "one run", code=1)
    assert f"{BROKEN}: " in error
    assert re.search(r"\b250\b.*reward.*nan.*\b249\b.*sdnn resume 'one run'", error)
    result = invoke("resume", "one run", "--json")
    assert (result.exit_code, json.loads(result.stdout)["n_steps"]) == (0, 400)
    error = refused("train", BROKEN, *options, "--env-arg", "bad_step=1", "--out", "two", code=1)
    assert "sdnn resume two" in error


def test_a_reward_of_nan_in_an_evaluation_is_reported_in_one_line(output_of, refused):
    output_of("train", BROKEN, *SHORT, "--out", "one")
    config = json.loads(Path("one/config.json").read_text())
    config["environment"]["kwargs"] = {"bad_step": 3}
    Path("one/config.json").write_text(json.dumps(config))
    for command in (["evaluate", "one"], ["record", "one", "x.gif"]):
        assert re.search(rf"{BROKEN}: .*\bstep 3\b", refused(*command, code=1))


def test_scaling_observations_opens_no_second_environment(output_of):
    # Only-v0 raises an error if two are open.
    only = ("drifting_env:tests/Only-v0", *SHORT, "--redundant", 1, "--range", "all=-2:2")
    printed = output_of("train", *only, "--evaluate-every", 0, "--out", "one")
    assert "0 from -2 to 2, 1 from -2 to 2" in printed
    scaling = load_agent("one/agent.safetensors").scaling
    assert scaling.ranges == ((-2.0, 2.0), (-2.0, 2.0))


def test_commands_without_evaluations_open_one_environment_at_a_time(output_of, refused):
    only = ("drifting_env:tests/Only-v0", *SHORT)  # raises an error if two are open
    output_of("train", *only, "--evaluate-every", 0, "--out", "one")
    for command in (
        "resume one --steps 170",
        "resume one --steps 190 --new-episode",
        "evaluate one --episodes 1",
        "record one x.gif",
        "export one --c-header x.h",
    ):
        output_of(*command.split())
        assert drifting_env.OnlyEnv.n_open == 0
    error = refused("train", *only, "--out", "two", code=2)
    assert "--evaluate-every: " in error
    assert "ConnectionError: the port is in use" in error
    assert not Path("two").exists()
    assert drifting_env.OnlyEnv.n_open == 0


def test_resume_with_new_episode_repeats_no_steps(invoke, output_of, refused):
    restless = ("drifting_env:tests/Restless-v0", *SHORT, "--evaluate-every", 0)  # has no seed
    output_of("train", *restless, "--steps", 70, "--out", "one run")
    error = refused("resume", "one run", "--steps", 100, code=1)
    assert "env " in error
    assert "sdnn resume 'one run' --new-episode" in error
    drifting_env.RestlessEnv.n_steps = 0
    result = invoke("resume", "one run", "--steps", 100, "--new-episode")
    assert (result.exit_code, result.stderr) == (0, "")
    assert drifting_env.RestlessEnv.n_steps == 100 - 70, "the first 70 steps are not repeated"
    rows = Run.open("one run").rows()
    assert [row["episode"] for row in rows] == list(range(len(rows)))


@pytest.mark.parametrize("error_type", ["RuntimeError", "TimeoutError", "BrokenPipeError"])
def test_an_error_of_an_environment_is_raised_with_its_traceback(invoke, error_type):
    failing = ("--env-arg", "error=stalled", "--env-arg", f"kind={error_type}")  # at step 250
    options = ("--steps", 400, "--evaluate-every", 0, *SMALL, "--out", "one run")
    result = invoke("train", BROKEN, *failing, *options, catch_exceptions=True)
    assert isinstance(result.exception, RuntimeError)
    assert "sdnn resume 'one run'" in result.stderr
    error = result.exception.__cause__ or result.exception
    assert type(error).__name__ == error_type
    assert traceback.extract_tb(error.__traceback__)[-1].filename.endswith("drifting_env.py")
    run = Run.open("one run")
    env = run.spec.make_training_env()
    assert Training.load(run.folder / "checkpoint.safetensors", env).n_steps == 249


def test_a_full_standard_output_is_reported_in_one_line(trained):
    command = f"{sys.executable} -m sdnn resume {trained} --json"
    closed_pipe = ("| true", "")  # no error: the reader wants no more
    for redirection, error in (("> /dev/full", "Error: [Errno 28] No space left"), closed_pipe):
        shell = ["sh", "-c", f"{command} {redirection}"]
        process = subprocess.run(shell, env=environment(), capture_output=True, text=True)
        assert process.stderr.startswith(error), process.stderr
        assert process.stderr.count("\n") == bool(error), process.stderr


def test_train_does_not_overwrite_runs_or_files(refused, trained):
    before = (trained / "results.sqlite").read_bytes()
    error = refused("train", DRIFTING, *SHORT, "--out", trained, code=2)
    assert re.search(f"--out: .*sdnn resume {trained}", error)
    assert (trained / "results.sqlite").read_bytes() == before
    Path("file").write_text("mine")
    refused("train", DRIFTING, *SHORT, "--out", "file", code=1)
    assert Path("file").read_text() == "mine"


def test_keep_best_saves_the_best_agent(output_of, refused):
    output_of("train", DRIFTING, *SHORT, "--out", "kept", "--keep-best")
    output_of("train", DRIFTING, *SHORT, "--out", "plain")
    best = load_agent("kept/best.safetensors")
    assert best.kind == "sdnn-c"
    printed = output_of("evaluate", "kept", "--best", "--episodes", 3, "--json")
    env = Run.open("kept").spec.make_env("evaluation_sensor_noise")
    again = evaluate(best, env, 3, seed=Run.open("kept").fresh_seed)
    assert json.loads(printed)["returns"] == again.returns.tolist()
    assert not Path("plain/best.safetensors").exists()
    assert "--keep-best" in refused("evaluate", "plain", "--best", code=1)


def test_train_reports_ranges_that_are_too_wide_or_too_narrow(output_of):
    # A position from -1.2 to 0.6 and a speed of up to 0.07.
    ranges = ("--range", "0=-100:100", "--range", "1=0:0.0001")
    options = ("--agent", "sdnn-c", "--steps", 400, *ranges)
    lines = output_of("train", "MountainCarContinuous-v0", *options, "--out", "one")
    assert "observed variable 0 moved within 10% of the range" in lines
    assert "observed variable 1 left the range more than 10% of the time" in lines
    lines = output_of("train", "MountainCarContinuous-v0", "--steps", 400, "--out", "two")
    assert "left the range" not in lines


def test_train_does_not_report_ranges_of_a_solved_task(output_of, monkeypatch):
    # Any mean return reaches the threshold.
    monkeypatch.setattr(gym.spec("MountainCarContinuous-v0"), "reward_threshold", -np.inf)
    narrow = ["--agent", "sdnn-c", "--range", "1=0:0.0001", "--set", "protocol.evaluate_every=200"]
    options = [*narrow, "--steps", 400, "--out", "one"]
    lines = output_of("train", "MountainCarContinuous-v0", *options)
    assert "mean return" in lines
    assert "left the range" not in lines


def test_train_reports_values_in_steps_that_are_too_coarse(output_of):
    task = ("MountainCarContinuous-v0", "--agent", "sdnn-c", "--steps", 800)
    ends = ["approximator.q_low=-1e6", "approximator.q_high=1e6"]
    options = [word for point in ["learning.value_range=fixed", *ends] for word in ("--set", point)]
    lines = output_of("train", *task, *options, "--out", "wide")
    # By default an action has 600 units, of which 40 to 560 fire: 2e6 / 520 = 3.85e3.
    assert re.search(r"values come in steps of 3\.85e\+03, .*approximator\.q_low", lines)
    assert "values come in steps" not in output_of("train", *task, "--out", "adaptive")


def test_train_reports_observations_that_are_left_out(output_of):
    # The agent chooses its inputs when its warm-up of 1,000 steps ends. Observed are a position and
    # a speed, and four random numbers.
    task = "drifting_env:tests/Crowded-v0"
    options = ["--agent", "q-lambda", "--steps", 1001, "--evaluate-every", 0]
    printed = output_of("train", task, *options, "--out", "one", "--json")
    left_out = json.loads(printed)["learning_report"]["left_out"]
    assert len(left_out) >= 3, "most of the four inputs of noise"
    assert set(left_out) <= {2, 3, 4, 5}, "nothing but inputs of noise"
    listed = f"{len(left_out)} of 6 observations.*: {', '.join(map(str, left_out))}"
    assert re.search(listed, output_of("resume", "one"))
    options[1] = "sdnn-c"  # uses all inputs by default
    lines = output_of("train", task, *options, "--out", "two")
    assert "of 6 observations" not in lines


def test_the_help_of_train_shows_how_lists_are_given(output_of):
    text = re.sub(r"\s+", "", output_of("train", "--help"))
    for setting in ("agent.inputs=[0,1]", "agent.angle_pairs=[[0,1]]"):
        assert f"--set{setting}" in text
        output_of("train", "CartPole-v1", "--set", setting, "--dry-run")


def test_commands_report_an_unfinished_warm_up(output_of):
    # The agent warms up for 60 steps: training stops one step earlier, and is resumed to the 60th.
    before_the_end = ("--steps", 59, "--evaluate-every", 50, "--evaluation-episodes", 1, *SMALL)
    lines = output_of("train", DRIFTING, *before_the_end, "--out", "one").splitlines()
    assert lines[1].startswith(WARMING_UP)
    assert "60 steps" in lines[1]
    assert "sdnn resume one --steps N" in lines[1]
    assert output_of("evaluate", "one", "--episodes", 1).splitlines()[-1] == WARMING_UP
    assert output_of("record", "one", "x.gif", "--steps", 2).splitlines()[-1] == WARMING_UP
    evaluate = ("evaluate", "one", "--episodes", 1, "--json")
    assert json.loads(output_of(*evaluate))["is_warming_up"] is True
    printed = json.loads(output_of("resume", "one", "--json"))
    assert (printed["is_warming_up"], printed["learning_report"]) == (True, None)
    assert "warming up" not in output_of("resume", "one", "--steps", 60)
    assert "warming up" not in output_of("evaluate", "one", "--episodes", 1)
    assert json.loads(output_of(*evaluate))["is_warming_up"] is False
    assert json.loads(output_of("resume", "one", "--json"))["is_warming_up"] is False


def test_resume_accepts_later_goals_and_refuses_earlier_or_conflicting_ones(output_of, refused):
    printed = json.loads(output_of("train", DRIFTING, *SHORT, "--out", "one", "--json"))
    assert (printed["n_steps"], printed["reason"], printed["folder"]) == (150, "done", "one")
    assert 0.0 <= printed["learning_report"]["share_changed"] <= 1.0
    assert "150 steps" in output_of("resume", "one")
    assert json.loads(output_of("resume", "one", "--steps", 170, "--json"))["n_steps"] == 170
    assert "--steps: " in refused("resume", "one", "--steps", 9, code=2)
    two_goals = ("--steps", 900, "--episodes", 900)
    assert "--episodes: " in refused("resume", "one", *two_goals, code=2)


@pytest.mark.parametrize("command", ["resume {}", "evaluate {}", "plot {}", "record {} x.gif"])
def test_folders_without_a_run_are_refused(refused, tmp_path, command):
    refused(*command.format("nowhere").split(), code=2)
    (tmp_path / "empty").mkdir()
    assert "Error: empty " in refused(*command.format("empty").split(), code=1)


@pytest.mark.usefixtures("trained")
def test_unknown_output_formats_and_zero_episodes_are_refused(refused):
    for command, words in (
        ("record run x.avi", "OUT"),
        ("plot run --out x.jpg", "--out must end in one of .png, .svg, .pdf, got x.jpg"),
        ("evaluate run --episodes 0", "--episodes"),
    ):
        assert words in refused(*command.split(), code=2)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.5", 0.5), ("7", 7), ("true", True), ("True", True), ("False", False),
        ("[1, 2]", [1, 2]), ("middle", "middle"),
        ('"7"', "7"), ("", ""), ("a\nb", "a\nb"), ("1 # one", 1),
    ],
)  # fmt: skip
def test_values_of_options_are_parsed_as_toml_or_kept_as_text(text, value):
    assert value_of(text) == value


@pytest.mark.parametrize(
    ("number", "code", "word"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
def test_a_run_stopped_by_a_signal_resumes_exactly(output_of, tmp_path, number, code, word):
    long = (
        DRIFTING, "--steps", 3000, "--evaluate-every", 700, "--evaluation-episodes", 2,
        "--range", "-4:4", "--noise", 0.01, "--checkpoint-every", 300, *SMALL,
    )  # fmt: skip
    command = [sys.executable, "-m", "sdnn", "train", *map(str, long), "--out", "cut"]
    process = subprocess.Popen(
        command, cwd=tmp_path, env=environment(), stderr=subprocess.PIPE, text=True
    )
    while process.poll() is None and not (tmp_path / "cut" / "checkpoint.safetensors").exists():
        time.sleep(0.002)
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == code, errors
    assert errors.startswith(word)
    assert "sdnn resume cut" in errors
    assert errors.count("\n") == 1
    assert not (tmp_path / "cut" / "agent.safetensors").exists()
    assert Run.open("cut").rows()[-1]["step"] < 3000, "stopped before its end"
    output_of("resume", "cut")
    output_of("train", *long, "--out", "whole")
    for name in ("agent.safetensors", "checkpoint.safetensors"):
        assert (tmp_path / "cut" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    cut, whole = (Run.open(folder).rows() for folder in ("cut", "whole"))
    assert cut == whole
