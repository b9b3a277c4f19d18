# %% [markdown]
# # Train in Python, run in C++
#
# An agent's file is the same in both languages. Here an agent learns in Python to drive a car out
# of a valley, and the C++ program [cpp/run_agent.cpp](cpp/run_agent.cpp) takes its file and
# answers observations with actions. It needs no Python: the library, nlohmann/json (`apt install
# nlohmann-json3-dev`) and a C++20 compiler. A program that also learns is
# [cpp/train_agent.cpp](cpp/train_agent.cpp).

# %%
import subprocess
import sys
import tempfile
from pathlib import Path

import gymnasium as gym
import numpy as np

from sdnn.agents import SDNNQLambda, evaluate

env = gym.make("MountainCarContinuous-v0")
agent = SDNNQLambda(env.observation_space, env.action_space, seed=1)
agent.train(env, steps=60_000)
print(f"mean return in Python: {evaluate(agent, env, episodes=20).mean_return:.0f} (90 solves it)")

# %% [markdown]
# The program is built by CMake, which asks the installed package where its headers are. `Debug`
# builds quickly; without it the program decides in microseconds.

# %%
here = Path(__file__).parent if "__file__" in globals() else Path.cwd()
folder = Path(tempfile.mkdtemp())
file = folder / "car.safetensors"
agent.save(file)
cmake_folder = subprocess.run(
    [sys.executable, "-m", "sdnn", "--cmakedir"], check=True, capture_output=True, text=True
)
configure = [
    "cmake",
    "-S",
    here / "cpp",
    "-B",
    folder,
    f"-Dsdnn_DIR={cmake_folder.stdout.strip()}",
    "-DCMAKE_BUILD_TYPE=Debug",
]
subprocess.run(configure, check=True, stdout=subprocess.DEVNULL)
subprocess.run(
    ["cmake", "--build", folder, "--target", "run_agent"], check=True, stdout=subprocess.DEVNULL
)
program = subprocess.Popen(
    [folder / "run_agent", file], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
)

# %% [markdown]
# We give it 1,000 random observations and compare its answers with those of the agent in Python.
# Where several actions are best, one of them is drawn; the file holds the state of the random
# numbers, so even that is the same.

# %%
generator = np.random.default_rng(1)
low, high = env.observation_space.low, env.observation_space.high
observations = generator.uniform(low, high, size=(1000, 2))
lines = "\n".join(f"{float(position)!r} {float(speed)!r}" for position, speed in observations)
answers, _ = program.communicate(lines)
in_cpp = np.array(answers.split(), float)
in_python = np.array([agent.act(observation, explore=False)[0] for observation in observations])
same = int((in_cpp.astype(np.float32) == in_python).sum())
print(f"{same} of {len(in_python)} actions are the same")
assert same == len(in_python)
