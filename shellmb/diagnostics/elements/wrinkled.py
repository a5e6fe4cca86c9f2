"""Wrinkling sections: what the stiffness that they keep in compression stores, and their modes."""

from collections.abc import Callable, Sequence

import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.diagnostics.base import STIFFENED, Cautions, Motion, Parts, Watch, said_of
from shellmb.forms.materials import compressive, tensile
from shellmb.forms.shell import named
from shellmb.forms.steps.mixed import assumed
from shellmb.model.model import Model
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields.nodal import state
from shellmb.scene import Wrinkling
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.functionals import functionals

# of the strain energy: displacements may be off by 1 % then
BOUND = 2e-3


class _Sums:
    """Sums over a shell with a wrinkling section in a state.

    Args:
        body: The shell.
        section: Its section.
        of: Densities, of the membrane strains, the parameters, and the energy of the whole.
    """

    def __init__(self, body: ShellModel, section: Wrinkling, of: Callable[..., list[Expr]]) -> None:
        domain = body.mixed.space.mesh
        self._q = fem.Function(body.mixed.space)
        given = {k: fem.Constant(domain, v) for k, v in section.parameters.items()}
        eps = named(assumed(body.strain, body.layout).value(self._q)).eps
        stored = body.section.formulation.energy(body.strain, body.layout, self._q)
        forms = [[body.integrate([density])] for density in of(eps, given, sum(stored))]
        self._found = functionals(forms, domain.comm)

    def __call__(self, q: Floats) -> tuple[float, ...]:
        """The sums; collective.

        Args:
            q: Local array of a state.
        """
        self._q.x.array[:] = q
        return tuple(map(float, self._found()))


def _wrinkling(model: Model) -> dict[str, Wrinkling]:
    sections = {name: body.shell.section for name, body in model.shells.items()}
    return {name: found for name, found in sections.items() if isinstance(found, Wrinkling)}


class Wrinkled(Watch):
    """Watches how much of the energy at the end is of the compression that a section keeps.

    That is of the strain energy in statics, of what was exchanged in motion.

    To first order given forces do less work by that part; a single displacement may be off by more:
    the curvature of a stretched strip with a wrinkled band of 0.7 of its width by 6 times as much.
    """

    name = "compression"

    def start(self, simulation: Simulation) -> None:
        """Find the shells that wrinkle."""
        model = simulation.model
        found = {n: s for n, s in _wrinkling(model).items() if s.compression < 1}
        self._sections, self.idle = found, not found
        # linear schemes give another sentence
        self._of = {
            # the strain energy that is kept of compression, and all of it
            name: _Sums(model.shells[name], section, lambda e, k, of: [compressive(e, k), of])
            for name, section in ({} if simulation.scheme.linear else found).items()
        }

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each shell that compression holds; collective."""
        for name, section in self._sections.items():
            if simulation.scheme.linear:
                says = (
                    f"{said_of(simulation, name)} does not wrinkle under the scheme "
                    f"'{simulation.scene.scheme_name}', which gives compression the stiffness of "
                    "the taut membrane: use --scheme static or a nonlinear scheme"
                )
                yield self.caution(name, None, None, says)
                continue
            kept, stored = self._of[name](state(simulation, name))
            # statics do not book what loads do
            whole = max(stored, self.sources.energy.exchanged if simulation.scheme.dynamic else 0.0)
            share = kept / whole if whole > 0 else 0.0
            if share > BOUND:
                said = said_of(simulation, name)
                says = (
                    f"{100 * share:.2g} % of the energy of {said} is at the end of the compression "
                    f"that its section keeps, compression={section.compression:g}: displacements "
                    "may be off by about that much, where a band is slack by several times as "
                    "much; compare with a smaller compression"
                )
                yield self.caution(name, share, BOUND, says)


def wrinkled_modes(model: Model, state: Parts | None, modes: Sequence[Motion]) -> list[str]:
    """Sentences on modes of shells that wrinkle; as `stiffened_modes`."""
    found = []
    for name, section in _wrinkling(model).items():
        if section.compression == 1:
            continue
        said = f"shell '{name}' has a wrinkling section"
        if state is None:
            found.append(
                f"{said}, which counts as taut at rest: these modes have its whole stiffness, of "
                f"which compression has {100 * section.compression:.2g} %, and it buckles in none "
                "of them; find modes about a state in tension"
            )
            continue
        whole, taut, pulled = _Sums(model.shells[name], section, _areas)(state(name))
        slack = 1 - pulled / whole
        if slack > STIFFENED:
            found.append(
                f"{said}, and {100 * slack:.2g} % of its area is slack in this state, "
                f"{100 * (pulled - taut) / whole:.2g} % wrinkled: slack parts resist by "
                f"compression={section.compression:g} and by bending alone, and so are their modes"
            )
    return found


def _areas(e: Expr, given: dict[str, Expr], stored: Expr) -> list[Expr]:
    """One, where the membrane is taut, and where it is not slack."""
    _, taut, pulled = tensile(e, given)
    one = given["E"] / given["E"]
    return [one, *(ufl.conditional(where, one, 0 * one) for where in (taut, ufl.Or(taut, pulled)))]
