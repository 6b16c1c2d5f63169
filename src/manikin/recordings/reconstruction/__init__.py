"""A recorded skeleton or recorded markers as a motion of our human."""
