# %% [markdown]
# # The paper's acrobot in twenty lines
#
# Two links hang from a fixed joint; a motor between them is the only drive. The agent decides on a
# torque once a second and has 50 decisions to bring the tip 1.5 m above the joint. At first it may
# fly past; from episode to episode it has to be slower there, down to almost standing still.
# `robust` is the preset that we recommend for this task.

# %%
import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np

from sdnn.agents import SDNNQLearning, evaluate
from sdnn.environments import TighteningGoal

env = TighteningGoal(gym.make("sdnn/AcrobotSwingUp-v0"))
agent = SDNNQLearning(env.observation_space, env.action_space, preset="robust", seed=1)
tests = []
for episode in range(1, 401):
    env.episode = episode  # how slow the tip has to be follows from it
    agent.train(env, episodes=1, seed=episode)
    if episode % 10 == 0:
        greedy = evaluate(agent, env, episodes=1)  # nothing is learned in it
        tests.append((episode, greedy.lengths[0], greedy.terminated[0]))
episodes, decisions, solved = np.array(tests).T
print(
    f"solved in {solved.sum():.0f} of {solved.size} tests; in the last 20: {solved[-20:].sum():.0f}"
)
print(f"decisions of the last solved test: {decisions[solved == 1][-1]:.0f}")

# %% [markdown]
# Each point is a test without random actions. 50 decisions would mean that it failed.
# Tests get longer when the goal has become harder and the agent has to find a slower way up.

# %%
plt.figure(figsize=(7, 3))
plt.plot(episodes[solved == 1], decisions[solved == 1], "o", label="goal reached")
plt.plot(episodes[solved == 0], decisions[solved == 0], "x", color="tab:red", label="not reached")
plt.xlabel("learning episodes")
plt.ylabel("decisions in a test")
plt.legend()
plt.tight_layout()
plt.show()
