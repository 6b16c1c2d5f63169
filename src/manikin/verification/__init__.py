"""Independent check of contact plans, of this planner or another; see ``docs/contact-plan.md``."""

from manikin.verification.check import check_contact_plan
from manikin.verification.plan_file import (
    ContactPlanFile,
    PlannedContacts,
    PlannedStage,
    load_contact_plan,
    parse_contact_plan,
)

__all__ = [
    "ContactPlanFile", "PlannedContacts", "PlannedStage", "check_contact_plan", "load_contact_plan",
    "parse_contact_plan",
]  # fmt: skip
