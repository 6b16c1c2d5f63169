"""Walking paths by optimal control ([Truong2010]_ chapter 3)."""
