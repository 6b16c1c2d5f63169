"""Whole-body walking cycles: the motion library, and walks blended of it ([Truong2010]_ 6)."""
