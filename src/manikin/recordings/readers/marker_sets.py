"""Roles and segments of markers by their names.

Known are the names of Plug-in Gait and Helen Hayes sets, of OpenSim's gait models, and of sets that spell
the place out (``R_Knee_Lat``, ``L.ASIS``, ``r_shoulder``). Case, separators and a subject's prefix
(``Anna:LASI``) do not matter. Points that Plug-in Gait computes (``LFEP``, ``PELO``) and names that say
nothing are left out. Also the joints at which the segments of a recorded skeleton begin.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from manikin.errors import InputError
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.readers.skeleton_recording import Recording

_SIDED: tuple[tuple[str, str, str], ...] = (
    (r"asis?", "asis", "pelvis"),
    (r"psis?", "psis", "pelvis"),
    (r"(iliac)?crest|ilc", "", "pelvis"),
    (r"hjc|hip(joint)?cent(er|re)", "hip", "pelvis"),
    (r"kne|knee|knee(lat|lateral)|lfc|lek", "knee_lateral", "thigh"),
    (r"kne2|knein|knem|knee(med|medial)|mfc|mek|mkne", "knee_medial", "thigh"),
    (r"thi|th\d+|thigh\w*|f\d\d|gtr|troch\w*", "", "thigh"),
    (r"ank|ankle|ankle(lat|lateral)|lmal", "ankle_lateral", "leg"),
    (r"ank2|ankin|ankm|ankle(med|medial)|mmal|mank", "ankle_medial", "leg"),
    (r"tib|tb\d+|tibia\w*|sha|sh\d+|shank\w*|t\d\d", "", "leg"),
    (r"hee|heel|cal|calc", "heel", "foot"),
    (r"toe|toetip|mt2|2meta", "toe", "foot"),
    (r"mt[135]|[15]meta|toe(lat|med)|foo|foo2|[sfv]mh|midfoot\w*", "", "foot"),
    (r"sho|shoulder|acr|acromi[ou]n|acromium", "shoulder", "thorax"),
    (r"bak|off|offset|sternum|cla|clav|clavicle|scap\w*", "", "thorax"),
    (r"elb|elbow|elb(lat|lateral)|elbow(lat|lateral)", "elbow_lateral", "upper_arm"),
    (r"elb2|elbin|elbm|elb(med|medial)|elbow(med|medial)", "elbow_medial", "upper_arm"),
    (r"upa|humerus|bicep\w*|triceps?|upperarm\w*", "", "upper_arm"),
    (r"wra|wri|wrist|wrist(radius|lat|thumb)|rad", "wrist_radius", "forearm"),
    (r"wrb|wri2|wrist(ulna|med|pinky)|uln", "wrist_ulna", "forearm"),
    (r"fra|frm|forearm\w*", "", "forearm"),
    (r"fin|finger|hand\w*|[mh]cp?\d?", "", "hand"),
    (r"[fb]hd|head|(front|back)head|head(front|back)|ear", "", "head"),
)
"""Stem behind the side, role (empty for a marker of which only the segment is known), segment."""

_CENTRAL: tuple[tuple[str, str, str], ...] = (
    (r"v?sacr?|sacrum|vsacral|sacral", "sacrum", "pelvis"),
    (r"c7|cv7", "c7", "thorax"),
    (r"clav?|ij|sternalnotch|jug|suprasternale", "notch", "thorax"),
    (r"strn|px|sternum|xiphoid|xyph\w*", "xiphoid", "thorax"),
    (r"t\d+|tv\d+", "", "thorax"),
    (r"tophead|headtop|ari|glab\w*|vertex", "", "head"),
)

_MIDLINE = frozenset({"pelvis", "thorax", "head"})
_SIDES = (("left", "left"), ("right", "right"), ("l", "left"), ("r", "right"))
_COMPUTED = "oalp"
"""Ends of the names of origin and axes that Plug-in Gait computes: ``LFEO``, ``LFEA``, ``LFEL``, ``LFEP``."""


@dataclass(frozen=True, eq=False)
class MarkerSet:
    """Markers that are recognised.

    Attributes:
        roles: Marker by what it marks, such as ``"left_knee_lateral"``.
        segments: Segment of our human by marker, of all that are recognised.
        others: Markers that are left out.
    """

    roles: Mapping[str, str]
    segments: Mapping[str, str]
    others: tuple[str, ...]


def marker_set(recording: MarkerRecording) -> MarkerSet:
    """Recognise the markers of a recording that are seen at all."""
    # Small letters and digits behind the prefix.
    plain = {n: re.sub(r"[^a-z0-9]", "", n.rpartition(":")[2].lower()) for n in recording.marker_names}
    computed = _computed(set(plain.values()))
    roles: dict[str, str] = {}
    segments: dict[str, str] = {}
    for number, (name, letters) in enumerate(plain.items()):
        if (
            letters not in computed
            and recording.seen[:, number].any()
            and (found := next(_places(name, letters), None))
        ):
            role, segments[name] = found
            if role:
                roles.setdefault(role, name)
    others = tuple(name for name in plain if name not in segments)
    return MarkerSet(MappingProxyType(roles), MappingProxyType(segments), others)


def _places(name: str, plain: str) -> Iterator[tuple[str, str]]:
    """Role and segment."""
    for pattern, role, segment in _CENTRAL:
        if re.fullmatch(pattern, plain):
            yield role, segment
    for side, stem in _sides(name, plain):
        for pattern, role, segment in _SIDED:
            if re.fullmatch(pattern, stem):
                yield role and f"{side}_{role}", segment if segment in _MIDLINE else f"{side}_{segment}"


def _sides(name: str, plain: str) -> Iterator[tuple[str, str]]:
    """Side and what the name says besides; a single letter at the end has to stand apart."""
    for word, side in _SIDES:
        if plain.startswith(word):
            yield side, plain[len(word) :]
        if plain.endswith(word) and (len(word) > 1 or re.search(rf"[ ._-]{word}$", name.lower())):
            yield side, plain[: -len(word)]


def _computed(names: set[str]) -> set[str]:
    """Points that describe axes: all four of a stem are there."""
    axes = {name for name in names if len(name) > 2 and name[-1] in _COMPUTED}
    return {name for name in axes if names.issuperset(name[:-1] + end for end in _COMPUTED)}


SIDES = ("left", "right")

JOINTS: Mapping[str, tuple[str, ...]] = {
    # Names on skeletons of CMU (ASF, then the BVH made of them) and of ACCAD.
    "pelvis": ("pelvis", "root", "Hips"),
    "thorax": ("thorax", "Chest2", "Spine1"),
    "left_thigh": ("left_thigh", "lfemur", "LeftHip", "LeftUpLeg"),
    "left_leg": ("left_leg", "ltibia", "LeftKnee", "LeftLeg"),
    "left_foot": ("left_foot", "lfoot", "LeftAnkle", "LeftFoot"),
    "right_thigh": ("right_thigh", "rfemur", "RightHip", "RightUpLeg"),
    "right_leg": ("right_leg", "rtibia", "RightKnee", "RightLeg"),
    "right_foot": ("right_foot", "rfoot", "RightAnkle", "RightFoot"),
    "left_upper_arm": ("left_upper_arm", "lhumerus", "LeftArm", "LeftShoulder"),
    "left_forearm": ("left_forearm", "lradius", "LeftForeArm", "LeftElbow"),
    "left_hand": ("left_hand", "lwrist", "LeftHand", "LeftWrist"),
    "right_upper_arm": ("right_upper_arm", "rhumerus", "RightArm", "RightShoulder"),
    "right_forearm": ("right_forearm", "rradius", "RightForeArm", "RightElbow"),
    "right_hand": ("right_hand", "rwrist", "RightHand", "RightWrist"),
}
"""Joints at which our segments begin, by the names that occur, our own among them; the first one is taken."""

WRISTS = {"left_hand": ("lhand",), "right_hand": ("rhand",)}
"""Joints that are the wrist before those of JOINTS: CMU's ASF ends the forearm twice, second at the wrist."""


def joint_of(recording: Recording, segment: str, before: Mapping[str, tuple[str, ...]] = WRISTS) -> int:
    """Index of the recorded joint at which one of our segments, of :data:`JOINTS`, begins.

    Names ``before`` are looked for before those of :data:`JOINTS`; InputError if the skeleton has none.
    """
    if segment not in JOINTS:
        raise InputError(f"no segment {segment!r}; valid: {', '.join(JOINTS)}")
    names = (*before.get(segment, ()), *JOINTS[segment])
    for name in names:
        if name in recording.joint_names:
            return recording.joint_names.index(name)
    wrong = f"recording {recording.name!r} has no joint for {segment!r}"
    raise InputError(f"{wrong}; valid: one of {', '.join(names)}")
