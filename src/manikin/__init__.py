"""Plan, prove and measure how a body moves through a cluttered scene."""

__version__ = "0.1.0"
