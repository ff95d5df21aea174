"""The version, for those below the top level that write it into files."""

__version__ = "0.2.0"
