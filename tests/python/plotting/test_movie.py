"""Movies of paths: as many pictures as steps, with axes and colours in common."""

import numpy as np
import pytest
from problems import COMM
from rigid_scenes import press

import raymortar
from raymortar import ContactError, rigid
from raymortar.plotting import movie as movies

pytest.importorskip("matplotlib")


def path(cell, file, n=2, **options):
    """Two steps of a small ball into a block; the movie."""
    dim = 2 if cell in ("triangle", "quadrilateral") else 3
    shape = (rigid.Circle, rigid.Sphere)[dim - 2]((*(0.4,) * (dim - 1), 1.5), 0.5)
    body = rigid.Body(shape, name="ball")
    found = press(cell, body, n=n)
    movie = raymortar.plotting.Movie(found.contact, file, **options)

    def move(t):
        body.move((0.1 * t, *(0.0,) * (dim - 2), -0.1 * t))

    for step in raymortar.LoadSteps(found.problem.snes_solver, move, steps=2):
        movie.add(f"load {step.factor:.1f}")
    return movie


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_pictures_have_axes_and_colours_in_common(cell, folder, monkeypatch):
    from PIL import Image

    file, shown = folder / "ball.gif", []
    keep = movies._set_limits

    def watch(figure, limits):
        keep(figure, limits)
        bars = [a.get_ylim() for a in figure.axes if a.get_label() == "<colorbar>"]
        shown.append((np.vstack(movies._limits(figure)), np.array(bars)))

    monkeypatch.setattr(movies, "_set_limits", watch)
    movie = path(cell, file, fps=4.0)
    movie.write()
    if COMM.rank > 0:
        assert not shown
        return
    for one, other in zip(shown, shown[1:]):
        for values, following in zip(one, other):
            np.testing.assert_allclose(values, following)
    with Image.open(file) as pictures:
        assert pictures.n_frames == 2
        assert pictures.info["duration"] == 250
        first = np.asarray(pictures.convert("L"), dtype=float)
        pictures.seek(1)
        second = np.asarray(pictures.convert("L"), dtype=float)
    assert first.shape == second.shape and np.abs(first - second).max() > 50


def test_pictures_share_axes_and_texts(folder, monkeypatch):
    """Texts take most of the time of a picture: they are drawn once for all."""
    from matplotlib import axis

    movie, drawn = path("triangle", folder / "ball.gif"), []
    keep = axis.Axis.draw
    monkeypatch.setattr(axis.Axis, "draw", lambda *a: drawn.append(a) or keep(*a))
    counts = []
    for times in (1, 4):
        movie._frames = movie._frames[:2] * times
        drawn.clear()
        movie.write()
        counts.append(len(drawn))
    assert counts[0] == counts[1] > 0


def test_what_is_no_movie_is_refused(folder):
    found = press("triangle", rigid.Circle((0.4, 1.5), 0.5))
    file = folder / "ball.gif"
    with pytest.raises(ContactError, match="there are no results yet"):
        raymortar.plotting.Movie(found.contact, file).add()
    found.contact.update()
    with pytest.raises(ContactError, match="ball.png must end in .gif"):
        raymortar.plotting.Movie(found.contact, folder / "ball.png")
    with pytest.raises(ContactError, match="fps = 0 must be a positive number"):
        raymortar.plotting.Movie(found.contact, file, fps=0)
    with pytest.raises(ContactError, match="a movie without pictures: call its add"):
        raymortar.plotting.Movie(found.contact, file).write()
    movie = raymortar.plotting.Movie(found.contact, folder / "nowhere" / "ball.gif")
    movie.add()
    with pytest.raises(ContactError, match="nowhere/ball.gif cannot be written"):
        movie.write()
