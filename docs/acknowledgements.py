"""What pages about recorded people say at their end."""

THANKS = """
## Acknowledgements

The data used in this project was obtained from mocap.cs.cmu.edu. The database was created with funding from
NSF EIA-0196217. Motion capture data: ACCAD / The Ohio State University, Open Motion Project, CC BY 3.0
Unported.
"""
"""Of recordings of the CMU Graphics Lab and of the ACCAD Open Motion Project."""
