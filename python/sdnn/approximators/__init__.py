"""Approximators of action values."""

from sdnn.approximators.fuzzy_rules import FuzzyRulesConfig
from sdnn.approximators.rbf_network import RBFNetworkConfig
from sdnn.approximators.sdnn_c import SDNNC, SDNNCConfig

__all__ = ["SDNNC", "FuzzyRulesConfig", "RBFNetworkConfig", "SDNNCConfig"]
