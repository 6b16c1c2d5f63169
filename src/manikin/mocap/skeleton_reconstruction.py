"""A recorded skeleton's motion as a motion of our human."""

from manikin.body import BodyModel
from manikin.mocap.closed_form import closed_form
from manikin.mocap.follow import follow
from manikin.mocap.guides import guides, trunk_turns
from manikin.mocap.joint_centres import CENTRES, joint_centres
from manikin.mocap.proportions import human_of
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recording import Recording
from manikin.mocap.targets import origin_targets


def reconstruct_skeleton(
    recording: Recording, body: BodyModel | None, sex: str, mass: float | None
) -> Reconstruction:
    """Motion of our human that follows a skeleton; see :func:`manikin.mocap.reconstruct.reconstruct`.

    Hips, knees, ankles, shoulders, elbows and wrists are followed (:mod:`manikin.mocap.joint_centres`);
    the turns of pelvis, thorax, head, feet and hands count less (:mod:`manikin.mocap.guides`). The
    first frame starts from the closed form (:mod:`manikin.mocap.closed_form`), every other one from
    the frame before. Our shoulders are fixed in the thorax: movements of a recorded shoulder girdle
    remain as residuals.
    """
    centres = joint_centres(recording)
    measured = human_of(centres, sex, mass)
    person = measured if body is None else body
    pelvis, thorax = (trunk_turns(recording, centres, name) for name in ("pelvis", "thorax"))
    wanted = origin_targets(centres, CENTRES)
    followed = wanted.and_these(guides(recording, person, centres, pelvis, thorax))
    q, residual = follow(person, followed, closed_form(person, centres, pelvis, thorax), recording.rate)
    return Reconstruction(person, recording.time, q, wanted, residual[:, : len(wanted.names)])
