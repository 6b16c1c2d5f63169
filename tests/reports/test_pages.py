"""Pages of HTML that need nothing beside themselves."""

import base64
from html.parser import HTMLParser
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from manikin.reports.pages import render, run_page

VOID = {"meta", "img"}


class Reader(HTMLParser):
    """Keeps the texts, and checks that every element is closed."""

    def __init__(self, html):
        super().__init__()
        self.open, self.texts, self.seen = [], [], []
        self.feed(html)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.seen.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


def a_summary(text, **more):
    row = {
        "stage": text, "name": text, "where": text, "measured": 0.123456, "sense": "<=", "limit": 2.0,
        "unit": "m", "time_s": None, "held": False,
    }  # fmt: skip
    failure = {"stage": text, "reason": text}
    summary = {
        "scenario": text,
        "succeeded": False,
        "planned": False,
        "failure": failure,
        "requirements": [row],
    }
    return {**summary, "note": text, "parts": [{"a": 1.5}, {"a": None}], **more}


@given(st.text(alphabet=st.characters(codec="utf-8", exclude_characters="\r\x00"), min_size=1, max_size=40))
def test_any_text_is_shown_as_it_is(text):
    read = Reader(run_page(Path("no such folder"), a_summary(text)))
    shown = "".join(read.texts)
    assert shown.count(text) >= 9  # title and heading, verdict (3), requirement (3), note
    assert [tag for tag, _ in read.seen].count("script") == 0
    entry = {"name": text, "link": text, "value": 1.25}
    page = render(
        "overview", files=[], refused=[{"reason": text}], duration_s=1.0, folder=text, rows=[entry],
        columns=[{"key": "value", "heading": text, "decimals": 1}],
    )  # fmt: skip
    read = Reader(page)
    assert "".join(read.texts).count(text) >= 4
    assert [attributes["href"] for tag, attributes in read.seen if tag == "a"] == [text]


def test_a_page_needs_no_other_file(tmp_path):
    (tmp_path / "figures").mkdir()
    for name in ("zmp", "com", "scene"):
        (tmp_path / f"figures/{name}.png").write_bytes(b"\x89PNG not quite " + name.encode())
    read = Reader(run_page(tmp_path, a_summary("walk")))
    pictures = [attributes for tag, attributes in read.seen if tag == "img"]
    assert [picture["alt"] for picture in pictures] == ["scene", "com", "zmp"]
    kind, data = pictures[0]["src"].split(",")
    assert kind == "data:image/png;base64"
    assert base64.b64decode(data) == b"\x89PNG not quite scene"
    assert {tag for tag, attributes in read.seen if "src" in attributes} == {"img"}
    assert not [tag for tag, _ in read.seen if tag in ("a", "link", "script")]


def test_numbers_have_four_digits_and_broken_requirements_are_marked():
    read = Reader(run_page(Path("no such folder"), a_summary("walk")))
    assert {"0.1235", "parts.0.a", "1.5", "parts.1.a", "-", "NOT KEPT"} <= set(read.texts)
    assert [attributes.get("class") for tag, attributes in read.seen if tag == "tr"].count("failed") == 1
