"""The common style of pictures."""

from __future__ import annotations

from typing import Any

# How limits are drawn.
LIMIT_STYLE: dict[str, Any] = {"color": "0.35", "linestyle": "--", "linewidth": 0.9}

# In a metre.
MILLIMETRES = 1000.0
