"""Approximators of action values."""

from sdnn.approximators.sdnn_c import SDNNC, SDNNCConfig

__all__ = ["SDNNC", "SDNNCConfig"]
