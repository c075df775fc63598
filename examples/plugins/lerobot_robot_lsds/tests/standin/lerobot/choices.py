"""Configuration classes that are found by name, as those of draccus, on which LeRobot's are built."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, TypeVar

C = TypeVar("C", bound=type)


class ChoiceRegistry:
    """A base class whose direct subclasses each keep their own names."""

    _names: ClassVar[dict[str, type]]

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        if ChoiceRegistry in cls.__bases__:
            cls._names = {}

    @classmethod
    def register_subclass(cls, name: str) -> Callable[[C], C]:
        """Return a decorator that registers a class under a name."""

        def register(subclass: C) -> C:
            cls._names[name] = subclass
            return subclass

        return register

    @classmethod
    def get_choice_class(cls, name: str) -> type:
        """Return the class of a name."""
        return cls._names[name]

    @classmethod
    def get_choice_name(cls, subclass: type) -> str:
        """Return the name of a class."""
        return next(name for name, known in cls._names.items() if known is subclass)
