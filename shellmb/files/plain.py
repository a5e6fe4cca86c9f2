"""Values that JSON knows, from dataclasses and arrays."""

import math
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def plain(value: Any, **renamed: str) -> Any:
    """Values that JSON knows: no dataclasses, and null for what is not finite.

    Args:
        value: Numbers, texts, containers of them, dataclasses; one with a `to_dict` says itself
            what is kept of it.
        renamed: Names of fields that are called otherwise in JSON, where Python has a word for it.
    """
    if hasattr(value, "to_dict"):
        value = value.to_dict()
    if is_dataclass(value):
        value = {f.name: getattr(value, f.name) for f in fields(value)}
    if isinstance(value, dict):
        return {renamed.get(key, key): plain(item, **renamed) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item, **renamed) for item in value]
    if isinstance(value, np.generic | np.ndarray):
        return plain(value.tolist(), **renamed)
    return None if isinstance(value, float) and not math.isfinite(value) else value
