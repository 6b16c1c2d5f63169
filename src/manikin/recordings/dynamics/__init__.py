"""Wrenches, forces, torques and margins of recorded motions."""
