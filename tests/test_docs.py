"""The documentation: what is taken from the code is up to date, examples run, commands exist."""

import importlib.util
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer

import manikin
from manikin.cli import app
from manikin.motion.file import write_motions
from manikin.pipeline.study import study_jobs
from manikin.reports import figures
from manikin.scenarios import list_variants, load_scenario
from manikin.scenarios.stance_file import judge_stance_file
from manikin.scenarios.study_file import load_study

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = {page.name: page.read_text(encoding="utf-8") for page in sorted(DOCS.glob("*.md"))}
COMMANDS = typer.main.get_command(app).commands
EXAMPLE = re.compile(r"(<!-- example: slow -->\n)?```python\n(.*?)```", re.DOTALL)
PYTHON = [
    pytest.param(match[2], id=f"{name}-{number}", marks=[pytest.mark.slow] if match[1] else [])
    for name, text in PAGES.items()
    for number, match in enumerate(EXAMPLE.finditer(text))
]


def yaml_examples(kind):
    pattern = re.compile(rf"<!-- example: {kind} -->\n```yaml\n(.*?)```", re.DOTALL)
    return [match[1] for text in PAGES.values() for match in pattern.finditer(text)]


def keys_of(value):
    """Every key of nested mappings; those of the torques are joint names."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield key
            if key != "peak_torque_Nm":
                yield from keys_of(item)
    elif isinstance(value, list):
        for item in value:
            yield from keys_of(item)


def script(name):
    """A script of the folder as a module."""
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def generator():
    """The script ``docs/generate.py``."""
    script("result_tables")  # imported by the other
    return script("generate")


@pytest.fixture(scope="module")
def generated(generator):
    """What ``docs/generate.py`` would write."""
    return generator.files()


def test_no_page_has_the_marks_of_a_merge():
    assert not [name for name, text in PAGES.items() if re.search(r"^(<{7}|>{7}) ", text, re.M)]


def test_schemas_and_tables_are_up_to_date(generated):
    """After a change: ``python docs/generate.py``."""
    assert [path.name for path, text in generated.items() if path.read_text(encoding="utf-8") != text] == []


def test_a_report_replaces_the_one_before(generator, tmp_path, monkeypatch):
    kept = json.loads((DOCS / "results.json").read_text(encoding="utf-8"))
    (tmp_path / "report.json").write_text(json.dumps({**kept, "runs": kept["runs"][:2]}))
    monkeypatch.setattr(generator, "RESULTS", tmp_path / "results.json")
    generator.take_over_results([str(tmp_path / "report.json")])
    assert len(generator.kept_results()["runs"]) == 2


def test_every_generated_block_was_found(generated):
    marked = {DOCS / name for name, text in PAGES.items() if "<!-- generated:" in text}
    assert marked <= set(generated)


@pytest.mark.parametrize("source", PYTHON)
def test_python_examples_run(source, tmp_path, monkeypatch, finished_run, runs):
    """Whole runs of built-in scenarios are those that the tests of the pipeline look at."""
    monkeypatch.setattr(manikin, "run", runs)
    run = tmp_path / "runs/platform"
    run.mkdir(parents=True)
    write_motions(run / "motion.h5", finished_run)
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(compile(source, "<documentation>", "exec"), names)
    if "result" in names and hasattr(names["result"], "summary"):
        missing = {key for key in keys_of(names["result"].summary) if f"`{key}`" not in PAGES["json.md"]}
        assert missing == set()


def test_the_motion_file_is_read_in_ten_lines_without_manikin():
    (example,) = EXAMPLE.findall(PAGES["motion-file.md"])
    lines = [line for line in example[1].splitlines() if line and not line.startswith("import")]
    assert len(lines) <= 10
    assert "manikin" not in example[1]


@pytest.mark.slow
@pytest.mark.parametrize("quick", [True, pytest.param(False, marks=pytest.mark.long)])
def test_scenario_examples_succeed(tmp_path, runs, quick):
    """The first one is the step whose run the tests share, which has less time than the page gives it."""
    first, *others = yaml_examples("scenario")
    assert runs.step_file().read_text() == first
    results = [runs.step(quick=quick)]
    for text in others:
        (tmp_path / "example.yaml").write_text(text)
        results.append(manikin.run(tmp_path / "example.yaml"))
    for result in results:
        assert result.succeeded, result.summary["failure"]


def test_examples_that_extend_a_scenario_are_valid_with_every_variant(tmp_path):
    examples = yaml_examples("extends")
    assert examples
    for text in examples:
        (tmp_path / "example.yaml").write_text(text)
        assert load_scenario(tmp_path / "example.yaml").name
        assert list_variants(tmp_path / "example.yaml")


def test_study_examples_are_read(tmp_path):
    """Beside the scenario that the page gives."""
    (scene,) = re.findall(r"```yaml\n(name: step\n.*?)```", PAGES["study.md"], re.DOTALL)
    (tmp_path / "step.yaml").write_text(scene)
    examples = yaml_examples("study")
    assert examples
    for text in examples:
        (tmp_path / "study.yaml").write_text(text)
        jobs = study_jobs(load_study(tmp_path / "study.yaml"))
        assert all(job.scene is not None for job in jobs)


def test_stance_examples_give_every_documented_key(tmp_path):
    examples = yaml_examples("stance")
    assert examples
    for text in examples:
        (tmp_path / "stance.yaml").write_text(text)
        report = judge_stance_file(tmp_path / "stance.yaml").as_dict(polytope=True)
        assert {key for key in keys_of(report) if f"`{key}`" not in PAGES["json.md"]} == set()
        json.dumps(report, allow_nan=False)


@pytest.mark.parametrize("name", PAGES)
def test_commands_and_options_exist(name):
    blocks = "".join(re.findall(r"```bash\n(.*?)```", PAGES[name], re.DOTALL))
    for line in re.findall(r"^(?:\.venv/bin/)?manikin .*$", blocks, re.MULTILINE):
        words = line.split()
        assert words[1] in COMMANDS, line
        known = {
            option for item in COMMANDS[words[1]].params for option in (*item.opts, *item.secondary_opts)
        }
        assert {word for word in words if word.startswith("--")} <= known, line
    for command in re.findall(r"`manikin (\w+)", PAGES[name]):
        assert command in COMMANDS


def test_every_figure_is_set_beside_those_of_the_thesis():
    """Each function is named, and so is each figure that shows what a run of a scenario shows."""
    text = PAGES["figures.md"]
    assert set(re.findall(r"\w+_figure\b", text)) == {n for n in figures.__all__ if n.endswith("_figure")}
    rows = " ".join(re.findall(r"^\| ([^:|]*):", text, re.M))
    evaluated = "5.12 5.13 5.14 5.15 5.16 5.22 5.23 6.7 6.9 6.10 7.8 7.9 7.14 7.15 7.16 7.17 7.18"
    assert set(evaluated.split()) <= set(re.findall(r"\d\.\d+", rows))


def test_every_module_is_in_the_api_reference():
    """Modules of one file, and packages that define something; other ``__init__`` only hand names on."""
    listed = re.findall(
        r"^::: (manikin[\w.]*)", "\n".join(p.read_text() for p in (DOCS / "api").glob("*.md")), re.M
    )
    source = ROOT / "src"
    modules = {
        ".".join(path.relative_to(source).with_suffix("").parts)
        for path in (source / "manikin").rglob("*.py")
        if path.name not in ("__init__.py", "__main__.py", "version.py")
    }
    modules |= {
        ".".join(path.parent.relative_to(source).parts)
        for path in (source / "manikin").rglob("*/__init__.py")
        if re.search(r"^(def|class) ", path.read_text(encoding="utf-8"), re.M)
    }
    assert set(listed) - {"manikin"} == modules
    assert len(listed) == len(set(listed))


def test_every_page_is_in_the_navigation():
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    pages = [page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md")]
    assert [page for page in pages if f" {page}" not in navigation] == []


def test_ci_builds_the_documentation_strictly():
    assert "mkdocs build --strict" in (ROOT / ".ci/run").read_text(encoding="utf-8")


def test_formulas_become_mathml():
    """A fraction and a relation, without the marks of TeX and of the Markdown extension."""
    pytest.importorskip("latex2mathml", reason="the extra docs is not installed")
    mathml = script("mathml").as_mathml('<p>If <span class="arithmatex">\\(\\frac{a}{b} &lt; 1\\)</span></p>')
    assert "<mfrac><mi>a</mi><mi>b</mi></mfrac>" in mathml.replace("<mrow>", "").replace("</mrow>", "")
    assert "&lt;" in mathml or "&#x0003C;" in mathml
    assert "arithmatex" not in mathml
    assert "\\" not in mathml
    lines = r"\begin{aligned} a &= b \\ c &= d \end{aligned}".replace("&", "&amp;")
    aligned = script("mathml").as_mathml(f'<div class="arithmatex">\\[{lines}\\]</div>')
    assert aligned.count("<mtr>") == 2


def test_a_browser_draws_what_the_hook_makes_and_tells_what_is_not_drawn(tmp_path):
    """By ``docs/screenshots/shoot.mjs``, where Node, Puppeteer and Chromium are installed."""
    pytest.importorskip("latex2mathml", reason="the extra docs is not installed")
    folder = DOCS / "screenshots"
    if shutil.which("node") is None or not (folder / "node_modules").is_dir():
        pytest.skip("no headless Chromium: run npm install in docs/screenshots")
    raw = '<span class="arithmatex">\\(\\frac{a}{b}\\)</span>'
    (tmp_path / "raw.html").write_text(raw)
    (tmp_path / "drawn.html").write_text(script("mathml").as_mathml(raw))
    for name, status in (("drawn", 0), ("raw", 1)):
        command = ["node", str(folder / "shoot.mjs"), str(tmp_path), str(tmp_path / f"{name}.html")]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == status, done.stdout + done.stderr
        assert (tmp_path / f"{name}.png").stat().st_size > 0
        assert ("not drawn" in done.stdout) == bool(status)


def test_every_moving_picture_is_shown_and_small():
    files = sorted((DOCS / "images/gallery").iterdir())
    shown = re.findall(r"\(images/gallery/([\w.]+)\)", PAGES["gallery.md"])
    assert sorted(shown) == [file.name for file in files]
    assert [file.name for file in files if file.stat().st_size > 300_000] == []


def test_every_picture_of_a_page_is_shown_and_all_are_small():
    files = sorted((DOCS / "images/pages").iterdir())
    shown = re.findall(r"\(images/pages/([\w.]+)\)", PAGES["pages.md"])
    assert sorted(shown) == [file.name for file in files]
    assert sum(file.stat().st_size for file in files) <= 1_000_000


def test_pages_fetch_nothing_from_other_sites():
    """What the theme would fetch is in the repository; ``docs/screenshots/shoot.mjs`` watches whole pages."""
    settings = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    assert "font: false" in settings
    assert not re.search(r"https?://", settings)
    (shim,) = re.findall(r"polyfills: \[(\S+)\]", settings)
    assert (DOCS / shim).is_file()
