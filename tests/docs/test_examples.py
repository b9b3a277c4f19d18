"""The examples run and reach their stated results; their notebooks have the same cells."""

import importlib.util
import os
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import sdnn_actor_critic
import sdnn_q_lambda

from sdnn.agents import SDNNActorCritic, SDNNQLambda, Transition

FOLDER = Path(__file__).parents[2] / "docs" / "examples"
MAKER = FOLDER / "make_notebooks.py"
PAGE = FOLDER / "sdnn_q_learning.py"
Q_LAMBDA = FOLDER / "sdnn_q_lambda.py"
ACTOR_CRITIC = FOLDER / "sdnn_actor_critic.py"
PAGES = (PAGE, Q_LAMBDA, ACTOR_CRITIC)
SCRIPTS = sorted(path for path in FOLDER.glob("*.py") if path not in (MAKER, *PAGES))


def run(script, folder, *options):
    """Run a script in a folder; return what it prints."""
    process = subprocess.run(
        [sys.executable, "-W", "ignore", script, *options],
        cwd=folder,
        env=os.environ | {"MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stderr[-4000:]
    return process.stdout


def numbers(pattern, printed):
    """Return the numbers that the groups of a pattern match in a text."""
    match = re.search(pattern, printed)
    assert match, printed
    return [float(number) for number in match.groups()]


def test_the_transcription_of_sdnn_c_runs_with_its_options(tmp_path):
    options = ["--episodes", "3", "--n-inputs", "5", "--noise", "0.02"]
    lines = run(PAGE, tmp_path, *options).splitlines()
    assert [line.split(":")[0] for line in lines] == ["episode 1", "episode 2", "episode 3"]


def test_the_transcription_of_q_lambda_runs_with_its_options(tmp_path):
    options = ["--env-id", "MountainCarContinuous-v0", "--steps", "1000"]
    assert run(Q_LAMBDA, tmp_path, *options).startswith("step 999: return -")


class Recorder(gym.Wrapper):
    """Wrapper that records each episode: a list of its transitions."""

    def __init__(self, env):
        super().__init__(env)
        self.episodes = []

    def reset(self, **options):
        self.observation, info = super().reset(**options)
        self.episodes.append([])
        return self.observation, info

    def step(self, action):
        outcome = super().step(action)
        next_observation, reward, terminated, *_ = outcome
        transition = Transition(self.observation, action, reward, next_observation, terminated)
        self.episodes[-1].append(transition)
        self.observation = next_observation
        return outcome


def trained_as_on_page(page, agent_class, env_id, n_steps):
    """Train the agent of a page, and the library's with its transitions; return both.

    Checks that in each step the library's agent chooses the action of the page's.
    """
    env = Recorder(gym.make(env_id))
    agent_of_page = page.train(env, page.Settings(steps=n_steps, seed=7), report=str)
    space = env.observation_space
    ranges = tuple(np.clip(bound.astype(float), -3, 3) for bound in (space.low, space.high))
    options = {"observation_range": ranges, "inputs": "all", "angle_pairs": "none"}
    agent = agent_class(env, seed=7, **options)
    for episode in env.episodes:
        agent.begin_episode()
        for transition in episode:
            np.testing.assert_array_equal(agent.act(transition.observation), transition.action)
            agent.learn(transition)
    return agent_of_page, agent


@pytest.mark.parametrize(
    ("env_id", "n_steps"), [("CartPole-v1", 3000), ("Pendulum-v1", 600), ("Acrobot-v1", 600)]
)
def test_the_transcription_of_q_lambda_has_the_weights_of_the_library(env_id, n_steps):
    page, agent = trained_as_on_page(sdnn_q_lambda, SDNNQLambda, env_id, n_steps)
    state = agent.state()
    np.testing.assert_array_equal(state["agent.action_value.weights"], page.weights)
    np.testing.assert_array_equal(state["agent.action_value.averaged_weights"], page.average)
    assert state["agent.action_value.exponent"] == page.exponent
    assert np.abs(page.weights).max() > 2**20, "something was learned"


@pytest.mark.parametrize(
    ("env_id", "n_steps"), [("CartPole-v1", 2000), ("Pendulum-v1", 500), ("Acrobot-v1", 400)]
)
def test_the_transcription_of_the_actor_critic_has_the_weights_of_the_library(env_id, n_steps):
    page, agent = trained_as_on_page(sdnn_actor_critic, SDNNActorCritic, env_id, n_steps)
    state = agent.state()
    np.testing.assert_array_equal(state["agent.actor.weights"], page.weights)
    np.testing.assert_array_equal(state["agent.action_value.weights"], page.critic.weights)
    assert state["agent.error_scale.mean_square"] == page.scale.mean_square
    assert np.abs(page.weights).max() > 2**12, "something was learned"


def test_cited_sections_of_the_method_exist():
    root = FOLDER.parents[1]
    method = (root / "docs" / "explanation" / "method.md").read_text("utf-8")
    sections = set(re.findall(r"^#+ ([\d.]*\d)", method, re.MULTILINE))
    cited = set(re.findall(r"\(([1-9](?:\.\d)?)[,)]", PAGE.read_text("utf-8")))  # (5) and (1.2)
    assert len(cited) > 8
    for path in (*(root / "cpp").rglob("*.hpp"), *(root / "python").rglob("*.py")):
        for numbers in re.findall(r"method\.md, sections? ([\d. and]+)", path.read_text("utf-8")):
            cited.update(re.findall(r"\d(?:\.\d)?", numbers))
    assert cited <= sections


def test_the_acrobot_example_solves_80_percent_of_episodes(tmp_path):
    (n_solved,) = numbers(r"in the last 20: (\d+)", run(FOLDER / "acrobot.py", tmp_path))
    assert n_solved >= 0.8 * 20


def test_the_custom_environment_example_beats_its_rule(tmp_path):
    printed = run(FOLDER / "own_environment.py", tmp_path)
    (agent,) = numbers(r"agent: return ([-.\d]+)", printed)
    (rule,) = numbers(r"jetty: return ([-.\d]+)", printed)
    assert agent > rule


def test_the_noise_example_solves_more_with_robust_than_with_paper(tmp_path):
    printed = run(FOLDER / "noisy_sensors.py", tmp_path)
    robust = [int(share) for share in re.findall(r"robust, seed \d: solved (\d+)%", printed)]
    paper = [int(share) for share in re.findall(r"paper, seed \d: solved (\d+)%", printed)]
    assert min(robust) > max(paper)


def test_the_arm_example_reduces_its_distance_to_a_third(tmp_path):
    printed = run(FOLDER / "two_torques.py", tmp_path)
    before, after = numbers(r"before: ([.\d]+) m, after: ([.\d]+) m", printed)
    assert after < before / 3
    assert numbers(r"at the end: ([.\d]+) m", printed)[0] < 0.3


def test_the_drift_example_follows_the_drift_online(tmp_path):
    printed = run(FOLDER / "drifting_regression.py", tmp_path)
    r2, highest_r2 = numbers(r"cross-validation: ([.\d]+); noise allows ([.\d]+)", printed)
    assert 0.9 < r2 < highest_r2
    before, fixed = numbers(r"stays as it is: error ([.\d]+) before the drift, ([.\d]+)", printed)
    (online,) = numbers(r"keeps learning: error [.\d]+ before the drift, ([.\d]+)", printed)
    assert fixed > 4 * before
    assert online < 1.5 * before


def test_the_cpp_example_gives_the_actions_of_python(tmp_path, cmake, skip_unless_ci):
    if shutil.which("cmake") is None and not Path(sys.executable).with_name("cmake").exists():
        skip_unless_ci("needs cmake")
    include = [Path("/usr/include"), Path("/usr/local/include")]
    if not any((folder / "nlohmann" / "json.hpp").exists() for folder in include):
        skip_unless_ci("needs nlohmann/json: apt install nlohmann-json3-dev")
    printed = run(FOLDER / "cpp_controller.py", tmp_path)
    assert numbers(r"in Python: (\d+)", printed)[0] > 85, "a return of MountainCarContinuous"
    assert "1000 of 1000 actions are the same" in printed


def test_a_search_confirms_its_best_settings_with_other_seeds(tmp_path, skip_unless_ci):
    if importlib.util.find_spec("optuna") is None:
        skip_unless_ci("needs optuna")
    printed = run(FOLDER / "search_settings.py", tmp_path)
    defaults, best = numbers(r"defaults: ([\d.]+) .*\nbest: ([\d.]+) ", printed)
    assert min(defaults, best) > 200


def test_every_example_is_tested_and_listed():
    tested = re.findall(r'FOLDER / "(\w+\.py)"', Path(__file__).read_text())
    listed = re.findall(r"^\| \[(\w+\.py)\]", (FOLDER / "README.md").read_text(), re.MULTILINE)
    tested.remove(MAKER.name)
    assert sorted(tested) == sorted(listed) == sorted(path.name for path in (*SCRIPTS, *PAGES))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_notebooks_have_the_cells_of_their_scripts(script):
    pytest.importorskip("jupytext")
    notebook = runpy.run_path(str(MAKER))["notebook_of"](script)
    # The parts before the first line "# %%" (none), and then in turn what follows "# %%" in the
    # line, which is " [markdown]" or nothing, and the text of the cell.
    before, *parts = re.split(r"^# %%(.*)\n", script.read_text(), flags=re.MULTILINE)
    assert before == ""
    cells = []
    for cell_type, text in zip(parts[::2], parts[1::2], strict=True):
        if cell_type == " [markdown]":
            text = re.sub(r"^# ?", "", text, flags=re.MULTILINE)
        cells.append(("markdown" if cell_type else "code", text.strip()))
    assert [(cell.cell_type, cell.source) for cell in notebook.cells] == cells
    assert cells[0][0] == "markdown"
    assert cells[0][1].startswith("# ")


def test_make_notebooks_converts_and_executes_scripts(tmp_path):
    pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    maker = runpy.run_path(str(MAKER))
    script = tmp_path / "small.py"
    script.write_text("# %% [markdown]\n# # Small\n\n# %%\nprint(6 * 7)\n")
    notebook = maker["notebook_of"](script)
    maker["execute"](notebook)
    assert notebook.cells[1].outputs[0].text == "42\n"
    command = [sys.executable, MAKER, tmp_path / "made", "--only", "acrobot"]
    subprocess.run(command, check=True, capture_output=True)
    made = nbformat.read(tmp_path / "made" / "acrobot.ipynb", as_version=4)
    assert made.cells[0].source.startswith("# The paper's acrobot")
