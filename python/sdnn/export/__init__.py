"""Trained agents in a form for other programs: C headers for small processors."""

from sdnn.export.header import CHeader, c_header, export_c_header

__all__ = ["CHeader", "c_header", "export_c_header"]
