"""Pictures of the acrobot, drawn with pygame, and its states between two decisions."""

from __future__ import annotations

import cmath
import dataclasses
import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.config import AcrobotConfig

if TYPE_CHECKING:
    import pygame

Colour = tuple[int, int, int]

_SIZE = 500  # pixels
_FINE = 3  # pictures are drawn larger by this factor, then shrunk, for smooth edges
_PAPER = (250, 249, 246)
_INK = (52, 58, 70)
_FAINT = (216, 214, 208)
_GOAL = (64, 145, 108)
_LINK_1 = (44, 92, 138)
_LINK_2 = (92, 152, 199)
_TORQUE = (224, 122, 47)
_FULL_TORQUE_ARC = 1.5 * math.pi  # the arc of the largest torque
_LONGEST = 0.04  # longest seconds between pictures of a smooth movement: 25 a second; chosen


class AcrobotMotion:
    """The acrobot's states between two decisions, ``interval`` seconds apart, for moving pictures.

    The interval is at most 0.04 s (or one integration step) and divides the decision interval.
    """

    def __init__(self, config: AcrobotConfig) -> None:
        n_steps = round(config.decision_interval / config.integration_step)
        # A quotient that rounding left just below a whole number counts as that number.
        most_steps = max(1, int(_LONGEST / config.integration_step * (1.0 + 1e-9)))
        # The most integration steps between two pictures that divide those of a decision.
        steps_between = next(n for n in range(min(most_steps, n_steps), 0, -1) if n_steps % n == 0)
        self.interval = steps_between * config.integration_step
        self._n_intervals = n_steps // steps_between
        config_between = dataclasses.replace(
            config, decision_interval=self.interval, max_decisions=self._n_intervals
        )
        self._acrobot = _core.Acrobot(config_between)
        self._tests_goal = config.goal_test == "every_step"

    def between(
        self, state: NDArray[np.float64], torque: float, goal_tolerance: float
    ) -> Iterator[NDArray[np.float64]]:
        """Yield the states, shape (4,), after ``state`` until the next decision or the goal."""
        self._acrobot.set_state(state)
        for _ in range(self._n_intervals - 1):
            # At a tolerance of 0 no speed is low enough for the goal.
            tolerance = goal_tolerance if self._tests_goal else 0.0
            _, reached, _ = self._acrobot.step(torque, tolerance)
            if reached:
                return
            yield self._acrobot.state()


class AcrobotPicture:
    """Draws states of the acrobot, into a window if ``window_fps`` is given; needs pygame."""

    def __init__(self, config: AcrobotConfig, window_fps: int | None) -> None:
        try:
            import pygame
        except ImportError as error:
            raise gym.error.DependencyNotInstalled(
                "rendering needs pygame: pip install pygame-ce"
            ) from error
        self._pygame = pygame
        self._config = config
        self._fps = window_fps or 0
        pygame.font.init()
        self._font = pygame.font.Font(None, 17 * _FINE)
        self._large_font = pygame.font.Font(None, 24 * _FINE)
        self._canvas = pygame.Surface((_SIZE * _FINE, _SIZE * _FINE))
        self._reach = config.link_length_1 + config.link_length_2
        # Pixels per metre: the links reach from the middle almost to the border.
        self._scale = 0.42 * _SIZE * _FINE / max(self._reach, abs(config.goal_height))
        self._window: pygame.Surface | None = None
        if window_fps is not None:
            pygame.display.init()
            pygame.display.set_caption("sdnn: acrobot swing-up")
            self._window = pygame.display.set_mode((_SIZE, _SIZE))
            self._clock = pygame.time.Clock()

    def draw(
        self, state: NDArray[np.float64], torque: float, decision: int, solved: bool
    ) -> NDArray[np.uint8] | None:
        """Return the picture, shape (500, 500, 3), or None if it went to the window.

        The torque (N m) is the last one held, ``decision`` the number of decisions made, ``solved``
        whether the goal is reached, which is written.
        """
        pygame = self._pygame
        # Angles from the horizontal: a link at theta = 0 hangs down, and theta2 is relative.
        angle_1 = state[0] - math.pi / 2
        angle_2 = angle_1 + state[1]
        elbow = cmath.rect(self._config.link_length_1, angle_1)
        tip = elbow + cmath.rect(self._config.link_length_2, angle_2)
        self._canvas.fill(_PAPER)
        self._draw_background(solved)
        self._draw_link(0j, elbow, _LINK_1)
        self._draw_link(elbow, tip, _LINK_2)
        for centre, radius in ((0j, 0.075), (elbow, 0.065)):  # radii of the joints, in metres
            self._disc(centre, radius, _INK)
            self._disc(centre, 0.55 * radius, _PAPER)
        self._disc(tip, 0.06, _GOAL if solved else _INK)
        self._draw_torque(elbow, torque)
        self._write(16, 16, f"decision {decision} / {self._config.max_decisions}", self._large_font)
        self._write(16, 42, f"height {tip.imag:+.2f} m")
        self._write(16, 60, f"torque {torque:+.2f} N m", colour=_TORQUE if torque else _INK)
        picture = pygame.transform.smoothscale(self._canvas, (_SIZE, _SIZE))
        if self._window is None:
            pixels: NDArray[np.uint8] = pygame.surfarray.array3d(picture)
            return np.ascontiguousarray(pixels.transpose(1, 0, 2))
        self._window.blit(picture, (0, 0))
        pygame.event.pump()
        self._clock.tick(self._fps)
        pygame.display.flip()
        return None

    def close(self) -> None:
        """Close the window."""
        if self._window is not None:
            self._pygame.display.quit()
            self._window = None

    # Points are complex numbers, in m from joint 1.

    def _pixel(self, point: complex) -> tuple[float, float]:
        """Return the pixel of a point on the canvas, whose y axis points down."""
        middle = _SIZE * _FINE / 2
        return middle + self._scale * point.real, middle - self._scale * point.imag

    def _disc(self, centre: complex, radius: float, colour: Colour) -> None:
        self._pygame.draw.circle(self._canvas, colour, self._pixel(centre), radius * self._scale)

    def _polygon(self, corners: Iterable[complex], colour: Colour) -> None:
        self._pygame.draw.polygon(self._canvas, colour, [self._pixel(point) for point in corners])

    def _write(self, x: int, y: float, text: str, font: Any = None, colour: Colour = _INK) -> None:
        """Write text at x, which counts from the right border if negative."""
        drawn = (font or self._font).render(text, True, colour)
        left = x * _FINE if x >= 0 else (_SIZE + x) * _FINE - drawn.get_width()
        self._canvas.blit(drawn, (left, y * _FINE))

    def _draw_background(self, solved: bool) -> None:
        """Draw the reach of the links, and the goal: a label and a dashed line, thick if solved."""
        draw = self._pygame.draw
        draw.circle(self._canvas, _FAINT, self._pixel(0j), self._reach * self._scale, _FINE)
        y = self._pixel(self._config.goal_height * 1j)[1]
        dash = 10 * _FINE
        for left in range(0, _SIZE * _FINE, 2 * dash):
            width = (3 if solved else 2) * _FINE
            draw.line(self._canvas, _GOAL, (left, y), (left + dash, y), width)
        self._write(-16, y / _FINE + 7, f"goal {self._config.goal_height:g} m", colour=_GOAL)
        if solved:
            self._write(-16, 16, "goal reached", self._large_font, _GOAL)

    def _draw_link(self, start: complex, end: complex, colour: Colour) -> None:
        """Draw a link 0.1 m wide with round ends."""
        side = 0.05j * (end - start) / abs(end - start)
        self._polygon((start + side, end + side, end - side, start - side), colour)
        self._disc(start, 0.05, colour)
        self._disc(end, 0.05, colour)

    def _draw_torque(self, centre: complex, torque: float) -> None:
        """Draw an arrow around a joint, as long as the torque is large; lengths are in metres."""
        sweep = _FULL_TORQUE_ARC * torque / self._config.max_torque
        if abs(sweep) < 0.02:  # radians: too short to be seen
            return
        angles = np.linspace(-sweep / 2, sweep / 2, 2 + int(40 * abs(sweep))) + math.pi / 2
        for angle in angles:
            self._disc(centre + cmath.rect(0.24, angle), 0.016, _TORQUE)
        end = angles[-1]
        arrow = ((0.31, end), (0.17, end), (0.24, end + math.copysign(0.5, sweep)))
        self._polygon((centre + cmath.rect(*point) for point in arrow), _TORQUE)
