"""Answers imports of Stable-Baselines3's modules, such as ``sdnn.common.callbacks``, with ours."""

raise ModuleNotFoundError(
    "sdnn has no modules of Stable-Baselines3: evaluation and callbacks are in sdnn.agents:"
    " `from sdnn.agents import evaluate, Callback`; `gymnasium.make_vec(id, num_envs=...)` makes"
    " vector environments; the page 'Migrate from Stable-Baselines3' lists what else corresponds",
    name=__name__,
)
