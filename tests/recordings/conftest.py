"""Small skeletons written by hand, and the real recordings beside the repository."""

import pytest

BVH = """HIERARCHY
ROOT hips
{
  OFFSET 5.0 5.0 5.0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT spine
  {
    OFFSET 0.0 100.0 0.0
    CHANNELS 3 Zrotation Yrotation Xrotation
    End Site
    {
      OFFSET 0.0 80.0 0.0
    }
  }
  JOINT leg
  {
    OFFSET 10.0 0.0 0.0
    CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0.0 -90.0 0.0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.02
1 100 2  0 0 0  0 0 0  0
1 100 2  0 0 90  90 0 90  -90
"""

ASF = """# by hand
:version 1.10
:name person
:units
  mass 1.0
  length 0.45
  angle deg
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name hip
     direction 1 0 0
     length 2
     axis 0 0 0 XYZ
  end
  begin
     id 2
     name thigh
     direction 0 -1 0
     length 4
     axis 0 0 90 XYZ
     dof rx rz
     limits (-160.0 20.0)
            (-60.0 70.0)
  end
:hierarchy
  begin
    root hip
    hip thigh
  end
"""

AMC = """#!OML:ASF person
:FULLY-SPECIFIED
:DEGREES
7
root 1 2 3 0 0 0
thigh 0 0
8
root 1 2 3 0 90 0
thigh 90 0
9
root 1 2 3 90 90 0
thigh 90 90
"""


@pytest.fixture
def bvh_file(tmp_path):
    file = tmp_path / "small.bvh"
    file.write_text(BVH)
    return file


@pytest.fixture
def amc_file(tmp_path):
    (tmp_path / "person.asf").write_text(ASF)
    file = tmp_path / "person_1.amc"
    file.write_text(AMC)
    return file
