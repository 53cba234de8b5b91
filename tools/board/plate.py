"""A plate under the tool: what is milled, and which of it has been sent."""

import numpy as np

from fresa.machines.mill import PIXEL_STEPS, Z_TRAVEL
from tb.engines import Changes
from tb.plant import Plant

from .messages import CORNER, PIXEL, Job

__all__ = ["COILS", "Plate"]

#: Outputs of the board that are coil words.
COILS = ("axis_x", "axis_y", "axis_z")

#: Corners after which the path starts again: a machine may be jogged without end.
MOST_CORNERS = 1 << 20


class Plate:
    """A plate, and the motors that move the tool over it.

    Parameters
    ----------
    job : Job
        The picture to mill.
    words : Changes
        The coil words at the start: over the first pixel, on the face of the plate.

    Attributes
    ----------
    plant : Plant
        The motors and the tool.
    """

    def __init__(self, job: Job, words: Changes) -> None:
        self.plant = Plant(job.pixels, pitch=PIXEL_STEPS, travel=Z_TRAVEL, axes=COILS)
        self.plant.feed(words)
        self._columns = job.pixels.shape[1]
        self._corners = self._milled = 0
        self._path_anew = self._cut_anew = True

    @property
    def at_origin(self) -> bool:
        """Whether the tool is where it started."""
        return self.plant.position == (0, 0, 0)

    @property
    def pierced(self) -> bool:
        """Whether the tool is in the plate."""
        return self.plant.position[2] < 0

    @property
    def right(self) -> bool:
        """Whether every target pixel is cut, and the tool is back."""
        return self.at_origin and bool((self.plant.cut >= self.plant.target).all())

    def feed(self, changes: Changes) -> None:
        """Continue with these coil words."""
        self.plant.feed(changes)
        if self.plant.turns > MOST_CORNERS:
            self.plant.forget_path()
            self._corners, self._path_anew = 0, True

    def take_path(self) -> tuple[bytes, bytes, bool]:
        """Return the corners fixed since the last call, the tool's place, and if the path is new.

        Both are `CORNER`; a movement up or down has no corner.
        """
        known = max(0, self._corners - 1)
        places = self.plant.corners_from(known)
        before = np.concatenate([places[:1], places[:-1]])
        corners = np.zeros(len(places), CORNER)
        corners["x"], corners["y"] = places[:, 0], places[:, 1]
        corners["flags"] = (places[:, 2] < 0) | (before[:, 2] < 0)
        moved = (places[:, :2] != before[:, :2]).any(axis=1)
        moved[0] = known == 0
        fixed = slice(self._corners - known, len(places) - 1)
        self._corners = known + len(places) - 1
        anew, self._path_anew = self._path_anew, False
        return corners[fixed][moved[fixed]].tobytes(), corners[-1:].tobytes(), anew

    def take_cut(self) -> tuple[bytes, bool]:
        """Return the pixels cut since the last call, as `PIXEL`, and if the plate is new."""
        milled = self.plant.milled_from(self._milled)
        self._milled += len(milled)
        anew, self._cut_anew = self._cut_anew, False
        return (milled @ [self._columns, 1]).astype(PIXEL).tobytes(), anew
