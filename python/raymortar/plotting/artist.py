"""Facets in space as an image of matplotlib, exact where bodies touch."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import proj3d

from ..core.compat import Array
from .hidden import edges_seen, fans, nearest
from .views import direction

# Pixels of the image along each side of one that is shown
FINER = 2
# Depth by which edges are before their facets, as a share of the picture's
LIFT = 2e-3
# Opacity of edges
EDGES = 0.75


class Facets(Artist):  # type: ignore[misc]
    """Facets in axes in space, each point in the colour of its value.

    Parameters
    ----------
    polygons
        Points around facets, (n, k, 3).
    values
        Values at these, (n, k).
    light
        Brightness of each facet, (n,).
    colours
        `ScalarMappable` of matplotlib.
    """

    def __init__(
        self, polygons: Array, values: Array, light: Array, colours: Any
    ) -> None:
        super().__init__()
        self.polygons, self.values, self.light = polygons, values, light
        self.colours = colours
        self.set_zorder(1)
        self._drawn: tuple[Any, Any] | None = None

    def _in_pixels(self) -> Array:
        """Polygons in pixels of the figure and depth."""
        axes: Any = self.axes
        x = self.polygons.reshape(-1, 3)
        across, up, _ = proj3d.proj_transform(*x.T, axes.get_proj())
        flat = axes.transData.transform(np.column_stack([across, up]))
        depth = x @ direction(axes.azim, axes.elev)
        return np.column_stack([flat, depth]).reshape(self.polygons.shape)

    def get_window_extent(self, renderer: Any = None) -> Any:
        """Box around the facets, in pixels of the figure."""
        at = self._in_pixels()[..., :2].reshape(-1, 2)
        return Bbox([at.min(axis=0), at.max(axis=0)])

    def draw(self, renderer: Any) -> None:
        """Draw the image."""
        at, finer = self._in_pixels(), FINER * renderer.get_image_magnification()
        corner = np.floor(at[..., :2].min(axis=(0, 1))) - 1.0
        size = np.ceil(at[..., :2].max(axis=(0, 1)) - corner).astype(int) + 1
        at = (at - [*corner, 0.0]) * [finer, finer, 1.0]
        columns, rows = np.ceil(size * finer / FINER).astype(int) * FINER
        # A layout draws a figure more than once
        key = at.tobytes(), rows, columns
        if self._drawn is None or self._drawn[0] != key:
            self._drawn = key, self._image(at, (rows, columns))
        context = renderer.new_gc()
        renderer.draw_image(context, *corner, self._drawn[1])
        context.restore()
        self.stale = False

    def _image(self, at: Array, shape: tuple[int, int]) -> Any:
        """Colours of the pixels that are shown, row by row from below."""
        number, share, depth = nearest(fans(at), shape)
        seen = number >= 0
        values = fans(self.values[..., None])[..., 0]
        shown = np.einsum("ni,ni->n", share[seen], values[number[seen]])
        fine = np.zeros((len(number), 4))
        fine[seen] = self.colours.to_rgba(shown)
        fine[seen, :3] *= self.light[number[seen] // at.shape[1], None]
        segments = np.stack([at, np.roll(at, -1, axis=1)], axis=2).reshape(-1, 2, 3)
        lift = LIFT * float(np.ptp(at[..., 2]))
        drawn = edges_seen(segments, depth.reshape(shape), lift)
        fine[drawn, :3] *= 1.0 - EDGES
        fine[drawn, 3] = 1.0
        rows, columns = shape[0] // FINER, shape[1] // FINER
        fine[:, :3] *= fine[:, 3:]
        means = fine.reshape(rows, FINER, columns, FINER, 4).mean(axis=(1, 3))
        opaque = means[..., 3:] > 0.0
        means[..., :3] = np.where(opaque, means[..., :3], 0.0)
        np.divide(means[..., :3], means[..., 3:], out=means[..., :3], where=opaque)
        bytes_of = (255.0 * np.clip(means, 0.0, 1.0) + 0.5).astype(np.uint8)
        return np.ascontiguousarray(bytes_of)
