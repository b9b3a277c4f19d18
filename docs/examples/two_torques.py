# %% [markdown]
# # Actions with two dimensions
#
# An arm of two links lies on a table. Each joint has a motor, so an action is two numbers. The tip
# shall come to a point that differs from episode to episode, and stay there. With 5 values for
# each motor there are 25 joint actions; the agent has a network for each motor instead and takes
# the mean of their values, so that it looks at 5 + 5.

# %%
import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np

from sdnn.agents import SDNNQLearning, evaluate


class ReachingEnv(gym.Env):
    """Links of 1 m, with so much friction that torques set speeds."""

    action_space = gym.spaces.Box(-1.0, 1.0, (2,), dtype=float)
    observation_space = gym.spaces.Box(-3.0, 3.0, (4,), dtype=float)  # angles, and what is missing

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.joints = self.np_random.uniform(-1.0, 1.0, 2)
        self.goal = self.np_random.uniform(-1.0, 1.0, 2)
        return self._observation(), {}

    def step(self, action):
        first, second = action
        speeds = np.array(
            [first - 0.5 * second, second]
        )  # the second motor turns the first link too
        self.joints = np.clip(self.joints + 0.15 * speeds, -2.0, 2.0)
        distance = np.linalg.norm(tip(self.joints) - tip(self.goal))
        return self._observation(), -float(distance), False, False, {}

    def _observation(self):
        return np.concatenate([self.joints, self.goal - self.joints])


def tip(joints):
    """Where the tip is for two angles, shape (2,)."""
    angles = np.cumsum(joints)
    return np.array([np.cos(angles).sum(), np.sin(angles).sum()])


gym.register("examples/Reaching-v0", entry_point=ReachingEnv, max_episode_steps=40)

# %% [markdown]
# Before any learning the agent acts at random. An episode has 40 steps, and its return is minus
# the sum of the distances.

# %%
env = gym.make("examples/Reaching-v0")
test = gym.make("examples/Reaching-v0")
agent = SDNNQLearning(env.observation_space, env.action_space, seed=1)
print("action space:", env.action_space, "- actions of each motor:", agent.n_actions)
before = -evaluate(agent, test, episodes=50).mean_return / 40
agent.train(env, steps=20_000)
after = -evaluate(agent, test, episodes=50).mean_return / 40
print(f"mean distance before: {before:.2f} m, after: {after:.2f} m")

# %% [markdown]
# The way to the goal counts in these means. Where does the tip end? The figure has the paths of
# the tip in eight episodes.

# %%
plt.figure(figsize=(4.5, 4.5))
distances = []
for seed in range(8):
    observation, _ = test.reset(seed=seed)
    arm = test.unwrapped
    path = [tip(arm.joints)]
    for _ in range(40):
        observation, *_ = test.step(agent.act(observation, explore=False))
        path.append(tip(arm.joints))
    distances.append(np.linalg.norm(path[-1] - tip(arm.goal)))
    (line,) = plt.plot(*np.array(path).T, ".-", markersize=3)
    plt.plot(*tip(arm.goal), "*", markersize=10, color=line.get_color())
print(f"distance at the end: {np.median(distances):.2f} m in the median of eight episodes")
plt.title("paths of the tip; stars: goals")
plt.xlabel("m")
plt.ylabel("m")
plt.axis("equal")
plt.tight_layout()
plt.show()
