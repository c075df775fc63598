"""Groups of callbacks."""


class ReentrantCallbackGroup:
    """Callbacks that may run at once."""
