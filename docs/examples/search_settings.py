# %% [markdown]
# # Search for settings with Optuna
#
# Five settings of the default agent matter most. The first trial has the defaults. Whether the best
# trial is better, other seeds must tell: the best of many is partly luck.

# %%
from dataclasses import replace
from statistics import fmean

import optuna

from sdnn import SDNNQLambda
from sdnn.agents import evaluate

general = SDNNQLambda.presets["general"].learning
NAMES = ("trace_decay", "epsilon", "final_learning_rate", "max_action_repeat")
defaults = {name: getattr(general, name) for name in NAMES} | {"horizon": 100.0}


def learning_of(trial):
    return replace(
        general,
        discount=1 - 1 / trial.suggest_float("horizon", 10, 1_000, log=True),
        trace_decay=trial.suggest_float("trace_decay", 0.0, 0.95),
        epsilon=trial.suggest_float("epsilon", 0.01, 0.3, log=True),
        final_learning_rate=trial.suggest_float("final_learning_rate", 0.01, 1.0, log=True),
        max_action_repeat=trial.suggest_int("max_action_repeat", 1, 200, log=True),
    )


def mean_return(learning, seeds, env_id="CartPole-v1", steps=5_000):
    agents = [SDNNQLambda(env_id, learning=learning, seed=seed) for seed in seeds]
    for agent in agents:
        agent.train(env_id, steps)
    return fmean(evaluate(agent, env_id, 10).mean_return for agent in agents)


search = optuna.create_study(direction="maximize", sampler=optuna.samplers.TPESampler(seed=1))
search.enqueue_trial(defaults)
search.optimize(lambda trial: mean_return(learning_of(trial), range(3)), n_trials=8)
for name, learning in (("defaults", general), ("best", learning_of(search.best_trial))):
    print(f"{name}: {mean_return(learning, range(100, 105)):.1f} with other seeds")
