"""LAPACK's Cholesky factors of matrices with few bands, as scipy has them.

They are those of ``scipy.linalg.lapack``. To import all of that package takes a sixth of the
processor time in which ``ik_node`` starts; so the one library that is needed is loaded by itself.
"""

from __future__ import annotations

import sys
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from types import ModuleType


def _lapack() -> ModuleType:
    """Return scipy's wrapper of LAPACK."""
    name = "scipy.linalg._flapack"
    if name not in sys.modules and (package := find_spec("scipy")) is not None:
        folders = [f"{folder}/linalg" for folder in package.submodule_search_locations or ()]
        spec = PathFinder.find_spec(name, folders)
        if spec is not None and spec.loader is not None:
            # scipy itself sees to it that libraries that came with it are found.
            import scipy  # noqa: F401

            module = module_from_spec(spec)
            spec.loader.exec_module(module)
            # So that scipy.linalg does not load it once more.
            sys.modules[name] = module
    if name in sys.modules:
        return sys.modules[name]
    # A scipy that keeps it elsewhere.
    from scipy.linalg import lapack

    return lapack


dpbtrf = _lapack().dpbtrf
dpbtrs = _lapack().dpbtrs
