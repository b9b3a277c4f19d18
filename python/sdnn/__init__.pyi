from sdnn import (
    agents as agents,
    approximators as approximators,
    benchmarks as benchmarks,
    coding as coding,
    environments as environments,
    estimators as estimators,
    export as export,
    libsdnn as libsdnn,
    reproduction as reproduction,
    runs as runs,
)
from sdnn.agents import (
    FuzzyQLearning as FuzzyQLearning,
    RBFQLearning as RBFQLearning,
    SDNNActorCritic as SDNNActorCritic,
    SDNNQLambda as SDNNQLambda,
    SDNNQLearning as SDNNQLearning,
)
from sdnn.estimators import (
    SDNNClassifier as SDNNClassifier,
    SDNNKernelClassifier as SDNNKernelClassifier,
    SDNNKernelRidge as SDNNKernelRidge,
    SDNNRegressor as SDNNRegressor,
)
from sdnn.support.machine import (
    instruction_set as instruction_set,
    set_instruction_set as set_instruction_set,
)

__version__: str
