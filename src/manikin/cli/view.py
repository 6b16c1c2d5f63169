"""``manikin view``: a motion in the browser, or the contacts of a body that is moved by hand."""

from pathlib import Path
from typing import Annotated

import typer

from manikin.cli.console import announce, refuse


def view(
    source: Annotated[
        str,
        typer.Argument(
            metavar="DIR|FILE",
            help="Run directory or motion file (.h5); with --contacts a scenario's name or file.",
        ),
    ],
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 picks a free one.")] = 8080,
    contacts: Annotated[
        bool, typer.Option("--contacts", help="Drag the body of a scenario and watch its contacts.")
    ] = False,
    samples: Annotated[
        int | None,
        typer.Option(metavar="N", min=100, max=1_000_000, help="With --contacts: samples of each limb."),
    ] = None,
) -> None:
    """Show a motion in the browser, or the contacts of a body moved by hand; on this computer only."""
    if contacts:
        from manikin.planning.contacts.single_contact import LiveContacts
        from manikin.scenarios import load_scenario
        from manikin.scenarios.sequence import contact_rules
        from manikin.scenarios.world import start_posture
        from manikin.viewer import serve_contacts

        job = load_scenario(source)
        body, scene = job.build_body(), job.build_scene()
        q, rules = start_posture(job, body, scene), contact_rules(job, body)
        live = LiveContacts(body, scene, q, samples=samples or 10_000, seed=job.seed, rules=rules)
        serve_contacts(live, port, announce)
        return
    refuse(samples is not None, "--samples", "it is for --contacts")
    from manikin.motion.file import read_motions
    from manikin.pipeline.run_directory import other_motions

    content = read_motions(Path(source))
    others = {name: read_motions(path) for name, path in other_motions(Path(source)).items()}
    from manikin.viewer import serve

    serve(content, port=port, announce=announce, others=others)
