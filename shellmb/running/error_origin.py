"""Whose mistake an exception is: that of a user's file, or ours."""

import sysconfig
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import shellmb
from shellmb.errors import ShellmbError

# the package, and what a checkout keeps beside it
_OURS = Path(shellmb.__file__).parent
_FORMS = _OURS.parent / "forms"
_LIBRARIES = {Path(sysconfig.get_path(kind)) for kind in ("stdlib", "purelib", "platlib")}


def user_frame(error: BaseException) -> traceback.FrameSummary | None:
    """The last place in a user's file that an exception passed.

    Args:
        error: The exception.
    """
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        if not is_library(frame.filename):
            return frame
    return None


def is_library(filename: str) -> bool:
    """Decide whether a file is of this package or of one that it uses; demos are as a user's.

    Args:
        filename: Name of a file of code.
    """
    path = Path(filename)
    if path.is_relative_to(_OURS / "demos"):
        return False
    inside = any(path.is_relative_to(folder) for folder in (_OURS, _FORMS, *_LIBRARIES))
    return inside or not filename.endswith(".py")


def in_words(error: BaseException) -> str:
    """Text of an exception, with its place in the user's file.

    Args:
        error: The exception.
    """
    said = str(error).partition("\n")[0]
    kind = type(error).__name__
    text = f"{kind}: {said}" if said else kind
    frame = user_frame(error)
    return text if frame is None else f"{Path(frame.filename).name}, line {frame.lineno}: {text}"


@contextmanager
def user_failures(kind: type[ShellmbError], says: str, then: str = "") -> Iterator[None]:
    """Context of a function of the user's: what it raises becomes an error of ours, ours stay.

    Args:
        kind: Kind of the error.
        says: Beginning of its sentence, before the exception in words.
        then: End of its sentence.
    """
    try:
        yield
    except ShellmbError:
        raise
    except (Exception, SystemExit) as error:
        raise kind(f"{says}: {in_words(error)}{then}") from error
