"""Roles and segments of markers by their names.

Known are the names of Plug-in Gait and Helen Hayes sets, of OpenSim's gait models, and of sets that spell
the place out (``R_Knee_Lat``, ``L.ASIS``, ``r_shoulder``). Case, separators and a subject's prefix
(``Anna:LASI``) do not matter. Points that Plug-in Gait computes (``LFEP``, ``PELO``) and names that say
nothing are left out. Also the joints at which the segments of a recorded skeleton begin.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from manikin.body.segments import SIDES
from manikin.errors import InputError
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.readers.skeleton_recording import Recording

_SIDED: tuple[tuple[str, str, str], ...] = (
    (r"asis?|ias|eias|eas|fwt", "asis", "pelvis"),
    (r"psis?|ips|eips|eps|bwt", "psis", "pelvis"),
    (r"(iliac)?crest|ilc|csi|crete", "", "pelvis"),
    (r"hjc|hip(joint)?cent(er|re)", "hip", "pelvis"),
    (r"knee?1?|knee(lat|lateral)|lfcv?|lek|fle|lfe|lkn|lepi|kneelatepicondyle|cl", "knee_lateral", "thigh"),
    (
        r"kne2|knein|knem|knee(med|medial)|mfcv?|mek|mkne?|mknee|fme|mfe|kneemedepicondyle|cm",
        "knee_medial",
        "thigh",
    ),
    (r"thi\d?|th\d+|th[la][pd]|thigh\w*|f\d\d|gtr?|ftc|trc|troch?\w*|greatertrochanter", "", "thigh"),
    (r"ank|ankle|ankle(lat|lateral)|lmalv?|fal|lm|ml|mall|latmalleolus", "ankle_lateral", "leg"),
    (r"ank2|ankin|ankm|ankle(med|medial)|mmalv?|mank|mankle|tam|sph|mm|medmalleolus", "ankle_medial", "leg"),
    (
        r"tib\d?|tb\d+|tibia\w*|sha|shn|sh\d+|shank\w*|t\d\d|ti(a[pd]|lat)|fax|ttc|tta|att|tub|fib\w*|tt|hf",
        "",
        "leg",
    ),
    (r"hee|heel|heelfoot|cal|calca?|fcc|ca", "heel", "foot"),
    (r"toe|toetip|mt2|2meta|fm2|tt2|hal|hlx|met", "toe", "foot"),
    (
        r"mt[135]|[15]meta|toe(lat|med)|foo|foo2|[sfv]mh|midfoot\w*|fm[15]|mfh\d|p[15]mt|foot(lat|med)\w*|latfoot|"
        r"(first|fifth)metatarsal|d[15]m",
        "",
        "foot",
    ),
    (r"sho|sh|should|shoulder|acr|ac|acrom|acromi[ou]n|acromium|saj", "shoulder", "thorax"),
    (r"bak|bac|off|offset|sternum|cla|clav|clavicle|sca|scap\w*|ang|aa", "", "thorax"),
    (
        r"elb|elbow|elb(lat|lateral)|elbow(lat|lateral)|lel|hle|lhe|epilat|armlatepicondyle|cou",
        "elbow_lateral",
        "upper_arm",
    ),
    (
        r"elb2|elbin|elbm|elb(med|medial)|elbow(med|medial)|melbow|mel|hme|mhe|epimed|armmedepicondyle",
        "elbow_medial",
        "upper_arm",
    ),
    (r"upa|ua\d|humerus|hum|arm|bicep\w*|triceps?|upperarm\w*", "", "upper_arm"),
    (
        r"wra|wri?|wrist|wrist(radius|rad|lat|thumb)|rad|rsp|rs|faradius|radialstyloid",
        "wrist_radius",
        "forearm",
    ),
    (r"wrb|wri2|wrist(ulna|uln|med|pinky)|uln|uhe|usp|us|faulna|ulnarstyloid", "wrist_ulna", "forearm"),
    (r"fra|frm|forearm\w*|la\d|olecranon|ulna|fasuperior", "", "forearm"),
    (r"fin|finger|hand\w*|[mh]cp?\d?|hm\d|hmh\d|topofhand|pinky|ballhand|mai", "", "hand"),
    (
        r"[fb]hd|hd[fb]|head|(front|back)head|head(front|back)|ear|te?mp|temple|temp|tet|auricularis",
        "",
        "head",
    ),
)
"""Stem behind the side, role (empty for a marker of which only the segment is known), segment.

Of the ISB's bony landmarks (``L_IAS``, ``R_FLE``: van Sint Jan, "Color atlas of skeletal landmark
definitions", 2007) those that Qualisys' and Leardini's sets use; of French laboratories
(``EIAS``, ``CM``, ``COU``), Xsens (``pRightASI``), Vicon's body (``LFWT``), and points that OpenCap
adds (``r.ASIS_study``)."""

_CENTRAL: tuple[tuple[str, str, str], ...] = (
    (r"v?sacr?|sacrum|vsacral|sacral", "sacrum", "pelvis"),
    (r"pelvis\d", "", "pelvis"),
    (r"c7(spinalprocess)?|cv7", "c7", "thorax"),
    (r"clav?|ij|snj|sternalnotch|sternotch|sternumnotch|jug|suprasternale|sup", "notch", "thorax"),
    (r"strn|px|sxs|sternum|ster|str|xiphoid|xyph\w*", "xiphoid", "thorax"),
    (r"t\d+(spinalprocess)?|tv\d+", "", "thorax"),
    (r"tophead|headtop|topofhead|backofhead|ari|glab\w*|vertex|hv|occ|sel|tete[hdg]", "", "head"),
)

_MIDLINE = frozenset({"pelvis", "thorax", "head"})
_SIDES = (("left", "left"), ("right", "right"), ("l", "left"), ("r", "right"))


def _sided(segment: str, side: str) -> str:
    return segment if segment in _MIDLINE else f"{side}_{segment}"


LANDMARKS: Mapping[str, str] = MappingProxyType(
    {role: segment for _, role, segment in _CENTRAL if role}
    | {f"{side}_{role}": _sided(segment, side) for side in SIDES for _, role, segment in _SIDED if role}
)
"""Segment of each place that a marker may mark."""

SEGMENTS = tuple(
    dict.fromkeys(_sided(segment, side) for side in SIDES for *_, segment in (*_CENTRAL, *_SIDED))
)
"""Segments that markers are on."""

UNUSED = "unused"
"""What a marker map says of a marker that marks nothing."""

FEWEST_WITH_PREFIX = 8
"""Markers from which a beginning that all names share is taken for the subject's."""

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
    """Recognise the markers of a recording that are seen at all, by its marker map or by their names."""
    plain = _plain(recording.marker_names)
    computed = _computed(set(plain.values())) | _below_knees(set(plain.values()))
    roles: dict[str, str] = {}
    segments: dict[str, str] = {}
    told = recording.marker_map
    names = [recording.marker_names[k] for k in np.flatnonzero(recording.seen.any(axis=0))]
    for name in sorted(names, key=lambda name: (name not in told, not _is_study(name))):
        if name in told:
            found = _told(told[name])
        else:
            found = None if plain[name] in computed else next(_places(name, plain[name]), None)
        if found is not None:
            role, segments[name] = found
            if role:
                roles.setdefault(role, name)
    in_order = {name: segments[name] for name in plain if name in segments}
    others = tuple(name for name in plain if name not in segments)
    return MarkerSet(MappingProxyType(roles), MappingProxyType(in_order), others)


def _plain(names: Sequence[str]) -> dict[str, str]:
    """Small letters and digits of each name, without what stands before the name of a marker.

    That is a subject (``Anna:LASI``, ``A22_LASI``: what all names begin with), the ``p`` of Xsens' points
    (``pRightASI``) and OpenCap's ``_study``.
    """
    own = {name: name.rpartition(":")[2] for name in names}
    parts = re.match(r".*[_ .-]", min(own.values(), default="")) if len(own) > FEWEST_WITH_PREFIX else None
    shared = parts.group() if parts and all(stem.startswith(parts.group()) for stem in own.values()) else ""
    found = {}
    for name, stem in own.items():
        stem = re.sub(r"^p(?=[A-Z])", "", stem[len(shared) :])
        found[name] = re.sub(r"[^a-z0-9]", "", re.sub(r"_study$", "", stem.lower()))
    return found


def is_known(name: str) -> bool:
    """Whether a name says where a marker is."""
    return next(_places(name, _plain([name])[name]), None) is not None


def _told(place: str) -> tuple[str, str] | None:
    """Role and segment by what a marker map says."""
    if place in LANDMARKS:
        return place, LANDMARKS[place]
    return ("", place) if place in SEGMENTS else None


def _is_study(name: str) -> bool:
    """Whether it is a marker that OpenCap adds to the centres of joints, whose names say the same."""
    return name.lower().endswith("_study")


def _below_knees(names: set[str]) -> set[str]:
    """BTS' second markers of knees, at the fibula: the first ones are ``RKNE1``, ``r knee 1``."""
    ones = {name for name in names if re.fullmatch(r"[lr]knee?1", name)}
    return {name[:-1] + "2" for name in ones}


def _places(name: str, plain: str) -> Iterator[tuple[str, str]]:
    """Role and segment."""
    for pattern, role, segment in _CENTRAL:
        if re.fullmatch(pattern, plain):
            yield role, segment
    for side, stem in _sides(name, plain):
        for pattern, role, segment in _SIDED:
            if re.fullmatch(pattern, stem):
                yield role and f"{side}_{role}", _sided(segment, side)


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
