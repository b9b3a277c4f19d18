"""A study as data: named variants of any setting, compared with a reference by paired trials.

``sdnn sweep FILE`` reads a TOML file (`reading`, `study`), runs what is missing (`run`) and writes
what the trials say (`comparison`, `report`, `page`, `figure`).
"""
