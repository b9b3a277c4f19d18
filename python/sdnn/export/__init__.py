"""Trained agents in a form for other programs: C headers for small processors."""

from sdnn.export.header import c_header, export_c_header, load_image, save_image
from sdnn.export.new import new_agent
from sdnn.export.writer import CHeader

__all__ = ["CHeader", "c_header", "export_c_header", "load_image", "new_agent", "save_image"]
