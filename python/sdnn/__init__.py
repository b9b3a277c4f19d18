"""Selective desensitization neural networks: exact, online, fast.

Packages, from the network up (each is imported when first used):

- ``sdnn.approximators``: SDNN-C, a network that gives Q(s, a) for every action at once
- ``sdnn.agents``: Q-learning with it, for any Gymnasium environment; its classes are here, too:
  ``from sdnn import SDNNQLambda``
- ``sdnn.SDNNRegressor``, ``sdnn.SDNNClassifier``: the network as scikit-learn estimators;
  ``sdnn.SDNNKernelRidge``, ``sdnn.SDNNKernelClassifier``: ridge regression with its kernel
  (package ``sdnn.estimators``, needs ``sdnn[sklearn]``)
- ``sdnn.libsdnn``: the files and numbers of the library LIBSDNN
- ``sdnn.coding``: how inputs become patterns; ``sdnn.coding.kernel``: the kernel of the code
- ``sdnn.environments``: the acrobot swing-up, redundant and noisy sensors
- ``sdnn.export``: agents and estimators as C headers, also as the command ``sdnn export``
- ``sdnn.reproduction``: the paper's experiments, also as the command ``sdnn reproduce``
- ``sdnn.runs``: trainings, each in a folder, also as the command ``sdnn train``
- ``sdnn.benchmarks``: speed on this machine, also as the command ``sdnn bench``

``sdnn.instruction_set()`` and ``sdnn.set_instruction_set(name)``: which vector instructions the
core uses.
"""

from sdnn._core import __version__ as __version__
from sdnn.support.lazy import attach

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "sdnn": (
            "agents approximators benchmarks coding environments estimators export libsdnn "
            "reproduction runs"
        ),
        "sdnn.agents": ("FuzzyQLearning RBFQLearning SDNNActorCritic SDNNQLambda SDNNQLearning"),
        "sdnn.estimators": "SDNNClassifier SDNNKernelClassifier SDNNKernelRidge SDNNRegressor",
        "sdnn.support.machine": "instruction_set set_instruction_set",
    },
    others="sdnn.agents sdnn.environments",
)
