"""Readers of BVH, ASF with AMC, C3D, TRC and MOT files."""
