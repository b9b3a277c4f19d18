"""The training loop, evaluations and callbacks; `sdnn.agents` has the public names."""
