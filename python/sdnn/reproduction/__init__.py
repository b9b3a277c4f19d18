"""The paper: its experiments, claims, costs and figures.

Names are loaded when they are first used, so that the command line starts quickly.
"""

from sdnn.support.lazy import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
