"""The loops in C compiled as setuptools installs the package (`ext-modules`, `cmdclass`)."""

import importlib
import sys
from pathlib import Path

from setuptools import Extension
from setuptools.command.build_ext import build_ext
from setuptools.errors import CompileError


class BuildLoops(build_ext):  # type: ignore[misc]
    """Compiles for this processor and Python; what is not made here is made by the first run."""

    def build_extension(self, ext: Extension) -> None:
        """Compile the library.

        Raises:
            CompileError: If that fails: then a warning is told, and the installation goes on.
        """
        target = Path(self.get_ext_fullpath(ext.name))
        target.parent.mkdir(parents=True, exist_ok=True)
        # setuptools loads this file by its path
        sys.path.insert(0, str(Path(__file__).parents[3]))
        try:
            making = importlib.import_module("shellmb.native.compiling.source")
            made = making.write_c(target.parent, making.named_source())
            making.compile_c(made, target)
        except Exception as error:
            raise CompileError(str(error)) from error
