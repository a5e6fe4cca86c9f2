"""The plane slider-crank of rigid bodies with a prescribed crank: kinematics, torque and forces.

All is a function of the crank angle and its two derivatives, so that nothing is integrated.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shellmb.arrays import Floats

Vector = Sequence[float] | Floats


@dataclass(frozen=True)
class SliderCrank:
    """A crank about the origin, a coupler and a slider on the line `y = offset`.

    The crank pin is at `crank (cos phi, sin phi)`, the slider on the side of positive x.

    Args:
        crank: Length of the crank, m.
        coupler: Length of the coupler, m.
        coupler_mass: Mass of the coupler, kg.
        coupler_center: Distance of its centre of mass from the crank pin, m.
        coupler_inertia: Its moment of inertia about that centre, kg m^2.
        slider_mass: Mass of the slider, kg.
        crank_mass: Mass of the crank, kg.
        crank_center: Distance of its centre of mass from the origin, m.
        crank_inertia: Its moment of inertia about the origin, kg m^2.
        offset: Distance of the slider's line from the origin, m.
        gravity: Acceleration of gravity along -y, m/s^2.

    Raises:
        ValueError: If the coupler is too short for a full turn.
    """

    crank: float
    coupler: float
    coupler_mass: float = 0.0
    coupler_center: float = 0.0
    coupler_inertia: float = 0.0
    slider_mass: float = 0.0
    crank_mass: float = 0.0
    crank_center: float = 0.0
    crank_inertia: float = 0.0
    offset: float = 0.0
    gravity: float = 0.0

    def __post_init__(self) -> None:
        if self.coupler <= self.crank + abs(self.offset):
            raise ValueError(
                f"a coupler of {self.coupler} m is too short for a crank of {self.crank} m "
                f"and an offset of {self.offset} m"
            )

    def motion(self, angle: Vector, rate: Vector, acceleration: Vector) -> "SliderCrankMotion":
        """Kinematics, driving torque and joint forces of a prescribed crank, all exact.

        Args:
            angle: Crank angle phi, rad, shape (n,).
            rate: Its rate, rad/s, shape (n,).
            acceleration: Its second derivative, rad/s^2, shape (n,).
        """
        phi, w, dw = (np.asarray(v, dtype=np.float64) for v in (angle, rate, acceleration))
        r, l = self.crank, self.coupler  # noqa: E741 - the usual letters
        up, down = _direction(phi), _normal(phi)
        pin = r * up
        pin_a = r * (dw[:, None] * down - (w**2)[:, None] * up)
        beta = np.arcsin((self.offset - pin[:, 1]) / l)
        cos, sin = np.cos(beta), np.sin(beta)
        # derivatives of l sin(beta) = offset - r sin(phi), by phi and by time
        beta_phi = -r * np.cos(phi) / (l * cos)
        beta_w = beta_phi * w
        beta_dw = (-pin_a[:, 1] / l + sin * beta_w**2) / cos
        along, across = _direction(beta), _normal(beta)

        def carried(lever: float) -> tuple[Floats, Floats, Floats, Floats]:
            """Position, its derivative by phi, velocity and acceleration on the coupler."""
            by_phi = r * down + lever * beta_phi[:, None] * across
            a = pin_a + lever * (beta_dw[:, None] * across - (beta_w**2)[:, None] * along)
            return pin + lever * along, by_phi, by_phi * w[:, None], a

        end, end_phi, end_v, end_a = carried(l)
        center, center_phi, center_v, center_a = carried(self.coupler_center)
        weight = np.array([0.0, self.gravity])
        m, M, mc = self.coupler_mass, self.slider_mass, self.crank_mass
        torque = self.crank_inertia * dw + mc * self.crank_center * self.gravity * np.cos(phi)
        torque = torque + m * ((center_a + weight) * center_phi).sum(axis=1)
        torque += self.coupler_inertia * beta_dw * beta_phi + M * end_a[:, 0] * end_phi[:, 0]

        # force of the coupler on the slider: x by Newton, y by the moments about the crank pin
        load = m * (center_a + weight)
        moment = self.coupler_inertia * beta_dw + self.coupler_center * _cross(along, load)
        on_slider = np.zeros_like(pin)
        on_slider[:, 0] = M * end_a[:, 0]
        on_slider[:, 1] = (-moment / l + sin * on_slider[:, 0]) / cos
        on_coupler = load + on_slider
        crank_a = self.crank_center / r * pin_a
        energy = 0.5 * (
            self.crank_inertia * w**2
            + m * (center_v**2).sum(axis=1)
            + self.coupler_inertia * beta_w**2
            + M * end_v[:, 0] ** 2
        )
        return SliderCrankMotion(
            slider=end[:, 0],
            slider_velocity=end_v[:, 0],
            slider_acceleration=end_a[:, 0],
            pin=pin,
            coupler_angle=beta,
            coupler_rate=beta_w,
            coupler_acceleration=beta_dw,
            coupler_center=center,
            torque=torque,
            kinetic_energy=energy,
            potential_energy=self.gravity
            * (m * center[:, 1] + mc * self.crank_center * np.sin(phi)),
            bearing_force=on_coupler + mc * (crank_a + weight),
            pin_force=on_coupler,
            slider_force=on_slider,
            guide_force=M * self.gravity - on_slider[:, 1],
        )


@dataclass(frozen=True)
class SliderCrankMotion:
    """Motion of a slider-crank at `n` instants.

    Args:
        slider: Position x of the slider, m, shape (n,).
        slider_velocity: Its velocity, m/s, shape (n,).
        slider_acceleration: Its acceleration, m/s^2, shape (n,).
        pin: Position of the crank pin, m, shape (n, 2).
        coupler_angle: Angle of the coupler (pin to slider) with x, rad, shape (n,).
        coupler_rate: Its rate, rad/s, shape (n,).
        coupler_acceleration: Its second derivative, rad/s^2, shape (n,).
        coupler_center: Position of the coupler's centre of mass, m, shape (n, 2).
        torque: Torque about z that drives the crank, N m, shape (n,).
        kinetic_energy: Kinetic energy of all, J, shape (n,).
        potential_energy: Energy of gravity without that of the slider, constant, J, shape (n,).
        bearing_force: Force of the ground on the crank, N, shape (n, 2).
        pin_force: Force of the crank on the coupler, N, shape (n, 2).
        slider_force: Force of the coupler on the slider, N, shape (n, 2).
        guide_force: Force of the guide on the slider along y, N, shape (n,).
    """

    slider: Floats
    slider_velocity: Floats
    slider_acceleration: Floats
    pin: Floats
    coupler_angle: Floats
    coupler_rate: Floats
    coupler_acceleration: Floats
    coupler_center: Floats
    torque: Floats
    kinetic_energy: Floats
    potential_energy: Floats
    bearing_force: Floats
    pin_force: Floats
    slider_force: Floats
    guide_force: Floats


def _direction(angle: Floats) -> Floats:
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _normal(angle: Floats) -> Floats:
    return np.stack([-np.sin(angle), np.cos(angle)], axis=1)


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
