"""Style and files of all figures.

matplotlib is an extra and is imported when it is needed. Figures are made without pyplot, so no
window, backend or style of the user's session is touched.
"""

from __future__ import annotations

import textwrap
from io import BytesIO
from typing import TYPE_CHECKING, Literal, TypeAlias

from sdnn.support.interrupts import stay_interrupts

if TYPE_CHECKING:
    import matplotlib.axes
    import matplotlib.figure

Axes: TypeAlias = "matplotlib.axes.Axes"
Figure: TypeAlias = "matplotlib.figure.Figure"

COLORS = (
    "#1f5a96", "#c2542d", "#3c7d4b", "#7a5195", "#8a6d1d", "#4a4a4a",
    "#2a9d9d", "#c65b8e", "#7fa328", "#9b3d3d",
)  # fmt: skip
WIDTH = 9.2  # inches of a figure that fills a page
NARROW_WIDTH, NARROW_DPI = 5.4, 144
"""Inches and resolution of figures for telephones: two pixels for each of 390."""
_NARROW_FOOTER = 100  # characters of a line below a narrow figure

INK, FAINT, GRID = "#2b2b2b", "#6f6f6f", "#e4e4e4"


def new_figure(width: float, height: float) -> Figure:
    """Make a figure whose panels leave room for titles, legend and footer."""
    import matplotlib.figure

    return matplotlib.figure.Figure(figsize=(width, height), layout="constrained")


def color_of(index: int) -> str:
    """Return the color of an item by its index in a fixed list."""
    return COLORS[index % len(COLORS)]


def figure_bytes(figure: Figure) -> tuple[bytes, bytes]:
    """Return a figure as PNG and as SVG; equal figures give equal bytes."""
    return png_bytes(figure), svg_bytes(figure)


def svg_bytes(figure: Figure) -> bytes:
    """Return a figure as SVG; equal figures give equal bytes."""
    from matplotlib import rc_context

    svg = BytesIO()
    with stay_interrupts(), rc_context({"svg.hashsalt": "sdnn"}):
        figure.savefig(svg, format="svg", metadata={"Date": None})
    return svg.getvalue()


def png_bytes(figure: Figure, dpi: int = 200) -> bytes:
    """Return a figure as PNG of 256 colours, which takes a third of the bytes of all colours."""
    from PIL import Image  # comes with matplotlib

    drawn, png = BytesIO(), BytesIO()
    with stay_interrupts():
        figure.savefig(drawn, format="png", dpi=dpi)
        with Image.open(drawn) as image:
            few = image.convert("RGB").quantize(256, dither=Image.Dither.NONE)
            few.save(png, "PNG", optimize=True, dpi=(dpi, dpi))
    return png.getvalue()


def style(axes: Axes, grid: Literal["x", "y"] = "y") -> None:
    """Draw a panel in the style of all figures of trials, with grid lines across one axis."""
    axes.grid(axis=grid, color=GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=8.5)
    axes.spines[["top", "right"]].set_visible(False)


def label(figure: Figure, title: str, below: str, footer: str, color: str = FAINT) -> None:
    """Write a title, a line below it, and small lines at the foot, for which panels make room.

    Dollar signs stay as they are: the user's titles hold no formulas.
    """
    from matplotlib.text import Text

    figure.suptitle(f"{title}\n", x=0.012, ha="left", fontsize=12, color=INK)
    y = 1 - 0.32 / figure.get_figheight()  # 0.32 inches below the top
    figure.text(0.012, y, below, fontsize=8.5, va="top", color=color)
    figure.supxlabel(footer, x=0.012, ha="left", fontsize=6.5, color=FAINT, linespacing=1.4)
    for text in figure.findobj(Text):
        text.set_parse_math(False)


def wrapped(text: str, n_characters: int = _NARROW_FOOTER) -> str:
    """Break the lines of a text so that they fit a narrow figure, its footer by default."""
    return "\n".join(textwrap.fill(line, n_characters) for line in text.splitlines())
