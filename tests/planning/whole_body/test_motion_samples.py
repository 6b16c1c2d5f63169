"""One pass over the samples gives what Pinocchio gives for each alone."""

import numpy as np
import pinocchio as pin

from manikin.motion.dynamics import MotionSampler
from manikin.numerics.banded import SampledBasis
from manikin.planning.whole_body.fit_job import phase_knots, sample_times

FRAMES = ("left_foot", "right_hand")


def test_frames_jacobians_and_centre_of_mass(person):
    """To 1e-12: the same quantities from other products."""
    rng = np.random.default_rng(9)
    knots = phase_knots(np.array([0.0, 0.3]), 0.1)
    basis = SampledBasis.at(sample_times(knots, 2), knots, 5)
    points = np.tile(person.standing_posture(), (basis.size, 1)) + 0.2 * rng.normal(
        size=(basis.size, person.nq)
    )
    sampler = MotionSampler(person, FRAMES, basis)
    motion = sampler.sample(points)
    model, data = person.pinocchio, person.pinocchio.createData()
    jacobians = [sampler.frame_jacobian(motion, number) for number in range(len(FRAMES))]
    for s, q in enumerate(motion.states.q):
        np.testing.assert_allclose(
            motion.com_jacobian[s], pin.jacobianCenterOfMass(model, data, q), atol=1e-12
        )
        np.testing.assert_allclose(motion.com[s], data.com[0], atol=1e-12)
        pin.updateFramePlacements(model, data)
        for number, name in enumerate(FRAMES):
            frame = person.effector_frame(name)
            expected = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            np.testing.assert_allclose(jacobians[number][s], expected, atol=1e-12)
            np.testing.assert_allclose(motion.frames[s, number], data.oMf[frame].homogeneous, atol=1e-12)
