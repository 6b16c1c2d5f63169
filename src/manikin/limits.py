"""Sizes and ages of people that are accepted: numbers alone, so that a command refuses others at once."""

STATURE_RANGE = (0.90, 2.10)
"""Stature [m]."""
MASS_RANGE = (12.0, 160.0)
"""Body mass [kg]."""
BODY_MASS_INDEX_RANGE = (10.0, 60.0)
"""Mass / stature^2 [kg/m^2]."""
AGE_RANGE = (18.0, 90.0)
"""Age for which strength was published [years]."""
