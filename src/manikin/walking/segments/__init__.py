"""Where walks are holonomic and where not ([Truong2010]_ chapter 4)."""
