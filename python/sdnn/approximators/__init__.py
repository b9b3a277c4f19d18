"""Approximators of action values."""

from sdnn.approximators.sdnn_c import SDNNC
from sdnn.config import FuzzyRulesConfig, RBFNetworkConfig, SDNNCConfig

__all__ = ["SDNNC", "FuzzyRulesConfig", "RBFNetworkConfig", "SDNNCConfig"]
