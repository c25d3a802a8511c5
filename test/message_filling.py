"""Messages and services from the texts that ``ros2 topic pub`` and ``ros2 service call`` take."""

from importlib import import_module
from typing import Any

import yaml


def interface(name: str) -> Any:
    """Return the class of a type, std_srvs/srv/Trigger for example."""
    package, folder, kind = name.split("/")
    return getattr(import_module(f"{package}.{folder}"), kind)


def filled(message: Any, text: str) -> Any:
    """Return ``message`` with the fields that a YAML text names."""
    _fill(message, yaml.safe_load(text))
    return message


def _fill(message: Any, values: dict[str, Any]) -> None:
    for name, value in values.items():
        if isinstance(value, dict):
            _fill(getattr(message, name), value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            for item, content in zip(getattr(message, name), value):
                _fill(item, content)
        else:
            assert name in message.get_fields_and_field_types(), name
            setattr(message, name, value)
