"""Approximators of action values."""

from sdnn.approximators.sdnn_c import SDNNC
from sdnn.config import FuzzyRulesConfig, LinearSDNNConfig, RBFNetworkConfig, SDNNCConfig

__all__ = ["SDNNC", "FuzzyRulesConfig", "LinearSDNNConfig", "RBFNetworkConfig", "SDNNCConfig"]
