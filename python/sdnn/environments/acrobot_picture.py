"""The picture of the acrobot: links, joints, goal line and torque, drawn with pygame."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.environments.config import AcrobotConfig

if TYPE_CHECKING:
    import pygame

__all__ = ["AcrobotPicture"]

Point = tuple[float, float]

_SIZE = 500  # pixels
_FINE = 3  # drawn this much larger, then shrunk: smooth edges
_PAPER = (250, 249, 246)
_INK = (52, 58, 70)
_FAINT = (216, 214, 208)
_GOAL = (64, 145, 108)
_LINK_1 = (44, 92, 138)
_LINK_2 = (92, 152, 199)
_TORQUE = (224, 122, 47)
_FULL_TORQUE_ARC = 1.5 * math.pi  # the arc of the largest torque


class AcrobotPicture:
    """Draws states of the acrobot, into a window if ``window_fps`` is given.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        If pygame is missing.
    """

    def __init__(self, config: AcrobotConfig, window_fps: int | None) -> None:
        try:
            import pygame
        except ImportError as error:
            raise gym.error.DependencyNotInstalled(
                'rendering needs pygame: pip install "sdnn[render]"'
            ) from error
        self._pygame = pygame
        self._config = config
        self._fps = window_fps
        pygame.font.init()
        self._font = pygame.font.Font(None, 17 * _FINE)
        self._large_font = pygame.font.Font(None, 24 * _FINE)
        self._canvas = pygame.Surface((_SIZE * _FINE, _SIZE * _FINE))
        reach = config.link_length_1 + config.link_length_2
        self._scale = 0.42 * _SIZE * _FINE / max(reach, abs(config.goal_height))
        self._window: pygame.Surface | None = None
        if window_fps is not None:
            pygame.display.init()
            pygame.display.set_caption("sdnn: acrobot swing-up")
            self._window = pygame.display.set_mode((_SIZE, _SIZE))
            self._clock = pygame.time.Clock()

    def draw(
        self,
        *,
        state: NDArray[np.float64],
        torque: float,
        decision: int,
        tip_height: float,
        solved: bool,
    ) -> NDArray[np.uint8] | None:
        """Return the picture, shape (500, 500, 3), or None if it went to the window.

        Parameters
        ----------
        state : ndarray, shape (4,)
            theta1, theta2, theta1_dot, theta2_dot.
        torque, decision, tip_height, solved
            The torque held until now (N m), decisions made, height (m), whether the goal is
            reached.
        """
        pygame = self._pygame
        theta_1, theta_2 = float(state[0]), float(state[0] + state[1])
        elbow = self._end((0.0, 0.0), theta_1, self._config.link_length_1)
        tip = self._end(elbow, theta_2, self._config.link_length_2)
        self._canvas.fill(_PAPER)
        self._draw_background(solved)
        self._draw_link((0.0, 0.0), elbow, _LINK_1)
        self._draw_link(elbow, tip, _LINK_2)
        self._draw_joint((0.0, 0.0), 0.075)
        self._draw_joint(elbow, 0.065)
        self._disc(tip, 0.06, _GOAL if solved else _INK)
        self._draw_torque(elbow, torque)
        self._write((16, 16), f"decision {decision} / {self._config.max_decisions}", large=True)
        self._write((16, 42), f"height {tip_height:+.2f} m")
        self._write((16, 60), f"torque {torque:+.2f} N m", _TORQUE if torque else _INK)
        picture = pygame.transform.smoothscale(self._canvas, (_SIZE, _SIZE))
        if self._window is None:
            pixels: NDArray[np.uint8] = pygame.surfarray.array3d(picture)
            return np.ascontiguousarray(pixels.transpose(1, 0, 2))
        self._window.blit(picture, (0, 0))
        pygame.event.pump()
        assert self._fps is not None
        self._clock.tick(self._fps)
        pygame.display.flip()
        return None

    def close(self) -> None:
        """Close the window."""
        if self._window is not None:
            self._pygame.display.quit()
            self._window = None

    def _end(self, start: Point, angle: float, length: float) -> Point:
        return start[0] + length * math.sin(angle), start[1] - length * math.cos(angle)

    def _pixel(self, point: Point) -> Point:
        middle = _SIZE * _FINE / 2
        return middle + self._scale * point[0], middle - self._scale * point[1]

    def _disc(self, centre: Point, radius: float, colour: tuple[int, int, int]) -> None:
        self._pygame.draw.circle(self._canvas, colour, self._pixel(centre), radius * self._scale)

    def _draw_background(self, solved: bool) -> None:
        pygame, middle = self._pygame, self._pixel((0.0, 0.0))
        reach = self._config.link_length_1 + self._config.link_length_2
        pygame.draw.circle(self._canvas, _FAINT, middle, reach * self._scale, _FINE)
        y = self._pixel((0.0, self._config.goal_height))[1]
        dash = 10 * _FINE
        for left in range(0, _SIZE * _FINE, 2 * dash):
            width = (3 if solved else 2) * _FINE
            pygame.draw.line(self._canvas, _GOAL, (left, y), (left + dash, y), width)
        text = self._font.render(f"goal {self._config.goal_height:g} m", True, _GOAL)
        margin = 16 * _FINE
        self._canvas.blit(text, (_SIZE * _FINE - text.get_width() - margin, y + 7 * _FINE))
        if solved:
            text = self._large_font.render("goal reached", True, _GOAL)
            self._canvas.blit(text, (_SIZE * _FINE - text.get_width() - margin, margin))

    def _draw_link(self, start: Point, end: Point, colour: tuple[int, int, int]) -> None:
        dx, dy = end[0] - start[0], end[1] - start[1]
        half = 0.05 / math.hypot(dx, dy)
        side = (-dy * half, dx * half)
        corners = [
            self._pixel((x + sign * side[0], y + sign * side[1]))
            for (x, y), sign in ((start, 1), (end, 1), (end, -1), (start, -1))
        ]
        self._pygame.draw.polygon(self._canvas, colour, corners)
        self._disc(start, 0.05, colour)
        self._disc(end, 0.05, colour)

    def _draw_joint(self, centre: Point, radius: float) -> None:
        self._disc(centre, radius, _INK)
        self._disc(centre, 0.55 * radius, _PAPER)

    def _draw_torque(self, centre: Point, torque: float) -> None:
        sweep = _FULL_TORQUE_ARC * torque / self._config.max_torque
        if abs(sweep) < 0.02:
            return
        radius, turn = 0.24, math.copysign(1.0, sweep)
        begin = math.pi / 2 - sweep / 2
        n_points = 2 + int(40 * abs(sweep))
        for i in range(n_points):
            angle = begin + sweep * i / (n_points - 1)
            self._disc(self._around(centre, radius, angle), 0.016, _TORQUE)
        end = begin + sweep
        head = [
            self._around(centre, radius + 0.07, end),
            self._around(centre, radius - 0.07, end),
            self._around(centre, radius, end + turn * 0.5),
        ]
        self._pygame.draw.polygon(self._canvas, _TORQUE, [self._pixel(point) for point in head])

    def _around(self, centre: Point, radius: float, angle: float) -> Point:
        return centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)

    def _write(
        self,
        where: tuple[int, int],
        text: str,
        colour: tuple[int, int, int] = _INK,
        large: bool = False,
    ) -> None:
        font = self._large_font if large else self._font
        position = (where[0] * _FINE, where[1] * _FINE)
        self._canvas.blit(font.render(text, True, colour), position)
