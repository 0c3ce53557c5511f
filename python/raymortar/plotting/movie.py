"""Movies of paths: a picture for each step, with axes and colours in common."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arguments import as_path, writing
from ..core.errors import ContactError, positive, raise_everywhere, together
from . import drawing
from .frames import Frame, Ranges, gather_frame, label_of
from .labels import Units
from .picture import checked, draw, lacking, new_figure

if TYPE_CHECKING:
    from ..core.contact import Contact

# Limits (axes, 2) of the two axes of a picture
Limits = list[Any]
# Dots per inch
DPI = 100
# Rows of pixels by which each colour bar counts where the 256 colours of a GIF are chosen
BAR = 60


class Movie:
    """Pictures of a path as `plot` draws them, in a GIF. Collective.

    Make it before or after the solver. Rank 0 keeps what each picture shows until the
    movie is written, so that all have the same axes and colours.

    Parameters
    ----------
    contact
        Contact.
    file
        Path that ends in ``.gif``.
    field, label, view, x, centre, units, zoom, quantity
        The same as for `plot`.
    fps
        Pictures per second.

    Raises
    ------
    ContactError
        Without matplotlib, or if an argument cannot be used.

    Examples
    --------
    >>> movie = raymortar.plotting.Movie(contact, "press.gif", zoom=True)
    >>> for step in raymortar.LoadSteps(solver, press, steps=20):
    ...     movie.add(f"load {step.factor:.2f}")
    >>> movie.write()
    """

    def __init__(
        self,
        contact: Contact,
        file: str | Path,
        field: Any = None,
        label: str | None = None,
        view: tuple[float, float] = (-60.0, 20.0),
        x: str | None = None,
        centre: Sequence[float] | None = None,
        units: Units | None = None,
        zoom: bool = False,
        fps: float = 5.0,
        quantity: str = "pressure",
    ) -> None:
        self._options = checked(contact, field, x, centre, units, zoom, quantity)
        self.contact, self._comm = contact, contact.layout.comm
        with together(self._comm):
            self.path = as_path(file)
            if self.path.suffix != ".gif":
                raise ContactError(f"{self.path} must end in .gif")
            self._fps = positive("fps", fps)
        draws = self._comm.rank == 0
        fault = lacking("matplotlib", contact.u.function_space.mesh.geometry.dim)
        raise_everywhere(self._comm, fault if draws else None)
        self._field, self._view = field, view
        self._label = label_of(contact.u, field, label, self._options)
        self._frames: list[tuple[Frame, str]] = []

    def add(self, title: str = "") -> None:
        """Add a picture of the last update, with a title. Collective.

        Raises
        ------
        ContactError
            Before the first update or solve.
        """
        with together(self._comm):
            self.contact.points()  # raises before the first update
        frame = gather_frame(self.contact, self._field, self._options)
        if frame is not None:
            self._frames.append((frame, title))

    def write(self) -> None:
        """Write the pictures so far to the file. Collective.

        Raises
        ------
        ContactError
            If there are none, or if the file cannot be written.
        """
        empty = self._comm.rank == 0 and not self._frames
        fault = "a movie without pictures: call its add() after each step"
        raise_everywhere(self._comm, fault if empty else None)
        with writing(self._comm, self.path, OSError):
            if self._frames:
                self._write()

    def _write(self) -> None:
        """Draw all pictures twice: to find their limits, and within these."""
        from matplotlib import rc_context

        with rc_context(drawing.LOOK):
            figure, found = new_figure(False), []
            figure.set_dpi(DPI)
            ranges = Ranges.of([frame for frame, _ in self._frames])
            shown = ranges, self._label, self._view, self._options
            for frame, _ in self._frames:
                draw(figure, self.contact, frame, *shown)
                found.append(_limits(figure))
            ends = [np.array(of_one) for of_one in zip(*found)]  # (pictures, axes, 2)
            common = [
                np.column_stack([one[..., 0].min(axis=0), one[..., 1].max(axis=0)])
                for one in ends
            ]
            stage = _Stage(figure, common, [title for _, title in self._frames])
            pictures = []
            for frame, title in self._frames:
                draw(figure, self.contact, frame, *shown)
                _set_limits(figure, common)
                pictures.append(stage.picture(title))
        palette = _palette(pictures[-1])
        first, *others = (one.quantize(palette=palette, dither=0) for one in pictures)
        options = {"duration": 1000.0 / self._fps, "loop": 0}
        first.save(self.path, save_all=True, append_images=others, **options)


class _Stage:
    """Draws what pictures of a movie share once, as texts are slow.

    Parameters
    ----------
    figure
        Figure that has drawn a picture.
    limits
        Limits of its axes.
    titles
        Titles of all pictures; the longest needs room.
    """

    def __init__(self, figure: Any, limits: Limits, titles: Sequence[str]) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        self._figure, self._canvas = figure, FigureCanvasAgg(figure)
        _set_limits(figure, limits)
        drawing.fit_ticks(figure)
        figure.suptitle(max(titles, key=len))
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        for axes in figure.axes[:2]:
            drawing.clear(axes)
        figure.suptitle("")
        _set_limits(figure, limits)
        self._canvas.draw()
        self._background = self._canvas.copy_from_bbox(figure.bbox)

    def picture(self, title: str) -> Any:
        """Picture of what the figure shows now, of PIL."""
        from PIL import Image

        artists = [self._figure.suptitle(title)]
        for axes in self._figure.axes[:2]:
            of_axes = [axes]  # those in space have no background
            if not hasattr(axes, "zaxis"):
                of_axes = [*drawing.contents(axes), *axes.spines.values()]
            artists += sorted(of_axes, key=lambda one: float(one.get_zorder()))
        self._canvas.restore_region(self._background)
        for one in artists:
            one.draw(self._canvas.get_renderer())
        return Image.fromarray(np.array(self._canvas.buffer_rgba())[..., :3])


def _palette(picture: Any) -> Any:
    """Colours of a picture and of colour bars, for all pictures of a GIF."""
    from matplotlib import colormaps
    from PIL import Image

    pixels = np.asarray(picture)
    share = np.linspace(0.0, 1.0, pixels.shape[1])
    bars = [colormaps[name](share)[:, :3] for name in drawing.MAPS]
    rows = np.repeat((255 * np.array(bars)).astype(np.uint8), BAR, axis=0)
    return Image.fromarray(np.concatenate([pixels, rows])).quantize(256)


def _limits(figure: Any) -> Limits:
    """Limits of both axes, (axes, 2) each."""
    found = []
    for axes in figure.axes[:2]:
        names = ("x", "y", "z") if hasattr(axes, "zaxis") else ("x", "y")
        found.append(np.array([getattr(axes, f"get_{name}lim")() for name in names]))
    return found


def _set_limits(figure: Any, limits: Limits) -> None:
    """Set the limits of both axes."""
    for axes, of_one in zip(figure.axes, limits):
        for name, (low, high) in zip("xyz", of_one):
            getattr(axes, f"set_{name}lim")(low, high)
        if len(of_one) == 3:
            axes.set_box_aspect(np.ptp(of_one, axis=1))
