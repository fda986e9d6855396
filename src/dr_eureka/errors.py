"""The one base of every error this package raises on purpose."""


class DrEurekaError(Exception):
    """Base class: its text is one line that says what is wrong, where, and what was expected."""
