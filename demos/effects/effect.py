"""Effects: whether a scene has one and why, and the scene without or with it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

from shellmb.errors import SceneError
from shellmb.scene import Scene

# a changed scene; the second argument is the name of a part of it, or None for all
Change = Callable[[Scene, str | None], Scene]


class Use(NamedTuple):
    """Use of an effect by a scene.

    Args:
        used: Whether.
        why: The field of the scene that decides.
    """

    used: bool
    why: str


@dataclass(frozen=True)
class Effect:
    """Something that a scene may simulate, or leave out.

    Args:
        name: What the command line calls it.
        group: Group in the table.
        title: What it is, in words.
        use: Whether a scene has it.
        leave_out: The scene without it; raises `SceneError` where that is impossible.
        take_in: The scene with it; likewise.
        bodies: What the names of the bodies of the system begin with of which it consists: joints
            and force elements are bodies of their own.
        observer: Name of the observer that it is, among `run.standard.StandardObservers`.
        motion: Whether a scene without it has another kind of time: no steps to compare.
    """

    name: str
    group: str
    title: str
    use: Callable[[Scene], Use]
    leave_out: Change
    take_in: Change
    bodies: tuple[str, ...] = ()
    observer: str | None = None
    motion: bool = False

    def without(self, scene: Scene, part: str | None = None) -> Scene:
        """The scene without it.

        Args:
            scene: The scene.
            part: Name of a body, joint or element: only of that.

        Raises:
            SceneError: If the scene has none, or needs it.
        """
        use = self.use(scene)
        if not use.used:
            raise SceneError(f"--without {self._said(part)}: it is not there: {use.why}")
        changed = self._changed("--without", self.leave_out, scene, part)
        left = self.use(changed)
        if left.used and part is None:
            raise SceneError(f"--without {self.name}: the scene needs it: {left.why}")
        return changed

    def with_(self, scene: Scene, part: str | None = None) -> Scene:
        """The scene with it.

        Args:
            scene: The scene.
            part: Name of a body: only of that.

        Raises:
            SceneError: If the scene has it already, or cannot have it.
        """
        use = self.use(scene)
        if use.used and part is None:
            raise SceneError(f"--with {self._said(part)}: it is there already: {use.why}")
        changed = self._changed("--with", self.take_in, scene, part)
        now = self.use(changed)
        if not now.used:
            raise SceneError(f"--with {self._said(part)}: the scene cannot have it: {now.why}")
        return changed

    def _said(self, part: str | None) -> str:
        return self.name if part is None else f"{self.name}:{part}"

    def _changed(self, option: str, change: Change, scene: Scene, part: str | None) -> Scene:
        try:
            return change(scene, part)
        except SceneError as error:
            raise SceneError(f"{option} {self._said(part)}: {error}") from None


def refuse(why: str) -> Change:
    """A change that is impossible.

    Args:
        why: Reason, and what would be right.
    """

    def change(scene: Scene, part: str | None) -> Scene:
        raise SceneError(why)

    return change


def whole(change: Callable[[Scene], Scene]) -> Change:
    """A change of the scene as a whole: there are no parts to choose from."""

    def made(scene: Scene, part: str | None) -> Scene:
        if part is not None:
            raise SceneError(f"'{part}' is no choice here: the effect is one of the whole scene")
        return change(scene)

    return made


def fixed(used: bool, why: str) -> Callable[[Scene], Use]:
    """Say whether all scenes have the effect, and why."""
    return lambda scene: Use(used, why)


def names(items: Iterable[Any]) -> str:
    """Names for a reason, the first ones of many."""
    listed = [f"'{item.name}'" for item in items]
    more = f" and {len(listed) - 3} more" if len(listed) > 3 else ""
    return ", ".join(listed[:3]) + more
