"""Bodies in space drawn by pyvista: in memory without a display, in a window, or for a page."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import RunError
from shellmb.observers.files.described import Described
from shellmb.show.fields import Fields
from shellmb.show.space.colours import MARKS, PLAIN, Colouring, colouring, values
from shellmb.show.space.display import canvas, has_display
from shellmb.show.space.shapes import Pieces, Shape, Slab, State, read_state, shape_of
from shellmb.show.space.views import THEMES, Appearance, View, axes, enlargement, look, view_of

if TYPE_CHECKING:
    from PIL.Image import Image


# width of pictures, pixels, and how much larger they are drawn before their edges are smoothed
WIDTH, FINER = 960, 2
USUAL = Appearance()
COLOURS, NO_VALUE = "viridis", "lightgrey"
REFERENCE_LINE = "#8a8a8a"
JOINTS, OBSTACLES = "joints", "obstacles"
RIGID, OBSTACLE = "#c9772b", "#7f93a8"
# an arrow of the largest force, and the least half thickness of shells, radii of beams without a
# size, of pins and of rigid bodies, parts of the size of the scene
ARROW, SHEET, THIN, PIN, KNOB = 0.25, 0.0015, 0.004, 0.007, 0.01
LIT: dict[str, Any] = {"ambient": 0.45, "diffuse": 0.65, "specular": 0.25, "specular_power": 20}


@dataclass(frozen=True)
class Showing:
    """Content of a picture: bodies, their states, colours, and a view.

    Args:
        described: The scene.
        shapes: Bodies by name.
        states: States by the name of the body, one dict for each time.
        shown: What the colours show.
        limits: Values of the first and the last colour.
        view: The view.
        factor: By which displacements are shown larger.
        force: The largest force in a joint, 0 without any.
        caption: What stands above instead of the time.
        bar: Whether the scale of the colours is drawn.
        colours: A colour map of matplotlib's, or its name.
        appearance: How it looks.
    """

    described: Described
    shapes: dict[str, Shape]
    states: list[dict[str, State]]
    shown: Colouring
    limits: tuple[float, float]
    view: View
    factor: float
    force: float
    caption: str = ""
    bar: bool = True
    colours: Any = COLOURS
    appearance: Appearance = USUAL

    @property
    def extent(self) -> View:
        """Positions whose extent has numbers: those seen, or the reference if it is enlarged."""
        if self.factor == 1:
            return self.view
        return view_of(np.concatenate([s.reference for s in _bodies(self.shapes).values()]))

    def place(self, name: str, state: State) -> Floats:
        """Positions at which the nodes of a body are drawn, shape (n, 3)."""
        X = self.shapes[name].reference
        return np.asarray(X + self.factor * (state.position - X))

    def title(self, states: dict[str, State]) -> str:
        """Title above a state."""
        if self.caption:
            return self.caption
        t = next(iter(states.values())).t
        what, _, unit = self.described.time_label.partition(" [")
        unit = f" {unit[:-1]}" if unit and unit != "-]" else ""
        text = f"t = {t:.4g}{unit}" if self.described.dynamic else f"{what} {t:.4g}{unit}"
        return text if self.factor == 1 else f"{text}, displacements x {self.factor:g}"


def showing(
    fields: Fields,
    described: Described,
    times: Iterable[float | None] = (None,),
    field: str | None = None,
    component: str | int | None = None,
    factor: float | None = None,
    appearance: Appearance | None = None,
) -> Showing:
    """Read what is shown.

    Args:
        fields: The fields.
        described: The scene.
        times: Times; of each the nearest state; None: the last one.
        field: What the colours show, see `colouring`.
        component: Its component.
        factor: By which displacements are shown larger; None: as they are, small ones larger.
        appearance: How it looks; None: as usual.

    Raises:
        SceneError: If there are no states, or no such field.
    """
    wanted = list(dict.fromkeys(fields.nearest(t) for t in times))
    shapes = {name: shape_of(fields, name) for name in fields}
    states = [{name: read_state(fields.file(name, t), t) for name in fields} for t in wanted]
    shown = colouring(fields, described, field, component)
    found = [
        v
        for state in states
        for name in shapes
        if (v := values(shapes[name], state[name], shown)) is not None and len(v)
    ]
    low = min((float(np.nanmin(v)) for v in found), default=0.0)
    high = max((float(np.nanmax(v)) for v in found), default=0.0)
    # sizes begin at zero; a colour for nothing at all would be one of two
    limits = (min(low, 0.0) if low >= 0 else low, high if high > low else low + 1e-300)
    appearance = appearance or USUAL
    factor = appearance.enlarge if factor is None else factor
    bodies = _bodies(shapes)
    larger = enlargement(bodies, states) if factor is None else factor
    points = [shape.reference for shape in bodies.values()]
    for state in states:
        for name, shape in bodies.items():
            points.append(shape.reference + larger * (state[name].position - shape.reference))
    forces = [s[JOINTS].arrays["force"] for s in states if "force" in _joints(s)]
    largest = max((float(np.linalg.norm(f, axis=1).max()) for f in forces), default=0.0)
    view = view_of(np.concatenate(points), appearance.camera)
    # nothing at all has no scale
    looks: dict[str, Any] = {"bar": bool(low or high), "appearance": appearance}
    return Showing(described, shapes, states, shown, limits, view, larger, largest, **looks)


def _bodies(shapes: dict[str, Shape]) -> dict[str, Shape]:
    """Bodies that a view is of: obstacles reach beyond it."""
    return {n: s for n, s in shapes.items() if n != OBSTACLES or len(shapes) == 1}


def _joints(state: dict[str, State]) -> dict[str, Floats]:
    return state[JOINTS].arrays if JOINTS in state else {}


class _Part:
    """Something of a body: flat pieces, lines, rods about lines, balls about dots.

    Args:
        name: Name of the body.
        at: Gives values at its points from those at the body's nodes.
        mesh: Its points, with pieces, lines or nothing between them.
        radius: Radius of rods or balls; None: pieces and lines are drawn as they are.
        place: Gives its points from positions of the body's nodes; None: as values.
    """

    def __init__(
        self,
        name: str,
        at: Callable[[Floats], Floats],
        mesh: Any,
        radius: float | None,
        place: Callable[[Floats], Floats] | None,
    ) -> None:
        self.name, self.mesh, self._at, self._radius = name, mesh, at, radius
        self._place = place or at
        self.drawn = self._solid()

    def _solid(self) -> Any:
        if self._radius is None:
            return self.mesh
        if self.mesh.n_lines:
            return self.mesh.tube(radius=self._radius, n_sides=16, capping=True)
        import pyvista as pv

        ball = pv.Sphere(radius=self._radius, theta_resolution=16, phi_resolution=16)
        return self.mesh.glyph(geom=ball, scale=False, orient=False)

    def move(self, x: Floats, values: Floats | None) -> None:
        """Move it to positions, and colour it by values, at the nodes of the body."""
        self.mesh.points = self._place(x)
        if values is not None:
            self.mesh.point_data["shown"] = self._at(values)
        if self._radius is not None:
            self.drawn.copy_from(self._solid())
        elif self.mesh.n_faces:
            self.mesh.compute_normals(
                cell_normals=False,
                split_vertices=False,
                auto_orient_normals=False,
                consistent_normals=False,
                inplace=True,
            )


class Stage:
    """States drawn one after the other on the same stage.

    Args:
        what: What is shown.
        plotter: Where: a Plotter of pyvista's, its active place.
        marks: Whether time, scale of colours and axes are drawn.
        scale: Factor on the sizes of texts and the widths of lines.
    """

    def __init__(self, what: Showing, plotter: Any, marks: bool = True, scale: int = 1) -> None:
        import pyvista as pv
        from vtkmodules.vtkRenderingCore import vtkMapper

        # lines of elements are on their surface, and not half of them below it
        vtkMapper.SetResolveCoincidentTopologyToPolygonOffset()
        vtkMapper.SetResolveCoincidentTopologyPolygonOffsetParameters(1.0, 1.0)
        vtkMapper.SetResolveCoincidentTopologyLineOffsetParameters(0.0, 0.0)
        self._what, self._plotter, self._marks, self._scale = what, plotter, marks, scale
        self._parts: list[_Part] = []
        self._arrows: Any = None
        self._title: Any = None
        self._arrow = pv.Arrow(tip_resolution=12, shaft_resolution=12)
        theme = THEMES[what.appearance.theme]
        plotter.set_background(theme.paper)
        first = what.states[0]
        for name, shape in what.shapes.items():
            colours = values(shape, first[name], what.shown)
            fine = shape.fine
            X = fine.at(shape.reference)
            if name in PLAIN and len(fine.faces):
                style = LIT | ({"color": OBSTACLE, "opacity": 0.35} if name == OBSTACLES else {})
                surface = pv.PolyData.from_regular_faces(X, fine.faces.astype(int))
                self._add(name, fine.at, surface, None, **style)
                continue
            self._reference(pv, name, X, fine)
            if len(fine.faces):
                slab = Slab(fine, max(shape.thickness / 2, SHEET * what.view.size))
                sides = slab.place(shape.reference)
                faces = pv.PolyData.from_regular_faces(sides, slab.faces)
                self._add(name, slab.at, faces, colours, place=slab.place, **LIT)
                outlines = pv.PolyData(sides, lines=_lines(slab.outlines))
                style = {"color": "black", "opacity": 0.35, "line_width": scale}
                self._add(name, slab.at, outlines, None, place=slab.place, **style)
            if len(fine.lines):
                lines = pv.PolyData(X, lines=_lines(fine.lines))
                if name == JOINTS:
                    style = {"color": REFERENCE_LINE, "line_width": 2 * scale}
                    self._add(name, fine.at, lines, None, **style)
                else:
                    radius = max(shape.thickness / 2, THIN * what.view.size)
                    self._add(name, fine.at, lines, colours, radius, **LIT)
            if len(shape.dots):
                dots = pv.PolyData(shape.reference[shape.dots])
                radius = (PIN if name == JOINTS else KNOB) * what.view.size
                colour = "white" if name == JOINTS else RIGID
                self._add(name, shape.marked, dots, None, radius, color=colour, **LIT)
        if marks and what.bar and self._coloured is not None:
            point = scale / plotter.window_size[1]
            place = {"position_x": 0.25, "position_y": 10 * point, "width": 0.5}
            style = {"color": theme.ink, "n_labels": 4, "fmt": "%.3g", "height": 36 * point}
            style |= {"label_font_size": 13 * scale, "mapper": self._coloured}
            plotter.add_scalar_bar(" ", **place, **style).SetTitle("")
            style = {"font_size": 9 * scale, "color": theme.ink, "viewport": True}
            label = plotter.add_text(what.shown.label, position=(0.5, 52 * point), **style)
            label.prop.justification_horizontal = "center"
        look(plotter, what.view, scale)
        if marks:
            box = what.view if what.appearance.axes else None
            axes(plotter, what.extent, what.described.labels, theme, box, scale)

    _coloured: Any = None

    def _add(
        self,
        name: str,
        at: Callable[[Floats], Floats],
        mesh: Any,
        colours: Floats | None,
        radius: float | None = None,
        place: Callable[[Floats], Floats] | None = None,
        **style: Any,
    ) -> None:
        style.setdefault("smooth_shading", bool(mesh.n_faces or radius))
        if colours is not None:
            mesh.point_data["shown"] = at(colours)
        part = _Part(name, at, mesh, radius, place)
        if colours is None:
            style.setdefault("color", RIGID if name in MARKS else NO_VALUE)
            self._plotter.add_mesh(part.drawn, **style)
        else:
            style |= {"clim": self._what.limits, "cmap": self._what.colours}
            style |= {"scalars": "shown", "show_scalar_bar": False}
            self._coloured = self._plotter.add_mesh(part.drawn, **style).mapper
        self._parts.append(part)

    def _reference(self, pv: Any, name: str, X: Floats, fine: Pieces) -> None:
        """The border of the reference, thin and grey."""
        lines = fine.border if len(fine.faces) else fine.lines
        if len(lines) and name != JOINTS:
            mesh = pv.PolyData(X, lines=_lines(lines))
            self._plotter.add_mesh(mesh, color=REFERENCE_LINE, line_width=1.2 * self._scale)

    def set(self, states: dict[str, State]) -> None:
        """Move everything to a state.

        Args:
            states: States by the name of the body.
        """
        what = self._what
        for part in self._parts:
            name = part.name
            coloured = "shown" in part.mesh.point_data
            shown = values(what.shapes[name], states[name], what.shown) if coloured else None
            part.move(what.place(name, states[name]), shown)
        self._forces(states)
        # what comes nearer than the reference must not be cut off
        self._plotter.renderer.ResetCameraClippingRange()
        if not self._marks:
            return
        text = what.title(states)
        if self._title is None:
            style = {"font_size": 9 * self._scale, "color": THEMES[what.appearance.theme].ink}
            self._title = self._plotter.add_text(text, position="upper_edge", **style)
        else:
            self._title.set_text("upper_edge", text)

    def _forces(self, states: dict[str, State]) -> None:
        """Forces of joints on their second bodies as arrows."""
        what, force = self._what, _joints(states).get("force")
        if force is None or what.force == 0:
            return
        # of the two ends of a joint the second one
        at, vectors = what.place(JOINTS, states[JOINTS])[1::2], force[1::2]
        import pyvista as pv

        points = pv.PolyData(np.array(at))
        points["force"] = vectors
        scale = ARROW * what.view.size / what.force
        arrows = points.glyph(orient="force", scale="force", factor=scale, geom=self._arrow)
        if self._arrows is None:
            self._arrows = arrows
            self._plotter.add_mesh(arrows, color="#c0392b", show_scalar_bar=False)
        else:
            self._arrows.copy_from(arrows)


def _lines(rows: Ints) -> Ints:
    """Lines as VTK wants them: the number of nodes before the nodes of each."""
    counts = np.full((len(rows), 1), rows.shape[1], dtype=np.int64)
    return np.concatenate([counts, rows], axis=1).ravel()


def images(
    what: Showing,
    width: int = WIDTH,
    states: Iterable[dict[str, State]] | None = None,
    marks: bool = True,
    finer: int = FINER,
) -> Iterator[Image]:
    """An image of each state, drawn without a display.

    Args:
        what: What is shown.
        width: Width, pixels, unless the appearance has one; the height goes by what is shown.
        states: Those of its states that are drawn; None: all.
        marks: Whether time, scale of colours and axes are drawn.
        finer: How many times larger it is drawn, and then reduced: edges are smooth.

    Raises:
        RunError: If this machine cannot draw.
    """
    from PIL import Image

    width = what.appearance.width or width
    with canvas(finer * width, finer * what.view.height(width)) as plotter:
        stage = Stage(what, plotter, marks, finer)
        for state in what.states if states is None else states:
            stage.set(state)
            # a screenshot by itself may be of what was drawn before
            plotter.render()
            drawn = np.asarray(plotter.screenshot(None, return_img=True))
            yield Image.fromarray(drawn).reduce(finer)


def side_by_side(parts: Sequence[Image], columns: int) -> Image:
    """Images beside and below one another.

    Args:
        parts: They.
        columns: Number of them beside one another.
    """
    from PIL import Image

    width, height = max(p.width for p in parts), max(p.height for p in parts)
    rows = -(-len(parts) // columns)
    whole = Image.new("RGB", (width * columns, height * rows), "white")
    for k, part in enumerate(parts):
        whole.paste(part, (width * (k % columns), height * (k // columns)))
    return whole


def show(what: Showing) -> None:
    """The first state in a window that can be turned.

    Args:
        what: What is shown.

    Raises:
        RunError: If there is no display.
    """
    if not has_display():
        raise RunError(
            "view: there is no display; use `shellmb report RUN`, whose page can be turned in a "
            "browser, or open fields/all.pvd in ParaView"
        )
    import pyvista as pv

    plotter = pv.Plotter(title=what.described.name)
    Stage(what, plotter).set(what.states[0])
    plotter.show()
