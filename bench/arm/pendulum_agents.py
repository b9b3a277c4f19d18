"""Agents that balance Gymnasium's pendulum as firmware of boards, and the actor of rl-tools."""

import re
import subprocess
from pathlib import Path

import gymnasium as gym
import numpy as np
from firmware import Firmware, run

from sdnn.agents import Transition
from sdnn.approximators import LinearSDNNConfig
from sdnn.export import c_header, new_agent

HERE = Path(__file__).parent
N_STEPS = 100_000
N_EPISODES = 100
N_ROWS = 2000
SCALE = 2.0**16
HIGH = np.array([np.pi, 8.0])
RL_TOOLS_WEIGHTS = 3 * 64 + 64 + 64 * 64 + 64 + 64 + 1
SIZES = {"q-lambda": (12_000, 20_000), "actor-critic": (12_000,)}
"""Bytes that each agent may take."""


def observe(env):
    """Read the angle and the speed, as a program in fixed point does."""
    angle, speed = env.unwrapped.state
    return np.round(np.array([(angle + np.pi) % (2 * np.pi) - np.pi, speed]) * SCALE) / SCALE


def train(agent, env, n_steps):
    """Let an agent learn; return a row for each step, and the indices of its actions."""
    rows, actions = [], []
    for step in range(n_steps):
        begins = step % 200 == 0
        if begins:
            env.reset(seed=step)
            agent.begin_episode()
        now = observe(env)
        action = agent.act(now)
        reward = round(float(env.step(action)[1]) * SCALE) / SCALE
        following = observe(env)
        agent.learn(Transition(now, action, reward, following, False))
        rows.append([begins, *(np.array([*now, reward, *following]) * SCALE)])
        actions.append(np.abs(agent.actions_of(0) - action).argmin())
    return np.array(rows).astype("<i4"), np.array(actions)


def mean_return(agent, env):
    """Return the mean return of `N_EPISODES` greedy episodes."""
    total = 0.0
    for episode in range(N_EPISODES):
        env.reset(seed=10**6 + episode)
        for _ in range(200):
            total += float(env.step(agent.act(observe(env), explore=False))[1])
    return total / N_EPISODES


def pendulum_agents():
    """Yield names, firmware, expected results, and mean returns of our agents."""
    env = gym.make("Pendulum-v1").unwrapped
    space = gym.spaces.Box(-HIGH, HIGH, dtype=np.float64)
    for kind, sizes in SIZES.items():
        for ram_bytes in sizes:
            config = LinearSDNNConfig(n_actions=3)
            agent = new_agent(
                space, env.action_space, kind=kind, ram_bytes=ram_bytes, angles=[0], seed=1,
                approximator=config,
            )  # fmt: skip
            learner = c_header(agent, "pole", learning=True)
            rows, actions = train(agent, env, N_ROWS)
            train(agent, env, N_STEPS - N_ROWS)
            score = mean_return(agent, env)
            name = f"sdnn, {kind}, {learner.ram_bytes:,} bytes"
            text = f"{c_header(agent, 'pole').text}{_calling('out.y = pole_greedy(in.x + 1)')}"
            yield name, Firmware(ROW, "uint32_t y", text, rows, "<u4"), None, score
            learn = (
                "if (in.x[0]) pole_begin_episode(&agent); out.y = pole_act(&agent, in.x + 1);"
                " pole_learn(&agent, in.x + 1, out.y, in.x[3], in.x + 4, 0)"
            )
            text = f"{learner.text}static pole_agent agent;{_calling(learn, 'pole_begin(&agent)')}"
            firmware = Firmware(ROW, "uint32_t y", text, rows, "<u4")
            yield f"{name}, acts and learns", firmware, actions, score


ROW = "int32_t x[6]"


def _calling(call, begin="(void)0"):
    return f"\n#define BEGIN {begin}\n#define CALL(in, out) {call}\n"


def rl_tools_actor(checkout, folder):
    """Return the firmware of an actor of rl-tools with random weights."""
    random = np.random.default_rng(0)
    weights = random.normal(0, 0.2, RL_TOOLS_WEIGHTS + 64).astype("<f4")
    text = ", ".join(str(byte) for byte in weights.tobytes())
    (folder / "weights.h").write_text(f"alignas(16) const unsigned char weights[] = {{{text}}};\n")
    rows = random.uniform(-1, 1, (N_ROWS, 3)).astype("<f4")
    call = f"float act(const float *x);{_calling('out.y = act(in.x)')}"
    cpp = (HERE / "rl_tools_actor.cpp").read_text()
    options = ("-isystem", checkout / "include", "-I", folder)
    return Firmware("float x[3]", "float y", call, rows, "<f4", cpp=cpp, options=options)


def rl_tools_training(checkout, folder):
    """Train by TD3 as its example for Arm does; return its bytes of memory and its mean return."""
    source = checkout / "src" / "rl" / "environments" / "pendulum" / "td3" / "arm" / "test.cpp"
    program = folder / "td3"
    options = ("-std=c++17", "-Ofast", "-march=native", "-I", checkout / "include")
    run("g++", *options, source, "-o", program)
    with subprocess.Popen([program], stdout=subprocess.PIPE, text=True) as training:
        lines = []
        for line in training.stdout:
            lines.append(line)
            if line.startswith("total time"):
                training.kill()  # it would begin anew
                break
    text = "".join(lines)
    n_bytes = int(re.search(r"malloc counter: (\d+)", text)[1])
    return n_bytes, float(re.findall(r"Mean return: (\S+)", text)[-1])
