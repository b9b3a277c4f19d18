# %% [markdown]
# # An environment of your own
#
# A boat crosses a river whose current is strongest in the middle. It has a fixed speed and chooses
# one of nine headings, ten times in a crossing or more. It shall land at a jetty on the other
# side.

# %%
import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np

from sdnn.agents import SDNNQLearning, evaluate

JETTY = 0.5
HEADINGS = np.linspace(-0.45 * np.pi, 0.45 * np.pi, 9)  # 0: straight across


class RiverEnv(gym.Env):
    """Positions (across, along) in [0, 1]; the river flows towards larger `along`."""

    observation_space = gym.spaces.Box(0.0, 1.0, (2,), dtype=float)
    action_space = gym.spaces.Discrete(9)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)  # draw random numbers from self.np_random only
        self.boat = np.array([0.0, self.np_random.uniform(0.2, 0.8)])
        return self.boat.copy(), {}

    def step(self, action):
        heading = HEADINGS[action]
        current = 0.06 * np.sin(np.pi * self.boat[0])
        self.boat += 0.08 * np.array([np.cos(heading), np.sin(heading)]) + [0.0, current]
        self.boat = np.clip(self.boat, 0.0, 1.0)
        has_landed = bool(self.boat[0] >= 1.0)
        reward = -0.02  # every step costs a little; landing far from the jetty costs more
        if has_landed:
            reward += 1.0 - 4.0 * abs(self.boat[1] - JETTY)
        return self.boat.copy(), reward, has_landed, False, {}


gym.register("examples/River-v0", entry_point=RiverEnv, max_episode_steps=100)

# %% [markdown]
# That is all an environment needs: spaces with bounds, `reset`, `step`, and a time limit. An agent
# learns it as it is.

# %%
env = gym.make("examples/River-v0")
agent = SDNNQLearning(env.observation_space, env.action_space, seed=1)
result = agent.train(env, steps=40_000)
print(f"{result.n_episodes} crossings, return of the first 50: {result.returns[:50].mean():.2f}")


class AimsAtTheJetty:
    """The rule that comes to mind: head for the jetty, wherever the boat is."""

    def act(self, observation, explore=True):
        across, along = observation
        wanted = np.arctan2(JETTY - along, 1.0 - across)
        return int(np.abs(HEADINGS - wanted).argmin())


controllers = {"agent": agent, "aims at the jetty": AimsAtTheJetty()}
test = gym.make("examples/River-v0")
for name, controller in controllers.items():
    evaluation = evaluate(controller, test, episodes=100, seed=9)
    print(f"{name}: return {evaluation.mean_return:.2f}, {evaluation.lengths.mean():.1f} steps")

# %% [markdown]
# A perfect landing gives 1 minus 0.02 for each step. The rule is carried away by the current in the
# middle and has to fight its way back; the agent has learned to steer against the current before.


# %%
def crossing(controller, seed):
    boat, _ = test.reset(seed=seed)
    path, is_over = [boat], False
    while not is_over:
        boat, _, terminated, truncated, _ = test.step(controller.act(boat, explore=False))
        path.append(boat)
        is_over = terminated or truncated
    return np.array(path).T


plt.figure(figsize=(6, 3.5))
for (name, controller), color in zip(controllers.items(), ("tab:blue", "tab:orange"), strict=True):
    for seed in range(4):
        plt.plot(*crossing(controller, seed), ".-", color=color, label=None if seed else name)
plt.plot(1.0, JETTY, "k*", markersize=12, label="jetty")
plt.xlabel("across the river")
plt.ylabel("along the river (current upwards)")
plt.legend()
plt.tight_layout()
plt.show()
