"""Which contacts carried a recorded person, and when."""
