"""Names of the agents that are SDNN-C with a preset; light, for the command line."""

PRESET_AGENTS = {
    "paper": "sdnn-c",
    "robust": "sdnn-c-robust",
    "general": "sdnn-c-general",
    "small": "sdnn-c-small",
}
"""The agents that are SDNN-C under the settings of `sdnn.agents.PRESETS`."""
