# what `shellmb.__getattr__` finds when it is used, for editors and type checkers
from shellmb import errors as errors
from shellmb import forms as forms
from shellmb import scene as scene
from shellmb.api.modal import modes as modes
from shellmb.api.modeshapes import ModeShapes as ModeShapes
from shellmb.api.record import Run as Run
from shellmb.api.rotating import RotatingModes as RotatingModes
from shellmb.api.rotating import StateModes as StateModes
from shellmb.api.runs import load as load
from shellmb.api.runs import load_scene as load_scene
from shellmb.api.runs import resume as resume
from shellmb.api.runs import run as run
from shellmb.api.runs import scenes as scenes
from shellmb.api.studies import Study as Study
from shellmb.api.studies import study as study
from shellmb.api.sweeps import sweep as sweep
from shellmb.errors import ControlError as ControlError
from shellmb.errors import ConvergenceError as ConvergenceError
from shellmb.errors import RunError as RunError
from shellmb.errors import SceneError as SceneError
from shellmb.errors import ShellmbError as ShellmbError
from shellmb.errors import ShellmbWarning as ShellmbWarning
from shellmb.scene import *

__version__: str
