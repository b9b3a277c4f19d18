"""The compiled C++ library in a CMake project elsewhere has the bits of the agents in Python."""

import re
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import (
    FuzzyQLearning,
    RBFQLearning,
    SDNNActorCritic,
    SDNNQLambda,
    SDNNQLearning,
    Transition,
    load_agent,
)

pytestmark = pytest.mark.xdist_group("compiled controller")
"""Runs all tests in one process, as each process would compile the library."""

ROOT = Path(__file__).parents[2]

PROJECT = """
cmake_minimum_required(VERSION 3.21)
project(robot LANGUAGES CXX)
find_package(sdnn 0.1 REQUIRED)
add_executable(robot main.cpp)
target_link_libraries(robot PRIVATE sdnn::controller)
"""

PROGRAM = """
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <sdnn/agents/compiled_controller.hpp>
#include <string>
#include <vector>

using namespace sdnn::agents;

#if defined(EIGEN_WORLD_VERSION) || defined(NLOHMANN_JSON_VERSION_MAJOR)
#error "the header includes large libraries"
#endif

CompiledController agent_of(const std::string& agent, const std::string& preset,
                            const std::string& action) {
  const double unknown = std::numeric_limits<double>::infinity();
  AgentSpec spec{.agent = agent,
                 .preset = preset,
                 .observation = {.low = {-1.0, -unknown}, .high = {1.0, unknown}},
                 .action = Box{.low = {-1.0, -2.0}, .high = {1.0, 3.0}},
                 .seed = 3,
                 .settings = {{"warm_up_steps", 30}}};
  if (action == "discrete") spec.action = Discrete{.n = 3, .start = -1};
  if (action == "multi-discrete") spec.action = MultiDiscrete{.n = {3, 2}, .start = {-1, 4}};
  if (action == "float32") spec.settings["action.number"] = "float32";
  return CompiledController(spec);
}

// Usage: robot OUT FIRST_STEP (IN | AGENT PRESET ACTION). Learns for 60 steps, saves to OUT.
int main(int argc, char** argv) try {
  CompiledController agent = argc == 4 ? CompiledController(argv[3])
                                       : agent_of(argv[3], argv[4], argv[5]);
  std::vector<double> state = {0.0, 0.0};
  const int first = std::stoi(argv[2]);
  for (int t = first; t < first + 60; ++t) {
    if (t % 20 == 0) {
      state = {0.1 * (t / 20), 0.0};
      agent.begin_episode();
    }
    const auto chosen = agent.act(state);
    const std::vector<double> action(chosen.begin(), chosen.end());
    const double speed = 0.9 * state[1] + 0.1 * action[0];
    const std::vector<double> next = {state[0] + 0.1 * speed, speed};
    agent.learn(state, action, -std::abs(next[0]), next, t % 40 == 39);
    state = next;
  }
  agent.write(argv[1]);
} catch (const std::exception& error) {
  std::fprintf(stderr, "robot: %s\\n", error.what());
  return 1;
}
"""


@pytest.fixture(scope="module")
def build(cmake, configure, tmp_path_factory):
    """The program's build folder, with an installed prefix; the library is compiled once."""
    folder = tmp_path_factory.mktemp("robot")
    (folder / "CMakeLists.txt").write_text(PROJECT)
    (folder / "main.cpp").write_text(PROGRAM)
    prefix, quick = folder / "prefix", ("-DCMAKE_BUILD_TYPE=None", "-DCMAKE_CXX_FLAGS=-O1")
    for process in (
        configure(ROOT, folder / "library", f"-DCMAKE_INSTALL_PREFIX={prefix}"),
        cmake("--install", folder / "library"),
        configure(folder, folder / "build", f"-DCMAKE_PREFIX_PATH={prefix}", *quick),
        cmake("--build", folder / "build"),
    ):
        assert process.returncode == 0, process.stdout + process.stderr
    return folder / "build"


@pytest.fixture
def robot(build):
    """Runs the program."""

    def run(*arguments):
        command = [build / "robot", *map(str, arguments)]
        process = subprocess.run(command, capture_output=True, text=True, check=False)
        assert process.returncode == 0, process.stderr

    return run


def learn_like_robot(agent, first_step):
    """Act and learn for 60 steps in the task of the program robot, in Python."""
    state = np.zeros(2)
    for t in range(first_step, first_step + 60):
        if t % 20 == 0:
            state = np.array([0.1 * (t // 20), 0.0])
            agent.begin_episode()
        action = agent.act(state)
        push = float(np.ravel(action)[0])
        speed = 0.9 * state[1] + 0.1 * push
        next_state = np.array([state[0] + 0.1 * speed, speed])
        agent.learn(Transition(state, action, -abs(next_state[0]), next_state, t % 40 == 39))
        state = next_state


def test_a_program_compiles_in_300_mb(build, needs):
    needs("ninja")
    command = [sys.executable, ROOT / "bench" / "header_cost.py", build, "robot"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    (megabytes,) = map(float, re.findall(r"([\d.]+) MB", printed))
    assert 50 < megabytes < 300


SPACES = {
    "box": gym.spaces.Box(np.array([-1.0, -2.0]), np.array([1.0, 3.0]), dtype=np.float64),
    "float32": gym.spaces.Box(np.float32([-1.0, -2.0]), np.float32([1.0, 3.0])),
    "discrete": gym.spaces.Discrete(3, start=-1),
    "multi-discrete": gym.spaces.MultiDiscrete([3, 2], start=[-1, 4]),
}


@pytest.mark.timeout(600)  # the first one compiles the library
@pytest.mark.parametrize(
    ("agent_class", "preset", "action"),
    [
        *((SDNNQLambda, preset, "box") for preset in SDNNQLambda.presets),
        *((SDNNQLearning, preset, "discrete") for preset in SDNNQLearning.presets),
        *((agent_class, None, "float32") for agent_class in (SDNNQLambda, FuzzyQLearning)),
        *((SDNNActorCritic, "general", action) for action in SPACES),
        (SDNNQLambda, None, "multi-discrete"),
        (RBFQLearning, None, "discrete"),
    ],
)
def test_agents_in_cpp_have_the_bits_and_settings_of_python(
    agent_class, preset, action, robot, tmp_path
):
    cpp_file, python_file = tmp_path / "in-cpp.safetensors", tmp_path / "in-python.safetensors"
    observations = gym.spaces.Box(
        np.array([-1.0, -np.inf]), np.array([1.0, np.inf]), dtype=np.float64
    )
    agent = agent_class(observations, SPACES[action], preset=preset, seed=3, warm_up_steps=30)
    # `agent` learns for 180 steps in Python alone, the other one in C++, Python and C++.
    learn_like_robot(agent, 0)
    robot(cpp_file, 0, agent_class.kind, preset or "", action)
    loaded = load_agent(cpp_file)
    assert type(loaded) is agent_class
    settings = agent.description()
    del settings["observation_space"], settings["action_space"]  # C++ knows no spaces
    assert loaded.description() == settings
    learn_like_robot(loaded, 60)
    loaded.save(python_file)
    robot(cpp_file, 120, python_file)
    learn_like_robot(agent, 60)
    learn_like_robot(agent, 120)
    arrays, expected = load_agent(cpp_file).state(), agent.state()
    assert arrays.keys() == expected.keys()
    for name, array in expected.items():
        np.testing.assert_array_equal(arrays[name], array, name)
