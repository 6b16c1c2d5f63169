"""Planning: a guide for the root, contacts, the centre of mass, the whole body, pushing and pulling."""
