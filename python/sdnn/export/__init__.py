"""Agents and estimators in a form for other programs: C headers for small processors."""

from sdnn.export.estimator_text import EstimatorHeader
from sdnn.export.estimators import estimator_header, export_estimator_header
from sdnn.export.header import c_header, export_c_header, load_image, save_image
from sdnn.export.new import new_agent
from sdnn.export.small import small_settings
from sdnn.export.writer import CHeader

__all__ = [
    "CHeader",
    "EstimatorHeader",
    "c_header",
    "estimator_header",
    "export_c_header",
    "export_estimator_header",
    "load_image",
    "new_agent",
    "save_image",
    "small_settings",
]
