"""The physics client and renderer that worlds are built on, one after another: opening OpenGL takes longer than a world."""
from __future__ import annotations

import pybullet
from pybullet_utils.bullet_client import BulletClient

from dr_eureka.simulation.quiet import quiet_stdout
from dr_eureka.simulation.rendering import open_renderer

# Bullet's OpenGL keeps each world's pictures, 2.5 MB for a sheet, until it is closed.
MOST_WORLDS = 64


class Stage:
    """A Bullet client, and the renderer `egl` or `tiny` where one was asked for.

    Args:
        choice: `auto`, `egl` or `tiny`, as in `CameraSettings.renderer`; None for worlds without pictures.

    Raises:
        SimulationError: `egl` was asked for and does not work here.
    """

    def __init__(self, choice: str | None) -> None:
        self._choice = choice
        self._client: BulletClient | None = None
        self._open()

    def _open(self) -> None:
        self._worlds = 0
        with quiet_stdout():
            self._client = BulletClient(pybullet.DIRECT)
            self.renderer = open_renderer(self._client, self._choice) if self._choice else None

    def clear(self) -> BulletClient:
        """Take everything away, so that the next world finds a client like new, and return it."""
        if self._worlds == MOST_WORLDS:
            self.close()
            self._open()
        self._worlds += 1
        self._client.resetSimulation()
        return self._client

    def close(self) -> None:
        """Free physics and renderer; a second call does nothing."""
        if self._client is not None:
            with quiet_stdout():
                self._client.disconnect()
            self._client = None
