"""Compiled forms and elements that a process has loaded already.

FFCx looks for each in its folder by listing the whole of it, and lays all its options
out for its log, which takes longer than most tests: tests make the same few hundred
thousands of times.
"""

from __future__ import annotations

from functools import wraps
from types import SimpleNamespace

import ffcx
from ffcx.codegeneration import jit


def keep_loaded_forms():
    """Load each compiled form or element once."""
    load, loaded = jit.get_cached_module, {}

    @wraps(load)
    def get_cached_module(module_name, object_names, *where):
        key = module_name, *object_names, *map(str, where)
        if key in loaded:
            return loaded[key]
        objects, module = load(module_name, object_names, *where)
        if objects is not None:
            loaded[key] = objects, module
        return objects, module

    jit.get_cached_module = get_cached_module
    # Its name before FFCx 0.6
    options = getattr(ffcx, "options", None) or ffcx.parameters
    options.pprint = SimpleNamespace(pformat=repr)
