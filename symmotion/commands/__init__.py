"""The command line."""

from symmotion.commands.main import main

__all__ = ["main"]
