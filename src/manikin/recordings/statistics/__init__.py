"""What is measured of many recordings ([Qiu2012]_ chapter 3)."""
