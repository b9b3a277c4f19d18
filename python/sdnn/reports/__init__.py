"""Pages, plots and statistics of results."""
