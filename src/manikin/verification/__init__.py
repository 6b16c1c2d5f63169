"""Independent check of contact plans, of this planner or another; see ``docs/contact-plan.md``."""

from manikin.verification.check import ContactPlanCheck, check_contact_plan
from manikin.verification.plan_file import (
    ContactPlanFile,
    PlannedContacts,
    PlannedStage,
    load_contact_plan,
    parse_contact_plan,
)

__all__ = [
    "ContactPlanCheck", "ContactPlanFile", "PlannedContacts", "PlannedStage", "check_contact_plan",
    "load_contact_plan", "parse_contact_plan",
]  # fmt: skip
