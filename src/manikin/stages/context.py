"""What every stage of a run reads: the scenario with its body, its scene and what was found before.

Everything here is in the frame of the task (:mod:`manikin.scenarios.placement`): the stages work there, and
results are moved to the world where they leave, in :class:`~manikin.stages.report.Report` and
:class:`~manikin.stages.result.RunResult`.
"""

from dataclasses import dataclass, replace

from manikin.body import BodyModel
from manikin.centroidal import CentroidalProblem, KeyframeProblem
from manikin.contact import ContactSchedule
from manikin.contact_planning import ContactPlan
from manikin.errors import ScenarioError
from manikin.motion import Motion
from manikin.scenarios import Scenario
from manikin.scene import Scene
from manikin.spatial import FloatArray, PlanarTransform
from manikin.stages.world_frame import reason_in_world
from manikin.wholebody import Passage, WholeBodySettings, measure_passage
from manikin.wholebody.manner import manner_of


@dataclass(frozen=True, eq=False)
class RunContext:
    """One job, in the frame of its task.

    Attributes:
        given: The scenario as it was given, in the world.
        transform_task_to_world: From the frame of the task to the world.
        scenario: With the supports that were found, where a file can list them.
        body: Its body.
        scene: Its scene.
        scene_in_world: The scene that was given.
        settings: Options of the whole-body stage.
        problem: What the centre of mass is planned for; None as long as there are no supports.
        plan: The contacts that were found from start and goal, or None.
    """

    given: Scenario
    transform_task_to_world: PlanarTransform
    scenario: Scenario
    body: BodyModel
    scene: Scene
    scene_in_world: Scene
    settings: WholeBodySettings
    problem: CentroidalProblem | KeyframeProblem | None = None
    plan: ContactPlan | None = None

    @classmethod
    def of(cls, scenario: Scenario, settings: WholeBodySettings | None = None) -> "RunContext":
        """Build what a scenario describes, in the frame of its task.

        Args:
            scenario: In the world, with supports or without.
            settings: Options of the whole-body stage; the defaults in the scenario's manner when omitted.

        Raises:
            ScenarioError: If the body, the scene or the supports cannot be built.
        """
        settings = settings or WholeBodySettings(manner=manner_of(scenario.manner))
        body, scene = scenario.build_body(), scenario.build_scene()
        if scenario.file.supports is not None:
            scenario.check_contacts(scene)
        transform, task = scenario.transform_task_to_world, scenario.in_task_frame()
        bare = cls(scenario, transform, task, body, task.build_scene(), scene, settings)
        return bare if task.file.supports is None else bare._posed(task)

    def with_supports(self, scenario: Scenario) -> "RunContext":
        """The same for a scenario with supports, whose problem is posed.

        Args:
            scenario: In the frame of the task.

        Raises:
            ScenarioError: If the supports do not fit the scene, or a value is out of range.
        """
        scenario.check_contacts(self.scene)
        return self._posed(scenario)

    def posed_problem(self) -> CentroidalProblem | KeyframeProblem:
        """What the centre of mass is planned for.

        Raises:
            ScenarioError: If there are no supports yet.
        """
        if self.problem is None:
            raise ScenarioError(f"scenario {self.scenario.name!r} has no supports; valid: with supports")
        return self.problem

    @property
    def has_supports(self) -> bool:
        """Whether the scenario lists supports."""
        return self.scenario.file.supports is not None

    @property
    def is_recorded(self) -> bool:
        """Whether the centre of mass follows the key frames of a recording."""
        return isinstance(self.problem, KeyframeProblem)

    @property
    def padded(self) -> tuple[str, ...]:
        """Names of the obstacles that any part of the body may lean on."""
        return self.scenario.padded

    @property
    def known_postures(self) -> FloatArray | None:
        """(n + 1, nq) postures of the contact plan, or None."""
        return None if self.plan is None else self.plan.postures

    def _posed(self, scenario: Scenario) -> "RunContext":
        try:
            problem = scenario.build_keyframe_problem() or scenario.build_centroidal_problem()
        except ScenarioError as error:
            raise ScenarioError(reason_in_world(str(error), self.transform_task_to_world)) from None
        return replace(self, scenario=scenario, problem=problem)

    def passage(self, schedule: ContactSchedule, motion: Motion) -> Passage:
        """How low the body comes, and how near its head to the scene."""
        return measure_passage(self.body, self.scene, schedule, motion, self.padded)
