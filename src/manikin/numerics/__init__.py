"""Mathematics that knows no body: rotations, polytopes, splines, quadratic programs, filters."""
